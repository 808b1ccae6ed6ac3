//! Fixed-point arithmetic: integers with a binary scale, explicit rounding and saturation, no division.
//!
//! A value of scale *q* is an integer that stands for integer·2^−q (Fri & Fahlén 2017, section 4.8.3). Signals have one
//! scale each, whatever the word, and fit 32 bits; products are exact in 64 bits. Three operations lose information, each
//! in its own way and each named where it is used:
//! [`rounded`] (to the nearest, halves away from zero: no drift), [`truncated`] (towards zero: a filter's state
//! decays to zero and cannot ring by itself, Claasen, Mecklenbräuker & Peek 1973) and [`saturated`].

use crate::integer::Integer;

/// Scale of a speed [mm/s]: the finest at which 32 bits hold the largest one, and the difference of two.
pub const SPEED_SHIFT: u32 = 18;
/// Scale of a current [mA].
pub const CURRENT_SHIFT: u32 = 18;
/// Scale of a factor: of the temperature's, of the transition's ratio, of a filter's pole.
pub const FACTOR_SHIFT: u32 = 27;
/// A speed saturates here, 4095 mm/s.
pub const MOST_SPEED: i64 = 4095 << SPEED_SHIFT;
/// A current saturates here, 2047 mA.
pub const MOST_CURRENT: i64 = 2047 << CURRENT_SHIFT;
/// The largest factor, just below 4.
pub const MOST_FACTOR: i64 = (4 << FACTOR_SHIFT) - 1;
/// The largest shift of a [`Gain`].
pub const MOST_SHIFT: u32 = 40;

/// How wide the words are in which gains and table knots are kept. Signals and states are kept in 32 bits, sums of
/// products and the integrator in 64, with either.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Word {
    Bits16,
    Bits32,
}

impl Word {
    pub const BOTH: [Word; 2] = [Word::Bits16, Word::Bits32];

    pub fn bits(self) -> u32 {
        match self {
            Word::Bits16 => 16,
            Word::Bits32 => 32,
        }
    }

    /// The largest mantissa.
    pub fn most(self) -> i64 {
        (1 << (self.bits() - 1)) - 1
    }
}

/// 2^shift.
pub(super) fn two_to(shift: u32) -> f64 {
    (1u64 << shift) as f64
}

/// x·2^−shift to the nearest integer, halves away from zero. |x| < 2^62, shift ≤ [`MOST_SHIFT`].
#[inline(always)]
pub fn rounded<I: Integer>(x: I, shift: u32) -> I {
    (x.abs() + I::constant((1i64 << shift) >> 1)).shr(shift).signed_as(x)
}

/// x·2^−shift without its fraction: towards zero.
#[inline(always)]
pub fn truncated<I: Integer>(x: I, shift: u32) -> I {
    x.abs().shr(shift).signed_as(x)
}

/// The nearest value in [lower, upper].
#[inline(always)]
pub fn clamped<I: Integer>(x: I, lower: I, upper: I) -> I {
    x.clamp_to(lower, upper)
}

/// The nearest value in [−most, most].
#[inline(always)]
pub fn saturated<I: Integer>(x: I, most: i64) -> I {
    x.clamp_to(I::constant(-most), I::constant(most))
}

/// A factor: mantissa·2^−shift.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Gain {
    pub mantissa: i32,
    pub shift: u32,
}

impl Gain {
    /// The nearest to `value` with the largest mantissa that the word holds, and a shift up to `most_shift`.
    ///
    /// None where `value` is not finite or too large for the word.
    pub fn nearest(value: f64, word: Word, most_shift: u32) -> Option<Gain> {
        (0..=most_shift.min(MOST_SHIFT)).rev().find_map(|shift| {
            let mantissa = (value * (1u64 << shift) as f64).round();
            (mantissa.abs() <= word.most() as f64).then_some(Gain { mantissa: mantissa as i32, shift })
        })
    }

    pub fn value(self) -> f64 {
        f64::from(self.mantissa) / two_to(self.shift)
    }

    /// The product, rounded.
    #[inline(always)]
    pub fn times(self, x: i64) -> i64 {
        rounded(i64::from(self.mantissa) * x, self.shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn rounding_is_to_the_nearest_and_halves_go_away_from_zero_alike_on_both_sides() {
        assert_eq!([5, 6, 7, -5, -6, -7].map(|x| rounded(x, 2)), [1, 2, 2, -1, -2, -2]);
        assert_eq!([3, -3, 7, -7].map(|x| truncated(x, 2)), [0, 0, 1, -1]);
        assert_eq!((rounded(9, 0), truncated(-9, 0)), (9, -9));
    }

    proptest! {
        #[test]
        fn rounding_agrees_with_that_of_real_numbers(x in -(1i64 << 50)..(1i64 << 50), shift in 0u32..=MOST_SHIFT) {
            let exact = x as f64 / (1u64 << shift) as f64;
            prop_assert_eq!(rounded(x, shift), exact.round() as i64);
            prop_assert_eq!(truncated(x, shift), exact.trunc() as i64);
        }

        #[test]
        fn a_gain_is_as_near_as_its_word_allows(value in -1e3..1e3f64) {
            for word in Word::BOTH {
                let gain = Gain::nearest(value, word, MOST_SHIFT).unwrap();
                let finest = 0.5 / (1u64 << gain.shift) as f64;
                prop_assert!((gain.value() - value).abs() <= finest);
                let full = i64::from(gain.mantissa).abs() > word.most() / 2;
                prop_assert!(full || gain.shift == MOST_SHIFT);
            }
        }
    }
}
