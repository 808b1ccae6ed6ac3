//! Two groups of lanes side by side.
//!
//! A substep is a long chain of operations of which each waits for the one before. Two such chains that do
//! not know of each other fill each other's waits.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::LaneScalar;
use crate::integer::{Integer, LaneInteger};
use crate::scalar::{Mask, Scalar, Vectors};

/// Twice as many lanes as `A` has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair<A>(pub A, pub A);

macro_rules! binary {
    ($($trait:ident $method:ident),*) => {$(
        impl<A: $trait<Output = A>> $trait for Pair<A> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Pair(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    )*};
}
binary!(Add add, Sub sub, Mul mul, Div div);

impl<A: Neg<Output = A>> Neg for Pair<A> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pair(-self.0, -self.1)
    }
}

impl<M: Mask> Mask for Pair<M> {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Pair(self.0.and(other.0), self.1.and(other.1))
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        Pair(self.0.or(other.0), self.1.or(other.1))
    }
    #[inline(always)]
    fn not(self) -> Self {
        Pair(self.0.not(), self.1.not())
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.any() | self.1.any()
    }
}

impl<A: Scalar<Real = A>> Scalar for Pair<A> {
    type Mask = Pair<A::Mask>;
    const NUMBERS: usize = 2 * A::NUMBERS;
    const NEEDS: Vectors = A::NEEDS;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Pair(A::constant(value), A::constant(value))
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
    fn lt(self, other: Self) -> Self::Mask {
        Pair(self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Pair(A::select(mask.0, yes.0, no.0), A::select(mask.1, yes.1, no.1))
    }
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        Pair(self.0.is_finite(), self.1.is_finite())
    }
    fn largest(self) -> f64 {
        self.0.largest().max(self.1.largest())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Pair(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Pair(self.0.exp(), self.1.exp())
    }
    #[inline(always)]
    fn ln(self) -> Self {
        Pair(self.0.ln(), self.1.ln())
    }
    fn cos(self) -> Self {
        Pair(self.0.cos(), self.1.cos())
    }
    fn sin(self) -> Self {
        Pair(self.0.sin(), self.1.sin())
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        Pair(self.0.inverse_fourth_root(), self.1.inverse_fourth_root())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Pair(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Pair(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.abs(), self.1.abs())
    }
}

impl<A: Integer> Integer for Pair<A> {
    type Mask = Pair<A::Mask>;

    #[inline(always)]
    fn constant(value: i64) -> Self {
        Pair(A::constant(value), A::constant(value))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        Pair(self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn is_zero(self) -> Self::Mask {
        Pair(self.0.is_zero(), self.1.is_zero())
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Pair(A::select(mask.0, yes.0, no.0), A::select(mask.1, yes.1, no.1))
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Pair(self.0.and(other.0), self.1.and(other.1))
    }
    #[inline(always)]
    fn xor(self, other: Self) -> Self {
        Pair(self.0.xor(other.0), self.1.xor(other.1))
    }
    #[inline(always)]
    fn add_halves(self, other: Self) -> Self {
        Pair(self.0.add_halves(other.0), self.1.add_halves(other.1))
    }
    #[inline(always)]
    fn turn_halves<const BITS: i32>(self) -> Self {
        Pair(self.0.turn_halves::<BITS>(), self.1.turn_halves::<BITS>())
    }
    #[inline(always)]
    fn product(self, other: Self) -> Self {
        Pair(self.0.product(other.0), self.1.product(other.1))
    }
    #[inline(always)]
    fn shl(self, bits: u32) -> Self {
        Pair(self.0.shl(bits), self.1.shl(bits))
    }
    #[inline(always)]
    fn shr(self, bits: u32) -> Self {
        Pair(self.0.shr(bits), self.1.shr(bits))
    }
    #[inline(always)]
    fn shl_by(self, bits: Self) -> Self {
        Pair(self.0.shl_by(bits.0), self.1.shl_by(bits.1))
    }
    #[inline(always)]
    fn shr_by(self, bits: Self) -> Self {
        Pair(self.0.shr_by(bits.0), self.1.shr_by(bits.1))
    }
    #[inline(always)]
    fn pick(table: &[i64], place: Self) -> Self {
        Pair(A::pick(table, place.0), A::pick(table, place.1))
    }
    #[inline(always)]
    fn lookup_in<T>(table: &[T], part: impl Fn(&T) -> Self, place: Self) -> Self {
        Pair(A::lookup_in(table, |of| part(of).0, place.0), A::lookup_in(table, |of| part(of).1, place.1))
    }
}

/// As many lanes as `A` has, twice.
macro_rules! twice {
    ($half:literal, $whole:literal) => {
        impl<A: LaneInteger<$half>> LaneInteger<$whole> for Pair<A> {
            #[inline(always)]
            fn from_lanes(lanes: [i64; $whole]) -> Self {
                let half = |from: usize| A::from_lanes(std::array::from_fn(|k| lanes[from + k]));
                Pair(half(0), half($half))
            }
            #[inline(always)]
            fn lanes(self) -> [i64; $whole] {
                let (a, b) = (self.0.lanes(), self.1.lanes());
                std::array::from_fn(|k| if k < $half { a[k] } else { b[k - $half] })
            }
        }

        impl<A: LaneScalar<$half, Real = A>> LaneScalar<$whole> for Pair<A> {
            type Integer = Pair<A::Integer>;
            #[inline(always)]
            fn from_lanes(lanes: [f64; $whole]) -> Self {
                let half = |from: usize| A::from_lanes(std::array::from_fn(|k| lanes[from + k]));
                Pair(half(0), half($half))
            }
            #[inline(always)]
            fn lanes(self) -> [f64; $whole] {
                let (a, b) = (self.0.lanes(), self.1.lanes());
                std::array::from_fn(|k| if k < $half { a[k] } else { b[k - $half] })
            }
            #[inline(always)]
            fn floor(self) -> Self::Integer {
                Pair(self.0.floor(), self.1.floor())
            }
            #[inline(always)]
            fn nearest(self) -> Self::Integer {
                Pair(self.0.nearest(), self.1.nearest())
            }
            #[inline(always)]
            fn of_integer(value: Self::Integer) -> Self {
                Pair(A::of_integer(value.0), A::of_integer(value.1))
            }
        }
    };
}
twice!(4, 8);
twice!(8, 16);
twice!(16, 32);
