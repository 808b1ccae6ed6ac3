//! Four lanes in one AVX2 register, for processors without AVX-512.
//!
//! Each operation is one instruction by name, as in `avx512.rs`, and the calls are sound for the same reason: a [`Four`]
//! cannot be named outside the crate, and the one place that works with it, [`super::with_registers`], has asked the
//! processor first.

use std::arch::x86_64::*;
use std::mem::transmute;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::LaneScalar;
use crate::elementary::{self, Binary};
use crate::integer::{Integer, LaneInteger};
use crate::scalar::{Mask, Scalar, Vectors};

#[derive(Clone, Copy, Debug)]
pub struct Four(__m256d);

/// All bits of a lane that is true.
#[derive(Clone, Copy, Debug)]
pub struct FourMask(__m256d);

/// Four integers.
#[derive(Clone, Copy, Debug)]
pub struct FourIntegers(__m256i);

macro_rules! binary {
    ($type:ident: $($trait:ident $method:ident $instruction:ident),*) => {$(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the processor has AVX2, as for every operation here (see the module).
                $type(unsafe { $instruction(self.0, other.0) })
            }
        }
    )*};
}
binary!(Four: Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd);
binary!(FourIntegers: Add add _mm256_add_epi64, Sub sub _mm256_sub_epi64);

impl Neg for Four {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Four(unsafe { _mm256_xor_pd(self.0, Self::constant(-0.0).0) })
    }
}

impl Neg for FourIntegers {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::constant(0) - self
    }
}

impl Mul for FourIntegers {
    type Output = Self;
    /// The low 64 bits, of which the upper halves' own product has none.
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe {
            let low = _mm256_mul_epu32(self.0, other.0);
            let mixed = _mm256_mul_epu32(_mm256_srli_epi64::<32>(self.0), other.0);
            let mixed = _mm256_add_epi64(mixed, _mm256_mul_epu32(self.0, _mm256_srli_epi64::<32>(other.0)));
            _mm256_add_epi64(low, _mm256_slli_epi64::<32>(mixed))
        })
    }
}

impl Mask for FourMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: as above.
        FourMask(unsafe { _mm256_and_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        // SAFETY: as above.
        FourMask(unsafe { _mm256_or_pd(self.0, other.0) })
    }
    #[inline(always)]
    fn not(self) -> Self {
        let all = Four::constant(f64::from_bits(u64::MAX));
        // SAFETY: as above.
        FourMask(unsafe { _mm256_xor_pd(self.0, all.0) })
    }
    #[inline(always)]
    fn any(self) -> bool {
        // SAFETY: as above.
        unsafe { _mm256_movemask_pd(self.0) != 0 }
    }
}

impl Binary for Four {
    #[inline(always)]
    fn two_to(self) -> Self {
        // SAFETY: as above.
        unsafe {
            let shifted = _mm256_slli_epi64::<52>(_mm256_castpd_si256(self.0));
            Four(_mm256_castsi256_pd(_mm256_add_epi64(shifted, words(elementary::ONE))))
        }
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        // SAFETY: as above.
        unsafe {
            let bits = _mm256_castpd_si256(self.0);
            let above = _mm256_add_epi64(bits, words(elementary::ONE - elementary::SQRT_HALF));
            let k = _mm256_sub_epi64(_mm256_srli_epi64::<52>(above), words(1023));
            let m = _mm256_sub_epi64(bits, _mm256_slli_epi64::<52>(k));
            let k = _mm256_add_epi64(words(elementary::ROUND.to_bits()), k);
            (Four(_mm256_castsi256_pd(k)), Four(_mm256_castsi256_pd(m)))
        }
    }
}

#[inline(always)]
fn words(value: u64) -> __m256i {
    // SAFETY: both are 32 bytes of plain numbers.
    unsafe { transmute([value; 4]) }
}

/// Integers of 32 bits, beyond them the nearest, of what is not a number zero.
#[inline(always)]
fn in_32_bits(rounded: Four) -> FourIntegers {
    let bounded = rounded.clamp_to(Four::constant(f64::from(i32::MIN)), Four::constant(f64::from(i32::MAX)));
    // SAFETY: as above.
    unsafe {
        let number = _mm256_and_pd(bounded.0, _mm256_cmp_pd::<_CMP_ORD_Q>(rounded.0, rounded.0));
        let shifted = Four(number) + Four::constant(elementary::ROUND);
        FourIntegers(_mm256_sub_epi64(_mm256_castpd_si256(shifted.0), words(elementary::ROUND.to_bits())))
    }
}

impl LaneScalar<4> for Four {
    type Integer = FourIntegers;
    #[inline(always)]
    fn from_lanes(lanes: [f64; 4]) -> Self {
        // SAFETY: both are 32 bytes of plain numbers.
        Four(unsafe { transmute::<[f64; 4], __m256d>(lanes) })
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 4] {
        // SAFETY: as in `from_lanes`.
        unsafe { transmute::<__m256d, [f64; 4]>(self.0) }
    }
    #[inline(always)]
    fn floor(self) -> FourIntegers {
        // SAFETY: as above.
        in_32_bits(Four(unsafe { _mm256_floor_pd(self.0) }))
    }
    #[inline(always)]
    fn nearest(self) -> FourIntegers {
        // SAFETY: as above.
        let towards_zero = Four(unsafe { _mm256_round_pd::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(self.0) });
        let one = Four::select(self.lt(Four::zero()), -Four::one(), Four::one());
        let left = (self - towards_zero).abs();
        in_32_bits(Four::select(left.lt(Four::constant(0.5)), towards_zero, towards_zero + one))
    }
    #[inline(always)]
    fn of_integer(value: FourIntegers) -> Self {
        // SAFETY: as above.
        let bits = unsafe { _mm256_add_epi64(value.0, words(elementary::ROUND.to_bits())) };
        // SAFETY: as above.
        Four(unsafe { _mm256_castsi256_pd(bits) }) - Four::constant(elementary::ROUND)
    }
}

impl Scalar for Four {
    type Mask = FourMask;
    const NUMBERS: usize = 4;
    const NEEDS: Vectors = Vectors::Avx2;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::from_lanes([value; 4])
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
    fn lt(self, other: Self) -> FourMask {
        // SAFETY: as above.
        FourMask(unsafe { _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: FourMask, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Four(unsafe { _mm256_blendv_pd(no.0, yes.0, mask.0) })
    }
    #[inline(always)]
    fn is_finite(self) -> FourMask {
        // Zero times infinity is not a number.
        (Self::zero() * self).lt(Self::one())
    }
    fn largest(self) -> f64 {
        self.lanes().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as above.
        Four(unsafe { _mm256_sqrt_pd(self.0) })
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
        Self::from_lanes(self.lanes().map(libm::cos))
    }
    fn sin(self) -> Self {
        Self::from_lanes(self.lanes().map(libm::sin))
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        elementary::inverse_fourth_root(self)
    }
    // The instruction gives its second operand where neither is the greater, as the choice does.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as above.
        Four(unsafe { _mm256_max_pd(other.0, self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Four(unsafe { _mm256_min_pd(other.0, self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
}

impl Integer for FourIntegers {
    type Mask = FourMask;

    #[inline(always)]
    fn constant(value: i64) -> Self {
        FourIntegers(words(value as u64))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> FourMask {
        // SAFETY: as above.
        FourMask(unsafe { _mm256_castsi256_pd(_mm256_cmpgt_epi64(other.0, self.0)) })
    }
    #[inline(always)]
    fn is_zero(self) -> FourMask {
        // SAFETY: as above.
        FourMask(unsafe { _mm256_castsi256_pd(_mm256_cmpeq_epi64(self.0, words(0))) })
    }
    #[inline(always)]
    fn select(mask: FourMask, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        unsafe {
            let chosen = _mm256_blendv_pd(_mm256_castsi256_pd(no.0), _mm256_castsi256_pd(yes.0), mask.0);
            FourIntegers(_mm256_castpd_si256(chosen))
        }
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_and_si256(self.0, other.0) })
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_xor_si256(self.0, other.0) })
    }
    #[inline(always)]
    fn add_halves(self, other: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_add_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn turn_halves<const BITS: i32>(self) -> Self {
        // SAFETY: as above.
        unsafe {
            let left = _mm256_sll_epi32(self.0, _mm_cvtsi32_si128(BITS));
            FourIntegers(_mm256_or_si256(left, _mm256_srl_epi32(self.0, _mm_cvtsi32_si128(32 - BITS))))
        }
    }
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_mul_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn shl(self, bits: u32) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_sll_epi64(self.0, _mm_cvtsi32_si128(bits as i32)) })
    }
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_srl_epi64(self.0, _mm_cvtsi32_si128(bits as i32)) })
    }
    #[inline(always)]
    fn shl_by(self, bits: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_sllv_epi64(self.0, bits.0) })
    }
    #[inline(always)]
    fn shr_by(self, bits: Self) -> Self {
        // SAFETY: as above.
        FourIntegers(unsafe { _mm256_srlv_epi64(self.0, bits.0) })
    }
    #[inline(always)]
    fn pick(table: &[i64], place: Self) -> Self {
        Self::from_lanes(place.lanes().map(|place| i64::pick(table, place)))
    }
    #[inline(always)]
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> Self, place: Self) -> Self {
        let place = place.lanes();
        let of = |lane: usize| part(&table[place[lane] as usize]).lanes()[lane];
        Self::from_lanes([of(0), of(1), of(2), of(3)])
    }
}

impl LaneInteger<4> for FourIntegers {
    #[inline(always)]
    fn from_lanes(lanes: [i64; 4]) -> Self {
        // SAFETY: both are 32 bytes of plain numbers.
        FourIntegers(unsafe { transmute::<[i64; 4], __m256i>(lanes) })
    }
    #[inline(always)]
    fn lanes(self) -> [i64; 4] {
        // SAFETY: as in `from_lanes`.
        unsafe { transmute::<__m256i, [i64; 4]>(self.0) }
    }
}
