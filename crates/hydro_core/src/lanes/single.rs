//! A number in single precision: half the bits, twice as many in a register.
//!
//! What the forklift's states lose by it is far below what a substep leaves (docs/sweeps.md). Sine and cosine are
//! those of double precision, rounded. Every operation is rounded as IEEE 754 says, so that a lane of sixteen in a register
//! has the bits of this.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::LaneScalar;
use crate::scalar::Scalar;

/// The least and the largest integer that [`LaneScalar::floor`] and its kin give.
pub(super) const LEAST: f32 = -2_147_483_648.0;
/// The largest number of single precision within 32 bits.
pub(super) const MOST: f32 = 2_147_483_520.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Single(pub f32);

/// 1.5·2²³: adding it rounds a small number to an integer, which then stands in the low bits.
pub(super) const ROUND: f32 = 12_582_912.0;

/// A number of single precision whose exponent can be got at.
pub(super) trait Binary: Scalar {
    /// 2^k of a k to which [`ROUND`] has been added.
    fn two_to(self) -> Self;
    /// k and m of x = 2^k·m with √½ ≤ m < √2, of a positive normal x.
    fn split(self) -> (Self, Self);
}

/// The bits of √½ and of 1.
pub(super) const SQRT_HALF: i32 = 0x3f35_04f3;
pub(super) const ONE: i32 = 127 << 23;

/// e^x within 2 ulp for −87 ≤ x ≤ 88; the argument is clamped to that range. exp(0) is 1 exactly.
///
/// Cody & Waite reduction to |r| ≤ ln 2/2 (Cephes, `expf.c`), then the Taylor polynomial of degree 7, whose remainder there
/// is below 6e-9.
#[inline(always)]
pub(super) fn exp<S: Binary>(x: S) -> S {
    let x = x.clamp_to(S::constant(-87.0), S::constant(88.0));
    let shifted = x * S::constant(std::f64::consts::LOG2_E) + S::constant(f64::from(ROUND));
    let k = shifted - S::constant(f64::from(ROUND));
    // ln 2 in two parts, of which the first has nine bits.
    let r = (x - k * S::constant(0.693_359_375)) + k * S::constant(2.121_944_400_546_905_8e-4);
    let r2 = r * r;
    let over = |factorial: f64| S::constant(1.0 / factorial);
    let a = over(6.0) + r * over(24.0);
    let b = over(120.0) + r * over(720.0) + r2 * over(5_040.0);
    let p = S::one() + (r + r2 * (S::constant(0.5) + r * (a + r2 * b)));
    p * shifted.two_to()
}

/// Natural logarithm within 2 ulp for positive normal x; ln(1) is 0 exactly.
///
/// As in double precision ([`crate::elementary::ln`]), with the series to the 9th power, whose remainder is below 3e-9.
#[inline(always)]
pub(super) fn ln<S: Binary>(x: S) -> S {
    let (k, m) = x.split();
    let f = m - S::one();
    let s = f / (S::constant(2.0) + f);
    let z = s * s;
    let over = |odd: f64| S::constant(2.0 / odd);
    let tail = z * (over(3.0) + z * (over(5.0) + z * (over(7.0) + z * over(9.0))));
    // 2s is f − s f: so the rounding of s counts as little as s itself.
    k * S::constant(0.693_359_375) + (f - (s * (f - tail) + k * S::constant(2.121_944_400_546_905_8e-4)))
}

impl Binary for Single {
    #[inline(always)]
    fn two_to(self) -> Self {
        Single(f32::from_bits((self.0.to_bits() << 23).wrapping_add(ONE as u32)))
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        let bits = self.0.to_bits() as i32;
        let k = (bits.wrapping_add(ONE - SQRT_HALF) >> 23) - 127;
        (Single(k as f32), Single(f32::from_bits(bits.wrapping_sub(k << 23) as u32)))
    }
}

macro_rules! binary {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl $trait for Single {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Single(self.0 $op other.0)
            }
        }
    )*};
}
binary!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Single {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Single(-self.0)
    }
}

/// A function of double precision, rounded.
#[inline(always)]
fn rounded(x: Single, f: impl Fn(f64) -> f64) -> Single {
    Single(f(f64::from(x.0)) as f32)
}

impl Scalar for Single {
    type Mask = bool;
    const NUMBERS: usize = 1;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Single(value as f32)
    }
    #[inline(always)]
    fn from_real(value: Self) -> Self {
        value
    }
    #[inline(always)]
    fn real(self) -> Self {
        self
    }
    #[inline(always)]
    fn implicit(root: Self, _residual: Self, _slope: Self) -> Self {
        root
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.0 < other.0
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
        self.0.is_finite()
    }
    fn largest(self) -> f64 {
        f64::from(self.0)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Single(self.0.sqrt())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        ln(self)
    }
    fn cos(self) -> Self {
        rounded(self, libm::cos)
    }
    fn sin(self) -> Self {
        rounded(self, libm::sin)
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        crate::elementary::inverse_fourth_root(self)
    }
}

/// An integer of 32 bits, beyond them the nearest that single precision has; of what is not a number zero.
#[inline(always)]
fn in_32_bits(rounded: f32) -> i64 {
    i64::from(rounded.clamp(LEAST, MOST) as i32)
}

impl LaneScalar<1> for Single {
    type Integer = i64;
    #[inline(always)]
    fn from_lanes([value]: [f64; 1]) -> Self {
        Single(value as f32)
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 1] {
        [f64::from(self.0)]
    }
    #[inline(always)]
    fn floor(self) -> i64 {
        in_32_bits(self.0.floor())
    }
    #[inline(always)]
    fn nearest(self) -> i64 {
        in_32_bits(self.0.round())
    }
    #[inline(always)]
    fn of_integer(value: i64) -> Self {
        Single(value as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_agrees_with_double_precision_over_its_range() {
        let mut worst = 0.0f64;
        for n in 0..400_000 {
            let x = -86.0 + 0.000_43 * n as f32;
            let exact = libm::exp(f64::from(x));
            worst = worst.max((f64::from(Single(x).exp().0) - exact).abs() / (exact * f64::from(f32::EPSILON)));
        }
        assert!(worst <= 2.0, "{worst}");
        assert_eq!(Single(0.0).exp().0, 1.0);
    }

    #[test]
    fn ln_agrees_with_double_precision_over_its_range() {
        let mut worst = 0.0f64;
        for n in 0..400_000 {
            // Evenly over the logarithms of normal numbers, and once more from half to two.
            for x in [libm::expf(-87.0 + 0.000_437 * n as f32), 0.5 + 3.75e-6 * n as f32] {
                let exact = libm::log(f64::from(x));
                let apart = (f64::from(Single(x).ln().0) - exact).abs();
                worst = worst.max(apart / (exact.abs() * f64::from(f32::EPSILON)).max(1e-30));
            }
        }
        assert!(worst <= 2.0, "{worst}");
        assert_eq!(Single(1.0).ln().0, 0.0);
    }
}
