//! Pressure in the cylinder.

use crate::scalar::Scalar;

/// dp_A/dt = E(p_A)/V(x)·(Q − A_c·v) [Pa/s] with V(x) = V0 + A_c·x
/// (Fri & Fahlén 2017, (3.20), (3.21)). `flow_in` is Q, into the cylinder: −q_A while lowering.
#[inline(always)]
pub fn pressure_rate<S: Scalar>(bulk_modulus: S, v_0: S, area: S, x: S, v: S, flow_in: S) -> S {
    stiffness(bulk_modulus, v_0, area, x) * (flow_in - area * v)
}

/// E/V(x) [Pa/m³]. The volume is held above a tenth of V0: a cylinder below its bottom by more is outside the law.
#[inline(always)]
pub fn stiffness<S: Scalar>(bulk_modulus: S, v_0: S, area: S, x: S) -> S {
    bulk_modulus / (v_0 + area * x).max(S::constant(0.1) * v_0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oil_that_neither_flows_nor_is_displaced_keeps_its_pressure() {
        assert_eq!(pressure_rate(1.7e9, 0.0055, 0.0024, 0.9, 0.0, 0.0), 0.0);
        // Flow in makes room for a rising piston.
        assert!(pressure_rate(1.7e9, 0.0055, 0.0024, 0.9, 0.1, 0.0024 * 0.1).abs() < 1e-6);
    }

    #[test]
    fn a_sinking_piston_and_flow_in_raise_the_pressure() {
        assert!(pressure_rate(1.7e9, 0.0055, 0.0024, 0.9, -0.1, 0.0) > 0.0);
        assert!(pressure_rate(1.7e9, 0.0055, 0.0024, 0.9, 0.0, 1e-4) > 0.0);
    }

    #[test]
    fn a_longer_column_of_oil_is_softer_and_none_is_infinitely_stiff() {
        let stiffness = |x: f64| stiffness(1.7e9, 0.0055, 0.0024, x);
        assert!((stiffness(0.0) - 1.7e9 / 0.0055).abs() < 1e-3);
        assert!((stiffness(1.0) - 1.7e9 / 0.0079).abs() < 1e-3);
        assert!(stiffness(-1e9) <= 1.7e9 / 0.00055 * (1.0 + 1e-15) && stiffness(-1e9) > 0.0);
    }
}
