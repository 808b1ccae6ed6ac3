//! Sixteen lanes of single precision in one AVX-512 register; why the calls are sound stands in [`super::avx512`].

use std::arch::x86_64::*;
use std::mem::transmute;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::avx512::{EightIntegers, EightMask};
use super::pair::Pair;
use super::single::{self, Binary, LEAST, MOST, ONE, SQRT_HALF};
use super::LaneScalar;
use crate::elementary;
use crate::integer::{Integer, LaneInteger};
use crate::scalar::{Mask, Scalar, Vectors};

#[derive(Clone, Copy, Debug)]
pub struct Sixteen(__m512);

#[derive(Clone, Copy, Debug)]
pub struct SixteenMask(__mmask16);

/// Sixteen integers, in two registers.
#[derive(Clone, Copy, Debug)]
pub struct SixteenIntegers(Pair<EightIntegers>);

macro_rules! binary {
    ($($trait:ident $method:ident $instruction:ident),*) => {$(
        impl $trait for Sixteen {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the processor has AVX-512, as for every operation here (see the module).
                Sixteen(unsafe { $instruction(self.0, other.0) })
            }
        }
    )*};
}
binary!(Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps, Div div _mm512_div_ps);

impl Neg for Sixteen {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Sixteen(unsafe { _mm512_xor_ps(self.0, Self::constant(-0.0).0) })
    }
}

impl SixteenMask {
    #[inline(always)]
    fn of(halves: Pair<EightMask>) -> Self {
        SixteenMask(u16::from(halves.0 .0) | (u16::from(halves.1 .0) << 8))
    }
    #[inline(always)]
    fn halves(self) -> Pair<EightMask> {
        Pair(EightMask(self.0 as __mmask8), EightMask((self.0 >> 8) as __mmask8))
    }
}

impl Mask for SixteenMask {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        SixteenMask(self.0 & other.0)
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        SixteenMask(self.0 | other.0)
    }
    #[inline(always)]
    fn not(self) -> Self {
        SixteenMask(!self.0)
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0 != 0
    }
}

/// As [`super::single::Single`] has it.
#[inline(always)]
fn in_32_bits(rounded: Sixteen) -> SixteenIntegers {
    let bounded = rounded.clamp_to(Sixteen::constant(f64::from(LEAST)), Sixteen::constant(f64::from(MOST)));
    // SAFETY: as above.
    unsafe {
        let number = _mm512_cmp_ps_mask::<_CMP_ORD_Q>(rounded.0, rounded.0);
        let whole = _mm512_maskz_cvttps_epi32(number, bounded.0);
        let low = _mm512_cvtepi32_epi64(_mm512_castsi512_si256(whole));
        let high = _mm512_cvtepi32_epi64(_mm512_extracti64x4_epi64::<1>(whole));
        SixteenIntegers(Pair(EightIntegers(low), EightIntegers(high)))
    }
}

impl Binary for Sixteen {
    #[inline(always)]
    fn two_to(self) -> Self {
        // SAFETY: as above.
        unsafe {
            let shifted = _mm512_slli_epi32::<23>(_mm512_castps_si512(self.0));
            Sixteen(_mm512_castsi512_ps(_mm512_add_epi32(shifted, _mm512_set1_epi32(ONE))))
        }
    }
    #[inline(always)]
    fn split(self) -> (Self, Self) {
        // SAFETY: as above.
        unsafe {
            let bits = _mm512_castps_si512(self.0);
            let raised = _mm512_add_epi32(bits, _mm512_set1_epi32(ONE - SQRT_HALF));
            let k = _mm512_sub_epi32(_mm512_srai_epi32::<23>(raised), _mm512_set1_epi32(127));
            let m = _mm512_sub_epi32(bits, _mm512_slli_epi32::<23>(k));
            (Sixteen(_mm512_cvtepi32_ps(k)), Sixteen(_mm512_castsi512_ps(m)))
        }
    }
}

impl LaneScalar<16> for Sixteen {
    type Integer = SixteenIntegers;
    #[inline(always)]
    fn from_lanes(lanes: [f64; 16]) -> Self {
        let lanes: [f32; 16] = std::array::from_fn(|k| lanes[k] as f32);
        // SAFETY: both are 64 bytes of plain numbers.
        Sixteen(unsafe { transmute::<[f32; 16], __m512>(lanes) })
    }
    #[inline(always)]
    fn lanes(self) -> [f64; 16] {
        // SAFETY: as in `from_lanes`.
        let lanes = unsafe { transmute::<__m512, [f32; 16]>(self.0) };
        std::array::from_fn(|k| f64::from(lanes[k]))
    }
    #[inline(always)]
    fn floor(self) -> SixteenIntegers {
        // SAFETY: as above.
        in_32_bits(Sixteen(unsafe { _mm512_roundscale_ps::<{ _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC }>(self.0) }))
    }
    #[inline(always)]
    fn nearest(self) -> SixteenIntegers {
        // SAFETY: as above.
        let towards_zero =
            Sixteen(unsafe { _mm512_roundscale_ps::<{ _MM_FROUND_TO_ZERO | _MM_FROUND_NO_EXC }>(self.0) });
        let one = Sixteen::select(self.lt(Sixteen::zero()), -Sixteen::one(), Sixteen::one());
        let left = (self - towards_zero).abs();
        in_32_bits(Sixteen::select(left.lt(Sixteen::constant(0.5)), towards_zero, towards_zero + one))
    }
    #[inline(always)]
    fn of_integer(value: SixteenIntegers) -> Self {
        // SAFETY: as above.
        unsafe {
            let (low, high) = (_mm512_cvtepi64_ps(value.0 .0 .0), _mm512_cvtepi64_ps(value.0 .1 .0));
            Sixteen(_mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high))
        }
    }
}

impl Scalar for Sixteen {
    type Mask = SixteenMask;
    const NUMBERS: usize = 16;
    const NEEDS: Vectors = Vectors::Avx512;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        // SAFETY: both are 64 bytes of plain numbers.
        Sixteen(unsafe { transmute::<[f32; 16], __m512>([value as f32; 16]) })
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
    fn lt(self, other: Self) -> SixteenMask {
        // SAFETY: as above.
        SixteenMask(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
    }
    #[inline(always)]
    fn select(mask: SixteenMask, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Sixteen(unsafe { _mm512_mask_blend_ps(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn is_finite(self) -> SixteenMask {
        // Zero times infinity is not a number.
        (Self::zero() * self).lt(Self::one())
    }
    fn largest(self) -> f64 {
        self.lanes().into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as above.
        Sixteen(unsafe { _mm512_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn exp(self) -> Self {
        single::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        single::ln(self)
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
        Sixteen(unsafe { _mm512_max_ps(other.0, self.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Sixteen(unsafe { _mm512_min_ps(other.0, self.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
}

/// What both registers do.
macro_rules! halves {
    ($($trait:ident $method:ident),*) => {$(
        impl $trait for SixteenIntegers {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                SixteenIntegers(self.0.$method(other.0))
            }
        }
    )*};
}
halves!(Add add, Sub sub, Mul mul);

impl Neg for SixteenIntegers {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        SixteenIntegers(-self.0)
    }
}

impl Integer for SixteenIntegers {
    type Mask = SixteenMask;

    #[inline(always)]
    fn constant(value: i64) -> Self {
        SixteenIntegers(Integer::constant(value))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> SixteenMask {
        SixteenMask::of(self.0.lt(other.0))
    }
    #[inline(always)]
    fn is_zero(self) -> SixteenMask {
        SixteenMask::of(self.0.is_zero())
    }
    #[inline(always)]
    fn select(mask: SixteenMask, yes: Self, no: Self) -> Self {
        SixteenIntegers(Integer::select(mask.halves(), yes.0, no.0))
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        SixteenIntegers(self.0.and(other.0))
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        SixteenIntegers(self.0.xor(other.0))
    }
    #[inline(always)]
    fn add_halves(self, other: Self) -> Self {
        SixteenIntegers(self.0.add_halves(other.0))
    }
    #[inline(always)]
    fn turn_halves<const BITS: i32>(self) -> Self {
        SixteenIntegers(self.0.turn_halves::<BITS>())
    }
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        SixteenIntegers(self.0.product(other.0))
    }
    #[inline(always)]
    fn shl(self, bits: u32) -> Self {
        SixteenIntegers(self.0.shl(bits))
    }
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        SixteenIntegers(self.0.shr(bits))
    }
    #[inline(always)]
    fn shl_by(self, bits: Self) -> Self {
        SixteenIntegers(self.0.shl_by(bits.0))
    }
    #[inline(always)]
    fn shr_by(self, bits: Self) -> Self {
        SixteenIntegers(self.0.shr_by(bits.0))
    }
    #[inline(always)]
    fn pick(table: &[i64], place: Self) -> Self {
        SixteenIntegers(Integer::pick(table, place.0))
    }
    #[inline(always)]
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> Self, place: Self) -> Self {
        SixteenIntegers(Integer::lookup_in(table, |of| part(of).0, place.0))
    }
}

impl LaneInteger<16> for SixteenIntegers {
    #[inline(always)]
    fn from_lanes(lanes: [i64; 16]) -> Self {
        SixteenIntegers(LaneInteger::from_lanes(lanes))
    }
    #[inline(always)]
    fn lanes(self) -> [i64; 16] {
        self.0.lanes()
    }
}
