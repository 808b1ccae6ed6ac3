//! Pressure in the cylinder.

use crate::scalar::Scalar;

/// E/V(x) [Pa/m³] with V(x) = V0 + A_c·x: dp_A/dt is that times what flows in and is displaced, Q − A_c·v
/// (Fri & Fahlén 2017, (3.20), (3.21)). The volume is held above a tenth of V0: a cylinder below its bottom by more is
/// outside the law.
#[inline(always)]
pub fn stiffness<S: Scalar>(bulk_modulus: S, v_0: S, area: S, x: S) -> S {
    bulk_modulus / (v_0 + area * x).max(S::constant(0.1) * v_0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_longer_column_of_oil_is_softer_and_none_is_infinitely_stiff() {
        let stiffness = |x: f64| stiffness(1.7e9, 0.0055, 0.0024, x);
        assert!((stiffness(0.0) - 1.7e9 / 0.0055).abs() < 1e-3);
        assert!((stiffness(1.0) - 1.7e9 / 0.0079).abs() < 1e-3);
        assert!(stiffness(-1e9) <= 1.7e9 / 0.00055 * (1.0 + 1e-15) && stiffness(-1e9) > 0.0);
    }
}
