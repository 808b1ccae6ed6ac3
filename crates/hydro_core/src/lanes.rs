//! N independent numbers that go through the same arithmetic: the SIMD scalar.
//!
//! Plain loops over an array; the compiler turns them into vectors. Every lane's bits are those of
//! the `f64` run, whatever its neighbours hold.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::scalar::{Mask, Scalar};

#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(pub [f64; N]);

#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct LaneMask<const N: usize>(pub [u64; N]);

#[inline(always)]
fn map<const N: usize>(a: Lanes<N>, f: impl Fn(f64) -> f64) -> Lanes<N> {
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = f(a.0[i]);
    }
    Lanes(out)
}

#[inline(always)]
fn zip<const N: usize>(a: Lanes<N>, b: Lanes<N>, f: impl Fn(f64, f64) -> f64) -> Lanes<N> {
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = f(a.0[i], b.0[i]);
    }
    Lanes(out)
}

macro_rules! binary {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl<const N: usize> $trait for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                zip(self, other, |a, b| a $op b)
            }
        }
    )*};
}
binary!(Add add +, Sub sub -, Mul mul *, Div div /);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        map(self, |a| -a)
    }
}

impl<const N: usize> Mask for LaneMask<N> {
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = self.0[i] & other.0[i];
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = self.0[i] | other.0[i];
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn not(self) -> Self {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = !self.0[i];
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn any(self) -> bool {
        let mut any = 0;
        for i in 0..N {
            any |= self.0[i];
        }
        any != 0
    }
}

impl<const N: usize> Scalar for Lanes<N> {
    type Mask = LaneMask<N>;
    type Real = Self;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Lanes([value; N])
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
    fn lt(self, other: Self) -> LaneMask<N> {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = if self.0[i] < other.0[i] { u64::MAX } else { 0 };
        }
        LaneMask(out)
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        let mut out = [0.0; N];
        for i in 0..N {
            out[i] = f64::from_bits((mask.0[i] & yes.0[i].to_bits()) | (!mask.0[i] & no.0[i].to_bits()));
        }
        Lanes(out)
    }
    #[inline(always)]
    fn is_finite(self) -> LaneMask<N> {
        let mut out = [0u64; N];
        for i in 0..N {
            out[i] = if self.0[i].is_finite() { u64::MAX } else { 0 };
        }
        LaneMask(out)
    }
    fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        map(self, f64::sqrt)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        map(self, crate::elementary::exp)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        map(self, crate::elementary::ln)
    }
    fn cos(self) -> Self {
        map(self, libm::cos)
    }
    fn sin(self) -> Self {
        map(self, libm::sin)
    }
    #[inline(always)]
    fn inverse_fourth_root(self) -> Self {
        map(self, crate::elementary::inverse_fourth_root)
    }
}
