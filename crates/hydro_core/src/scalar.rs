//! What physics may do with a number.
//!
//! The scalar has no ordering: `if x < 0` does not compile in physics. A comparison gives a
//! [`Mask`] and a choice is [`Scalar::select`]; both arms are evaluated, so guard the argument of
//! a root, a logarithm or a division, not its result.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::elementary;

/// One truth value per lane.
pub trait Mask: Copy + Debug {
    fn and(self, other: Self) -> Self;
    fn or(self, other: Self) -> Self;
    fn not(self) -> Self;
    /// True if any lane is.
    fn any(self) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self | other
    }
    #[inline(always)]
    fn not(self) -> Self {
        !self
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
}

/// Kinds of vector registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Vectors {
    Any,
    /// Those that the crate is compiled for: such a number stands in where the processor has none of the next.
    Compiled,
    Avx2,
    Avx512,
}

/// A real number as the physics sees it: `f64`, [`crate::lanes::Lanes`], or [`crate::dual::Dual`] of either.
pub trait Scalar:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    type Mask: Mask;
    /// How many `f64` it holds.
    const NUMBERS: usize;
    /// What the processor must have for it to exist: it is compiled for these vectors and no others.
    const NEEDS: Vectors = Vectors::Any;
    /// The same number without derivatives.
    type Real: Scalar<Mask = Self::Mask, Real = Self::Real>;

    /// A constant, the same in every lane, with zero derivative.
    fn constant(value: f64) -> Self;
    /// A value with zero derivative.
    fn from_real(value: Self::Real) -> Self;
    /// The value without its derivatives.
    fn real(self) -> Self::Real;
    /// The number whose value is `root` and whose derivatives follow from the implicit function
    /// theorem: `residual` is F at the root (its value is ignored), `slope` is ∂F/∂root.
    fn implicit(root: Self::Real, residual: Self, slope: Self::Real) -> Self;

    fn lt(self, other: Self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// False where the value is infinite or not a number.
    fn is_finite(self) -> Self::Mask;

    /// The largest value in any lane.
    fn largest(self) -> f64;

    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    /// Natural logarithm; the argument must be positive.
    fn ln(self) -> Self;
    fn cos(self) -> Self;
    fn sin(self) -> Self;
    /// x^(−1/4); the argument must be positive.
    fn inverse_fourth_root(self) -> Self;

    /// Times a constant.
    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        Self::constant(factor) * self
    }
    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0.0)
    }
    #[inline(always)]
    fn one() -> Self {
        Self::constant(1.0)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.lt(other), other, self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(other.lt(self), other, self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self::select(self.lt(Self::zero()), -self, self)
    }
    /// The nearest value in [lower, upper].
    #[inline(always)]
    fn clamp_to(self, lower: Self, upper: Self) -> Self {
        self.max(lower).min(upper)
    }
}

impl Scalar for f64 {
    type Mask = bool;
    const NUMBERS: usize = 1;
    type Real = f64;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn from_real(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn real(self) -> f64 {
        self
    }
    #[inline(always)]
    fn implicit(root: f64, _residual: f64, _slope: f64) -> Self {
        root
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask {
            yes
        } else {
            no
        }
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        elementary::ln(self)
    }
    fn cos(self) -> Self {
        libm::cos(self)
    }
    fn sin(self) -> Self {
        libm::sin(self)
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        elementary::inverse_fourth_root(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_take_the_first_of_equals_and_the_bound_that_is_crossed() {
        let f = |x: f64| x;
        assert_eq!((Scalar::max(f(1.0), 2.0), Scalar::min(f(1.0), 2.0)), (2.0, 1.0));
        assert_eq!(Scalar::max(0.0, -0.0).to_bits(), 0.0f64.to_bits());
        assert_eq!(Scalar::min(-0.0, 0.0).to_bits(), (-0.0f64).to_bits());
        assert_eq!([-3.0, 0.3, 7.0].map(|x: f64| x.clamp_to(-1.0, 1.0)), [-1.0, 0.3, 1.0]);
        assert_eq!([-3.0, 3.0].map(|x: f64| Scalar::abs(x)), [3.0, 3.0]);
    }

    #[test]
    fn nothing_is_less_than_what_is_not_a_number_and_that_is_not_finite() {
        for x in [-1.0, 0.0, f64::INFINITY, f64::NAN] {
            assert!(!Scalar::lt(x, f64::NAN) && !Scalar::lt(f64::NAN, x));
        }
        let finite = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX].map(Scalar::is_finite);
        assert_eq!(finite, [false, false, false, true]);
    }

    #[test]
    fn a_number_is_its_own_value_and_solution() {
        assert_eq!(f64::implicit(3.0, 7.0, 0.0), 3.0);
        assert_eq!(f64::from_real(2.5).real(), 2.5);
    }
}
