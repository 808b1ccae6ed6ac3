//! Dual numbers: a value and its exact derivatives along P directions.
//!
//! Forward-mode differentiation (Wengert, 1964): a + εa′ with ε² = 0. The value goes through the
//! very operations of the plain run, so it keeps its bits. Over [`crate::lanes::Lanes`] it gives
//! the derivatives of a whole ensemble.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::Scalar;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<S, const P: usize> {
    /// The value.
    pub re: S,
    /// Its derivatives.
    pub eps: [S; P],
}

impl<S: Scalar, const P: usize> Dual<S, P> {
    /// A variable: derivative one along `direction`.
    pub fn variable(re: S, direction: usize) -> Self {
        let mut eps = [S::zero(); P];
        eps[direction] = S::one();
        Dual { re, eps }
    }

    /// f(a) with f′(a) = `slope`.
    #[inline(always)]
    fn chain(self, value: S, slope: S) -> Self {
        let mut eps = self.eps;
        for k in 0..P {
            eps[k] = eps[k] * slope;
        }
        Dual { re: value, eps }
    }

    #[inline(always)]
    fn zip(self, other: Self, re: S, f: impl Fn(S, S) -> S) -> Self {
        let mut eps = self.eps;
        for k in 0..P {
            eps[k] = f(eps[k], other.eps[k]);
        }
        Dual { re, eps }
    }
}

impl<S: Scalar, const P: usize> Add for Dual<S, P> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, self.re + other.re, |a, b| a + b)
    }
}

impl<S: Scalar, const P: usize> Sub for Dual<S, P> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, self.re - other.re, |a, b| a - b)
    }
}

impl<S: Scalar, const P: usize> Mul for Dual<S, P> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (x, y) = (self.re, other.re);
        #[allow(clippy::suspicious_arithmetic_impl)] // the product rule
        { self.zip(other, x * y, |a, b| a * y + b * x) }
    }
}

impl<S: Scalar, const P: usize> Div for Dual<S, P> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.re / other.re;
        let inverse = S::one() / other.re;
        self.zip(other, quotient, |a, b| (a - quotient * b) * inverse)
    }
}

impl<S: Scalar, const P: usize> Neg for Dual<S, P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.re, S::constant(-1.0))
    }
}

impl<S: Scalar, const P: usize> Scalar for Dual<S, P> {
    type Mask = S::Mask;
    type Real = S::Real;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Dual { re: S::constant(value), eps: [S::zero(); P] }
    }
    #[inline(always)]
    fn from_real(value: S::Real) -> Self {
        Dual { re: S::from_real(value), eps: [S::zero(); P] }
    }
    #[inline(always)]
    fn real(self) -> S::Real {
        self.re.real()
    }
    #[inline(always)]
    fn implicit(root: S::Real, residual: Self, slope: S::Real) -> Self {
        let factor = S::from_real(-(S::Real::one() / slope));
        residual.chain(S::implicit(root, residual.re, slope), factor)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> S::Mask {
        self.re.lt(other.re)
    }
    #[inline(always)]
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        yes.zip(no, S::select(mask, yes.re, no.re), |a, b| S::select(mask, a, b))
    }
    #[inline(always)]
    fn is_finite(self) -> S::Mask {
        self.re.is_finite()
    }
    fn largest(self) -> f64 {
        self.re.largest()
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.re.sqrt();
        self.chain(root, S::constant(0.5) / root)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.re.exp();
        self.chain(value, value)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        self.chain(self.re.ln(), S::one() / self.re)
    }
    fn cos(self) -> Self {
        self.chain(self.re.cos(), -self.re.sin())
    }
    fn sin(self) -> Self {
        self.chain(self.re.sin(), self.re.cos())
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        let y = self.re.inverse_fourth_root();
        let y2 = y * y;
        self.chain(y, S::constant(-0.25) * (y2 * y2 * y))
    }
}
