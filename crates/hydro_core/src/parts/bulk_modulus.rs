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
