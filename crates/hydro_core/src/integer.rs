//! What fixed point may do with an integer: one number, or one in each lane.
//!
//! As in [`crate::scalar`] there is no ordering: a comparison gives a [`Mask`], a choice is [`Integer::select`]. Numbers have
//! 64 bits; the caller keeps every result within them.

use std::fmt::Debug;
use std::ops::{Add, Mul, Neg, Sub};

use crate::scalar::Mask;

/// An integer as the controller sees it: `i64`, or one `i64` in each lane.
pub trait Integer:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    type Mask: Mask;

    /// The same in every lane.
    fn constant(value: i64) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn is_zero(self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// The bits that both have.
    fn and(self, other: Self) -> Self;
    /// The bits that one of them has.
    fn xor(self, other: Self) -> Self;
    /// The sums of the upper and of the lower 32 bits, each without what it carries.
    fn add_halves(self, other: Self) -> Self;
    /// The upper and the lower 32 bits turned left, each by itself, by 0 to 31 bits.
    fn turn_halves<const BITS: i32>(self) -> Self;
    /// The product of two numbers that 32 bits hold, cheaper than any two's.
    fn product(self, other: Self) -> Self;
    /// x·2^bits, bits below 64.
    fn shl(self, bits: u32) -> Self;
    /// x·2^−bits without its fraction, of x from zero on, bits below 64; zeros move in.
    fn shr(self, bits: u32) -> Self;
    /// As [`Integer::shl`], each lane by its own number of bits.
    fn shl_by(self, bits: Self) -> Self;
    /// As [`Integer::shr`], each lane by its own number of bits.
    fn shr_by(self, bits: Self) -> Self;
    /// In each lane the entry of the table at the lane's place.
    ///
    /// # Panics
    /// A place that the table does not have.
    #[inline(always)]
    fn lookup(table: &[Self], place: Self) -> Self {
        Self::lookup_in(table, |&entry| entry, place)
    }
    /// In each lane the entry of one table at the lane's place; beyond its ends the first or the last.
    fn pick(table: &[i64], place: Self) -> Self;
    /// As [`Integer::lookup`] among entries of which `part` is looked at.
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> Self, place: Self) -> Self;

    #[inline(always)]
    fn zero() -> Self {
        Self::constant(0)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self::select(self.lt(Self::zero()), -self, self)
    }
    /// −x where `sign` is negative, else x.
    #[inline(always)]
    fn signed_as(self, sign: Self) -> Self {
        Self::select(sign.lt(Self::zero()), -self, self)
    }
    /// The nearest value in [lower, upper].
    #[inline(always)]
    fn clamp_to(self, lower: Self, upper: Self) -> Self {
        let raised = Self::select(self.lt(lower), lower, self);
        Self::select(upper.lt(self), upper, raised)
    }
}

/// N integers, whichever type holds them.
pub trait LaneInteger<const N: usize>: Integer {
    fn from_lanes(lanes: [i64; N]) -> Self;
    fn lanes(self) -> [i64; N];
}

/// What is done with the upper 32 bits of two numbers, and with the lower ones.
#[inline(always)]
pub(crate) fn of_halves(x: i64, f: impl Fn(u32, u32) -> u32, y: i64) -> i64 {
    let (low, high) = (f(x as u32, y as u32), f((x >> 32) as u32, (y >> 32) as u32));
    (i64::from(high) << 32) | i64::from(low)
}

impl Integer for i64 {
    type Mask = bool;

    #[inline(always)]
    fn constant(value: i64) -> i64 {
        value
    }
    #[inline(always)]
    fn lt(self, other: i64) -> bool {
        self < other
    }
    #[inline(always)]
    fn is_zero(self) -> bool {
        self == 0
    }
    #[inline(always)]
    fn select(mask: bool, yes: i64, no: i64) -> i64 {
        if mask {
            yes
        } else {
            no
        }
    }
    #[inline(always)]
    fn and(self, other: i64) -> i64 {
        self & other
    }
    #[inline(always)]
    fn xor(self, other: i64) -> i64 {
        self ^ other
    }
    #[inline(always)]
    fn add_halves(self, other: i64) -> i64 {
        of_halves(self, |half, other| half.wrapping_add(other), other)
    }
    #[inline(always)]
    fn turn_halves<const BITS: i32>(self) -> i64 {
        of_halves(self, |half, _| half.rotate_left(BITS as u32), self)
    }
    #[inline(always)]
    fn product(self, other: i64) -> i64 {
        debug_assert!(i32::try_from(self).is_ok() && i32::try_from(other).is_ok(), "{self} times {other}");
        self * other
    }
    #[inline(always)]
    fn shl(self, bits: u32) -> i64 {
        self << bits
    }
    #[inline(always)]
    fn shr(self, bits: u32) -> i64 {
        (self as u64 >> bits) as i64
    }
    #[inline(always)]
    fn shl_by(self, bits: i64) -> i64 {
        self << bits
    }
    #[inline(always)]
    fn shr_by(self, bits: i64) -> i64 {
        (self as u64 >> bits) as i64
    }
    #[inline(always)]
    fn pick(table: &[i64], place: i64) -> i64 {
        table[place.clamp(0, table.len() as i64 - 1) as usize]
    }
    #[inline(always)]
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> i64, place: i64) -> i64 {
        part(&table[place as usize])
    }
}

impl LaneInteger<1> for i64 {
    #[inline(always)]
    fn from_lanes([value]: [i64; 1]) -> i64 {
        value
    }
    #[inline(always)]
    fn lanes(self) -> [i64; 1] {
        [self]
    }
}
