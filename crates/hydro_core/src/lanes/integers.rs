//! N integers that go through the same arithmetic, as plain loops.

use std::ops::{Add, Mul, Neg, Sub};

use super::LaneMask;
use crate::integer::{of_halves, Integer, LaneInteger};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(64))]
pub struct Integers<const N: usize>(pub [i64; N]);

#[inline(always)]
fn zip<const N: usize>(a: Integers<N>, b: Integers<N>, f: impl Fn(i64, i64) -> i64) -> Integers<N> {
    let mut out = [0; N];
    for i in 0..N {
        out[i] = f(a.0[i], b.0[i]);
    }
    Integers(out)
}

#[inline(always)]
fn mask<const N: usize>(a: Integers<N>, b: Integers<N>, f: impl Fn(i64, i64) -> bool) -> LaneMask<N> {
    let mut out = [0; N];
    for i in 0..N {
        out[i] = if f(a.0[i], b.0[i]) { u64::MAX } else { 0 };
    }
    LaneMask(out)
}

macro_rules! binary {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl<const N: usize> $trait for Integers<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                zip(self, other, |a, b| a $op b)
            }
        }
    )*};
}
binary!(Add add +, Sub sub -, Mul mul *);

impl<const N: usize> Neg for Integers<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        zip(self, self, |a, _| -a)
    }
}

impl<const N: usize> Integer for Integers<N> {
    type Mask = LaneMask<N>;

    #[inline(always)]
    fn constant(value: i64) -> Self {
        Integers([value; N])
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N> {
        mask(self, other, |a, b| a < b)
    }
    #[inline(always)]
    fn is_zero(self) -> LaneMask<N> {
        mask(self, self, |a, _| a == 0)
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        let mut out = [0; N];
        for i in 0..N {
            out[i] = (mask.0[i] as i64 & yes.0[i]) | (!mask.0[i] as i64 & no.0[i]);
        }
        Integers(out)
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        zip(self, other, |a, b| a & b)
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        zip(self, other, |a, b| a ^ b)
    }
    #[inline(always)]
    fn add_halves(self, other: Self) -> Self {
        zip(self, other, |a, b| of_halves(a, |a, b| a.wrapping_add(b), b))
    }
    #[inline(always)]
    fn turn_halves<const BITS: i32>(self) -> Self {
        zip(self, self, |a, b| of_halves(a, |a, _| a.rotate_left(BITS as u32), b))
    }
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        zip(self, other, |a, b| i64::from(a as i32) * i64::from(b as i32))
    }
    #[inline(always)]
    fn shl(self, bits: u32) -> Self {
        zip(self, self, |a, _| a << bits)
    }
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        zip(self, self, |a, _| (a as u64 >> bits) as i64)
    }
    #[inline(always)]
    fn shl_by(self, bits: Self) -> Self {
        zip(self, bits, |a, bits| a << bits)
    }
    #[inline(always)]
    fn shr_by(self, bits: Self) -> Self {
        zip(self, bits, |a, bits| (a as u64 >> bits) as i64)
    }
    #[inline(always)]
    fn pick(table: &[i64], place: Self) -> Self {
        zip(place, place, |place, _| i64::pick(table, place))
    }
    #[inline(always)]
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> Self, place: Self) -> Self {
        let mut out = [0; N];
        for i in 0..N {
            out[i] = part(&table[place.0[i] as usize]).0[i];
        }
        Integers(out)
    }
}

impl<const N: usize> LaneInteger<N> for Integers<N> {
    #[inline(always)]
    fn from_lanes(lanes: [i64; N]) -> Self {
        Integers(lanes)
    }
    #[inline(always)]
    fn lanes(self) -> [i64; N] {
        self.0
    }
}
