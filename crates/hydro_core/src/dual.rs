//! Dual numbers: a value and its exact derivatives along P directions.
//!
//! Forward-mode differentiation (Wengert, 1964): a + εa′ with ε² = 0. The value goes through the
//! very operations of the plain run, so it keeps its bits. Over [`crate::lanes::Lanes`] it gives
//! the derivatives of a whole ensemble.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Scalar, Vectors};
use crate::slopes::Slopes;

/// The derivatives stand first, and begin where a cache line does: eight of them are one load of the widest
/// vectors, which would else cross into the next line each time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Dual<S, const P: usize, E = [S; P]> {
    /// Its derivatives.
    pub eps: E,
    /// The value.
    pub re: S,
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Dual<S, P, E> {
    /// A variable: derivative one along `direction`.
    pub fn variable(re: S, direction: usize) -> Self {
        Dual::seeded(re, direction, S::one())
    }

    /// A variable whose derivative along `direction` is `seed`, by which all that follow from it are larger.
    pub fn seeded(re: S, direction: usize, seed: S) -> Self {
        Dual { re, eps: E::along(direction, seed) }
    }

    /// f(a) with f′(a) = `slope`.
    #[inline(always)]
    fn chain(self, value: S, slope: S) -> Self {
        Dual { re: value, eps: self.eps.times(slope) }
    }
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Add for Dual<S, P, E> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Dual { re: self.re + other.re, eps: self.eps.plus(other.eps) }
    }
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Sub for Dual<S, P, E> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Dual { re: self.re - other.re, eps: self.eps.minus(other.eps) }
    }
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Mul for Dual<S, P, E> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // The product rule.
        Dual { re: self.re * other.re, eps: self.eps.combined(other.re, other.eps, self.re) }
    }
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Div for Dual<S, P, E> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let quotient = self.re / other.re;
        Dual { re: quotient, eps: self.eps.quotient(other.eps, quotient, S::one() / other.re) }
    }
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Neg for Dual<S, P, E> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.re, S::constant(-1.0))
    }
}

impl<S: Scalar, const P: usize, E: Slopes<S, P>> Scalar for Dual<S, P, E> {
    type Mask = S::Mask;
    type Real = S::Real;
    const NUMBERS: usize = S::NUMBERS * (1 + P);
    const NEEDS: Vectors = E::NEEDS;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Dual { re: S::constant(value), eps: E::none() }
    }
    #[inline(always)]
    fn from_real(value: S::Real) -> Self {
        Dual { re: S::from_real(value), eps: E::none() }
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
        Dual { re: S::select(mask, yes.re, no.re), eps: E::select(mask, yes.eps, no.eps) }
    }
    #[inline(always)]
    fn scaled(self, factor: f64) -> Self {
        self.chain(self.re.scaled(factor), S::constant(factor))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Lanes;
    use crate::scalar::Mask;

    type D = Dual<f64, 2>;

    fn at(x: f64, y: f64) -> (D, D) {
        (D::variable(x, 0), D::variable(y, 1))
    }

    fn assert_near(got: D, value: f64, by_x: f64, by_y: f64) {
        for (got, want) in [(got.re, value), (got.eps[0], by_x), (got.eps[1], by_y)] {
            assert!((got - want).abs() <= 4.0 * f64::EPSILON * want.abs(), "{got} is not {want}");
        }
    }

    #[test]
    fn sums_products_and_quotients_follow_the_rules_of_leibniz() {
        let (x, y) = at(3.0, -0.7);
        assert_near(x + y, 3.0 - 0.7, 1.0, 1.0);
        assert_near(x - y, 3.0 + 0.7, 1.0, -1.0);
        assert_near(-x, -3.0, -1.0, 0.0);
        assert_near(x * y, -0.7 * 3.0, -0.7, 3.0);
        assert_near(x / y, 3.0 / -0.7, 1.0 / -0.7, -3.0 / 0.49);
        assert_near(x * x * y, -0.7 * 9.0, -0.7 * 6.0, 9.0);
    }

    #[test]
    fn the_functions_of_a_scalar_know_their_slopes() {
        let (x, _) = at(2.0, 0.0);
        assert_near(x.sqrt(), 2f64.sqrt(), 0.5 / 2f64.sqrt(), 0.0);
        assert_near(x.exp(), 2f64.exp(), 2f64.exp(), 0.0);
        assert_near(x.ln(), 2f64.ln(), 0.5, 0.0);
        assert_near(x.sin(), 2f64.sin(), 2f64.cos(), 0.0);
        assert_near(x.cos(), 2f64.cos(), -2f64.sin(), 0.0);
        assert_near(x.inverse_fourth_root(), 2f64.powf(-0.25), -0.25 * 2f64.powf(-1.25), 0.0);
    }

    #[test]
    fn a_choice_takes_the_derivatives_of_the_arm_it_takes() {
        let (x, y) = at(3.0, -0.7);
        assert_eq!(x.max(y), x);
        assert_eq!(x.min(y), y);
        assert_eq!(y.abs(), -y);
        assert_eq!(x.clamp_to(D::zero(), D::one()), D::one());
        assert_eq!(D::select(y.lt(x), x, y), x);
    }

    #[test]
    fn the_solution_of_an_equation_follows_its_parameters() {
        // r² = x·y, so ∂r/∂x = y/(2r).
        let (x, y) = at(8.0, 2.0);
        let root = D::implicit(4.0, D::constant(16.0) - x * y, 8.0);
        assert_near(root, 4.0, 0.25, 1.0);
    }

    #[test]
    fn a_dual_of_duals_holds_second_derivatives() {
        type Second = Dual<Dual<f64, 1>, 1>;
        let x = Second { re: Dual { re: 1.3, eps: [1.0] }, eps: [Dual { re: 1.0, eps: [0.0] }] };
        // d²/dx² x³ = 6x, d²/dx² e^x = e^x.
        let (cube, exp) = (x * x * x, x.exp());
        assert!((cube.eps[0].eps[0] - 6.0 * 1.3).abs() < 1e-14);
        assert!((exp.eps[0].eps[0] - 1.3f64.exp()).abs() < 1e-14);
    }

    #[test]
    fn the_value_of_a_dual_is_the_plain_number_to_the_bit_and_a_constant_has_no_slope() {
        let polynomial = |x: D| (x * x - D::constant(0.1)) / (x + D::constant(3.0)).sqrt();
        let plain = |x: f64| (x * x - 0.1) / (x + 3.0).sqrt();
        for k in 0..100 {
            let x = -2.0 + 0.1 * f64::from(k);
            assert_eq!(polynomial(D::variable(x, 1)).re.to_bits(), plain(x).to_bits());
            assert_eq!(polynomial(D::constant(x)).eps, [0.0, 0.0]);
        }
    }

    #[test]
    fn over_lanes_each_lane_differentiates_for_itself() {
        let x = Dual::<Lanes<4>, 1>::variable(Lanes([1.0, -2.0, 3.0, 0.5]), 0);
        assert_eq!((x * x).eps[0].0, [2.0, -4.0, 6.0, 1.0]);
        assert_eq!(x.abs().eps[0].0, [1.0, -1.0, 1.0, 1.0]);
        assert!(x.lt(Dual::zero()).any());
    }
}
