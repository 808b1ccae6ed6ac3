//! Effective bulk modulus of the cylinder's oil against pressure.

use crate::scalar::Scalar;

/// E(p) = a1·E_max·ln(a2·p/p_max + a3) [Pa] (Fri & Fahlén 2017, (3.2)), natural logarithm.
#[derive(Debug, Clone, Copy)]
pub struct BulkModulus<S> {
    pub factor: S,
    pub slope: S,
    pub offset: S,
}

impl<S: Scalar> BulkModulus<S> {
    pub fn new(e_max: S, p_max: S, a_1: S, a_2: S, a_3: S) -> Self {
        BulkModulus { factor: a_1 * e_max, slope: a_2 / p_max, offset: a_3 }
    }

    /// E at the pressure `p` [Pa]. A pressure so far below zero that the logarithm would vanish is
    /// outside the law; its argument is held at 1.05.
    #[inline(always)]
    pub fn at(&self, p: S) -> S {
        self.factor * (self.slope * p + self.offset).max(S::constant(1.05)).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_free_lifts_oil_has_1_67_gigapascals_at_rest_and_stiffens_with_pressure() {
        // Table 5.1: 0.15703·1.8 GPa·ln(367.5), ln(11.841 + 367.5) at p_max.
        let oil = BulkModulus::new(1.8e9, 2.8e7, 0.15703, 11.841, 367.5);
        assert!((oil.at(0.0) - 0.15703 * 1.8e9 * 367.5f64.ln()).abs() < 1e-3);
        assert!((oil.at(2.8e7) - 0.15703 * 1.8e9 * 379.341f64.ln()).abs() < 1e-3);
        let mut last = 0.0;
        for k in -10..100 {
            let e = oil.at(f64::from(k) * 1e6);
            assert!(e > last);
            last = e;
        }
    }

    #[test]
    fn the_bulk_modulus_stays_positive_however_far_the_pressure_falls() {
        let oil = BulkModulus::new(1.8e9, 1e6, 0.15703, 1e4, 1.5);
        for p in [0.0, -1e5, -1e7, -1e12, f64::MIN] {
            assert!(oil.at(p) > 0.0 && oil.at(p).is_finite(), "{p}");
        }
    }
}
