//! Eight lanes in one AVX-512 register.
//!
//! Each operation is one instruction by name: left to itself, the compiler cuts the long straight
//! arithmetic of a substep into vectors of several widths and shuffles between them.
//!
//! Why the calls are sound: an [`Eight`] cannot be named outside the crate, and the one place that
//! works with it, [`super::with_registers`] and its kin, have asked the processor first. They are fast only where
//! they are inlined into code compiled for AVX-512, as under `vectors::widest`; a closure is not.

use std::arch::x86_64::*;
use std::mem::transmute;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::LaneScalar;
use crate::elementary::{self, Binary};
use crate::integer::{Integer, LaneInteger};
use crate::scalar::{Mask, Scalar, Vectors};

#[derive(Clone, Copy, Debug)]
pub struct Eight(pub(super) __m512d);

#[derive(Clone, Copy, Debug)]
pub struct EightMask(pub(super) __mmask8);

/// Eight integers.
#[derive(Clone, Copy, Debug)]
pub struct EightIntegers(pub(super) __m512i);

macro_rules! binary {
    ($type:ident: $($trait:ident $method:ident $instruction:ident),*) => {$(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the processor has AVX-512, as for every operation here (see the module).
                $type(unsafe { $instruction(self.0, other.0) })
            }
        }
    )*};
}
binary!(Eight: Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd);
binary!(EightIntegers: Add add _mm512_add_epi64, Sub sub _mm512_sub_epi64, Mul mul _mm512_mullo_epi64);

impl Neg for Eight {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Eight(unsafe { _mm512_xor_pd(self.0, Self::constant(-0.0).0) })
    }
}

impl Mask for EightMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        EightMask(self.0 & other.0)
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        EightMask(self.0 | other.0)
    }
    #[inline(always)]
    fn not(self) -> Self {
        EightMask(!self.0)
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
}

impl Binary for Eight {
    #[inline(always)]
    fn two_to(self) -> Self {
        // SAFETY: as above.
        unsafe {
            let shifted = _mm512_slli_epi64::<52>(_mm512_castpd_si512(self.0));
            Eight(_mm512_castsi512_pd(_mm512_add_epi64(shifted, words(elementary::ONE))))
        }
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        // SAFETY: as above.
        unsafe {
            let bits = _mm512_castpd_si512(self.0);
            let above = _mm512_add_epi64(bits, words(elementary::ONE - elementary::SQRT_HALF));
            let k = _mm512_sub_epi64(_mm512_srli_epi64::<52>(above), words(1023));
            let m = _mm512_sub_epi64(bits, _mm512_slli_epi64::<52>(k));
            let k = _mm512_add_epi64(words(elementary::ROUND.to_bits()), k);
            (Eight(_mm512_castsi512_pd(k)), Eight(_mm512_castsi512_pd(m)))
        }
    }
}

#[inline(always)]
fn words(value: u64) -> __m512i {
    // SAFETY: both are 64 bytes of plain numbers.
    unsafe { transmute([value; 8]) }
}

/// Integers of 32 bits, beyond them the nearest, of what is not a number zero.
#[inline(always)]
fn in_32_bits(rounded: Eight) -> EightIntegers {
    let bounded = rounded.clamp_to(Eight::constant(f64::from(i32::MIN)), Eight::constant(f64::from(i32::MAX)));
    // SAFETY: as above.
    unsafe {
        let number = _mm512_maskz_mov_pd(_mm512_cmp_pd_mask::<_CMP_ORD_Q>(rounded.0, rounded.0), bounded.0);
        let shifted = Eight(number) + Eight::constant(elementary::ROUND);
        EightIntegers(_mm512_sub_epi64(_mm512_castpd_si512(shifted.0), words(elementary::ROUND.to_bits())))
    }
}

impl LaneScalar<8> for Eight {
    type Integer = EightIntegers;
    #[inline(always)]
    fn from_lanes(lanes: [f64; 8]) -> Self {
        // SAFETY: both are 64 bytes of plain numbers.
        Eight(unsafe { transmute::<[f64; 8], __m512d>(lanes) })
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 8] {
        // SAFETY: as in `from_lanes`.
        unsafe { transmute::<__m512d, [f64; 8]>(self.0) }
    }
    #[inline(always)]
    fn floor(self) -> EightIntegers {
        // SAFETY: as above.
        in_32_bits(Eight(unsafe { _mm512_roundscale_pd::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0) }))
    }
    #[inline(always)]
    fn nearest(self) -> EightIntegers {
        // SAFETY: as above.
        let towards_zero = Eight(unsafe { _mm512_roundscale_pd::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(self.0) });
        let one = Eight::select(self.lt(Eight::zero()), -Eight::one(), Eight::one());
        let left = (self - towards_zero).abs();
        in_32_bits(Eight::select(left.lt(Eight::constant(0.5)), towards_zero, towards_zero + one))
    }
    #[inline(always)]
    fn of_integer(value: EightIntegers) -> Self {
        // SAFETY: as above.
        let bits = unsafe { _mm512_add_epi64(value.0, words(elementary::ROUND.to_bits())) };
        // SAFETY: as above.
        Eight(unsafe { _mm512_castsi512_pd(bits) }) - Eight::constant(elementary::ROUND)
    }
}

impl Scalar for Eight {
    type Mask = EightMask;
    const NUMBERS: usize = 8;
    const NEEDS: Vectors = Vectors::Avx512;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::from_lanes([value; 8])
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
    fn lt(self, other: Self) -> EightMask {
        // SAFETY: as above.
        EightMask(unsafe { _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: EightMask, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Eight(unsafe { _mm512_mask_blend_pd(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn is_finite(self) -> EightMask {
        // Zero times infinity is not a number.
        (Self::zero() * self).lt(Self::one())
    }
    fn largest(self) -> f64 {
        self.lanes().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as above.
        Eight(unsafe { _mm512_sqrt_pd(self.0) })
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
        Eight(unsafe { _mm512_max_pd(other.0, self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Eight(unsafe { _mm512_min_pd(other.0, self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
}

impl Neg for EightIntegers {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::constant(0) - self
    }
}

impl Integer for EightIntegers {
    type Mask = EightMask;

    #[inline(always)]
    fn constant(value: i64) -> Self {
        EightIntegers(words(value as u64))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> EightMask {
        // SAFETY: as above.
        EightMask(unsafe { _mm512_cmplt_epi64_mask(self.0, other.0) })
    }
    #[inline(always)]
    fn is_zero(self) -> EightMask {
        // SAFETY: as above.
        EightMask(unsafe { _mm512_cmpeq_epi64_mask(self.0, words(0)) })
    }
    #[inline(always)]
    fn select(mask: EightMask, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_mask_blend_epi64(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_and_si512(self.0, other.0) })
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_xor_si512(self.0, other.0) })
    }
    #[inline(always)]
    fn add_halves(self, other: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_add_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn turn_halves<const BITS: i32>(self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_rol_epi32::<BITS>(self.0) })
    }
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_mul_epi32(self.0, other.0) })
    }
    #[inline(always)]
    fn shl(self, bits: u32) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_sll_epi64(self.0, _mm_cvtsi32_si128(bits as i32)) })
    }
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_srl_epi64(self.0, _mm_cvtsi32_si128(bits as i32)) })
    }
    #[inline(always)]
    fn shl_by(self, bits: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_sllv_epi64(self.0, bits.0) })
    }
    #[inline(always)]
    fn shr_by(self, bits: Self) -> Self {
        // SAFETY: as above.
        EightIntegers(unsafe { _mm512_srlv_epi64(self.0, bits.0) })
    }
    #[inline(always)]
    fn pick(table: &[i64], place: Self) -> Self {
        let place = place.clamp_to(Self::constant(0), Self::constant(table.len() as i64 - 1));
        assert!(!table.is_empty(), "a table has entries");
        // SAFETY: as above; and every place lies within the table.
        EightIntegers(unsafe { _mm512_i64gather_epi64::<8>(place.0, table.as_ptr()) })
    }
    #[inline(always)]
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> Self, place: Self) -> Self {
        let place = place.lanes();
        let of = |lane: usize| part(&table[place[lane] as usize]).lanes()[lane];
        Self::from_lanes([of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)])
    }
}

impl LaneInteger<8> for EightIntegers {
    #[inline(always)]
    fn from_lanes(lanes: [i64; 8]) -> Self {
        // SAFETY: both are 64 bytes of plain numbers.
        EightIntegers(unsafe { transmute::<[i64; 8], __m512i>(lanes) })
    }
    #[inline(always)]
    fn lanes(self) -> [i64; 8] {
        // SAFETY: as in `from_lanes`.
        unsafe { transmute::<__m512i, [i64; 8]>(self.0) }
    }
}
