//! The small volume between proportional valve and compensator.

use crate::scalar::Scalar;

/// dp_B/dt = E/V·(q_A − q_B) [Pa/s] (Fri & Fahlén 2017, (3.19)).
#[inline(always)]
pub fn pressure_rate<S: Scalar>(bulk_over_volume: S, q_a: S, q_b: S) -> S {
    bulk_over_volume * (q_a - q_b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_flows_in_and_does_not_flow_out_is_compressed() {
        // 1 cm³/s more into 2 cm³ of oil with 0.7 GPa.
        let rate = pressure_rate(7e8 / 2e-6, 3e-6, 2e-6);
        assert!((rate - 3.5e8).abs() < 1.0);
        assert_eq!(pressure_rate(7e8 / 2e-6, 3e-6, 3e-6), 0.0);
    }
}
