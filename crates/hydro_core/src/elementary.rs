//! exp, ln and x^(−1/4) from operations that IEEE 754 rounds exactly, and bit shifts.
//!
//! The platform's libm differs between machines and cannot run in lanes; these do not branch, so
//! the compiler runs them on a whole vector, and they give the same bits everywhere. No fused
//! multiply-add is used: Rust does not contract, so debug and release agree.

use crate::scalar::Scalar;

/// 1.5·2⁵²: adding it rounds a small number to an integer, which then stands in the low bits.
pub const ROUND: f64 = 6_755_399_441_055_744.0;
const LN2_HI: f64 = 6.931_471_803_691_238_2e-1; // ln 2 with its low 32 bits cleared (fdlibm, e_exp.c)
const LN2_LO: f64 = 1.908_214_929_270_587_7e-10;
/// The bits of √½ and of 1.
pub const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
pub const ONE: u64 = 1023 << 52;

/// A number whose exponent can be got at.
pub trait Binary: Scalar {
    /// 2^k of a k to which [`ROUND`] has been added.
    fn two_to(self) -> Self;
    /// k, to which [`ROUND`] has been added, and m of x = 2^k·m with √½ ≤ m < √2.
    fn split(self) -> (Self, Self);
}

impl Binary for f64 {
    #[inline(always)]
    fn two_to(self) -> f64 {
        f64::from_bits((self.to_bits() << 52).wrapping_add(ONE))
    }
    #[inline(always)]
    fn split(self) -> (f64, f64) {
        let bits = self.to_bits();
        let k = (bits.wrapping_add(ONE - SQRT_HALF) >> 52).wrapping_sub(1023);
        let m = f64::from_bits(bits.wrapping_sub(k << 52));
        (f64::from_bits(ROUND.to_bits().wrapping_add(k)), m)
    }
}

/// e^x within 2 ulp for −708 ≤ x ≤ 709; the argument is clamped to that range. exp(0) is 1 exactly.
///
/// Cody & Waite reduction to |r| ≤ ln 2/2, then the Taylor polynomial of degree 13, whose
/// remainder there is below 5e-18.
#[inline(always)]
pub fn exp<S: Binary>(x: S) -> S {
    let x = x.clamp_to(S::constant(-708.0), S::constant(709.0));
    let shifted = x * S::constant(std::f64::consts::LOG2_E) + S::constant(ROUND);
    let k = shifted - S::constant(ROUND);
    let r = (x - k * S::constant(LN2_HI)) - k * S::constant(LN2_LO);
    let r2 = r * r;
    // One over the factorial.
    let over = |factorial: f64| S::constant(1.0 / factorial);
    // Pairs, so that the additions do not wait for each other.
    let a = over(6.0) + r * over(24.0) + r2 * (over(120.0) + r * over(720.0));
    let b = over(5_040.0) + r * over(40_320.0) + r2 * (over(362_880.0) + r * over(3_628_800.0));
    let c = over(39_916_800.0) + r * over(479_001_600.0) + r2 * over(6_227_020_800.0);
    let r4 = r2 * r2;
    let tail = a + r4 * (b + r4 * c);
    let p = S::one() + (r + r2 * (S::constant(0.5) + r * tail));
    p * shifted.two_to()
}

/// Natural logarithm within 2 ulp for positive normal x; ln(1) is 0 exactly.
///
/// x = 2^k·m with √½ ≤ m < √2, then 2 artanh((m − 1)/(m + 1)) as a series to the 21st power,
/// whose remainder is below 1e-17.
#[inline(always)]
pub fn ln<S: Binary>(x: S) -> S {
    let (k, m) = x.split();
    let k = k - S::constant(ROUND);
    let two = S::constant(2.0);
    let f = m - S::one();
    let s = f / (two + f);
    let z = s * s;
    let z2 = z * z;
    let over = |odd: f64| S::constant(2.0 / odd);
    let a = over(3.0) + z * over(5.0) + z2 * (over(7.0) + z * over(9.0));
    let b = over(11.0) + z * over(13.0) + z2 * (over(15.0) + z * over(17.0));
    let c = over(19.0) + z * over(21.0);
    let z4 = z2 * z2;
    let series = s * (two + z * (a + z4 * (b + z4 * c)));
    k * S::constant(LN2_HI) + (series + k * S::constant(LN2_LO))
}

/// x^(−1/4) within 1.5 ulp for positive x. Two roots and a division, which IEEE 754 rounds exactly
/// everywhere, beat Newton's iteration from a guess both in scalars and in vectors.
#[inline(always)]
pub fn inverse_fourth_root<S: Scalar>(x: S) -> S {
    S::one() / x.sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ulps(got: f64, want: f64) -> f64 {
        (got - want).abs() / (want.abs() * f64::EPSILON)
    }

    #[test]
    fn exp_and_ln_and_fourth_root_agree_with_libm_over_the_range_of_physics() {
        let mut worst = [0.0f64; 3];
        for n in 0..200_000 {
            let x = -700.0 + 0.007 * n as f64;
            worst[0] = worst[0].max(ulps(exp(x), libm::exp(x)));
            let y = libm::exp(0.0005 * (n as f64 - 100_000.0) + 1e-5);
            worst[1] = worst[1].max((ln(y) - libm::log(y)).abs() / (libm::log(y).abs() * f64::EPSILON));
            worst[2] = worst[2].max(ulps(inverse_fourth_root(y), libm::pow(y, -0.25)));
        }
        assert!(worst[0] <= 2.0 && worst[1] <= 3.0 && worst[2] <= 3.0, "{worst:?}");
    }

    #[test]
    fn quiet_arguments_are_exact() {
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(ln(1.0), 0.0);
    }
}
