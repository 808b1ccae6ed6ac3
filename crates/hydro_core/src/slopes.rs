//! The derivatives that a dual number carries along P directions, and what its arithmetic does with them.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

use crate::scalar::{Scalar, Vectors};

#[cfg(target_arch = "x86_64")]
pub(crate) mod registers;

/// P derivatives of an `S`.
pub trait Slopes<S: Scalar, const P: usize>: Copy + Debug {
    /// What the processor must have for them to exist; as [`Scalar::NEEDS`].
    const NEEDS: Vectors = S::NEEDS;
    /// Those of a constant.
    fn none() -> Self;
    /// `seed` along `direction`, else none.
    fn along(direction: usize, seed: S) -> Self;
    /// That along `direction`.
    fn get(&self, direction: usize) -> S;
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn times(self, factor: S) -> Self;
    /// a·f + b·g.
    fn combined(self, f: S, other: Self, g: S) -> Self;
    /// (a − b·q)·`inverse`: those of a quotient q.
    fn quotient(self, other: Self, q: S, inverse: S) -> Self;
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self;
}

/// What one derivative of an `S` is kept in: `S` itself, or a narrower number, of which a vector holds more.
///
/// A run's derivatives are sums and products of no great depth, and die away as its states do. In single precision
/// they are good to some ten-thousandths (`tests/dual_trajectory.rs`), far better than those of half the substeps.
pub trait Slope<S: Scalar>: Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    fn narrowed(value: S) -> Self;
    fn widened(self) -> S;
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self;
}

impl<S: Scalar> Slope<S> for S {
    #[inline(always)]
    fn narrowed(value: S) -> S {
        value
    }
    #[inline(always)]
    fn widened(self) -> S {
        self
    }
    #[inline(always)]
    fn select(mask: S::Mask, yes: S, no: S) -> S {
        <S as Scalar>::select(mask, yes, no)
    }
}

impl Slope<f64> for f32 {
    #[inline(always)]
    fn narrowed(value: f64) -> f32 {
        value as f32
    }
    #[inline(always)]
    fn widened(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn select(mask: bool, yes: f32, no: f32) -> f32 {
        if mask {
            yes
        } else {
            no
        }
    }
}

impl<S: Scalar, D: Slope<S>, const P: usize> Slopes<S, P> for [D; P] {
    // Narrow derivatives stand in registers by name where there are any.
    const NEEDS: Vectors = if P > 0 && size_of::<D>() < size_of::<S>() { Vectors::Compiled } else { S::NEEDS };
    #[inline(always)]
    fn none() -> Self {
        [D::narrowed(S::zero()); P]
    }
    #[inline(always)]
    fn along(direction: usize, seed: S) -> Self {
        let mut eps = [D::narrowed(S::zero()); P];
        eps[direction] = D::narrowed(seed);
        eps
    }
    #[inline(always)]
    fn get(&self, direction: usize) -> S {
        self[direction].widened()
    }
    #[inline(always)]
    fn plus(mut self, other: Self) -> Self {
        for k in 0..P {
            self[k] = self[k] + other[k];
        }
        self
    }
    #[inline(always)]
    fn minus(mut self, other: Self) -> Self {
        for k in 0..P {
            self[k] = self[k] - other[k];
        }
        self
    }
    #[inline(always)]
    fn times(mut self, factor: S) -> Self {
        let factor = D::narrowed(factor);
        for k in 0..P {
            self[k] = self[k] * factor;
        }
        self
    }
    #[inline(always)]
    fn combined(mut self, f: S, other: Self, g: S) -> Self {
        let (f, g) = (D::narrowed(f), D::narrowed(g));
        for k in 0..P {
            self[k] = self[k] * f + other[k] * g;
        }
        self
    }
    #[inline(always)]
    fn quotient(mut self, other: Self, q: S, inverse: S) -> Self {
        let (q, inverse) = (D::narrowed(q), D::narrowed(inverse));
        for k in 0..P {
            self[k] = (self[k] - q * other[k]) * inverse;
        }
        self
    }
    #[inline(always)]
    fn select(mask: S::Mask, mut yes: Self, no: Self) -> Self {
        for k in 0..P {
            yes[k] = D::select(mask, yes[k], no[k]);
        }
        yes
    }
}
