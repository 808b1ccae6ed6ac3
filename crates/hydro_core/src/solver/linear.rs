//! LU factorisation with partial pivoting of small dense matrices, real or complex.

use num_complex::Complex64;
use std::ops::{Div, Mul, Sub};

/// A number a matrix may hold.
pub trait Entry: Copy + Mul<Output = Self> + Sub<Output = Self> + Div<Output = Self> {
    /// What the pivot search compares.
    fn magnitude(self) -> f64;
    fn one() -> Self;
}

impl Entry for f64 {
    fn magnitude(self) -> f64 {
        self.abs()
    }
    fn one() -> Self {
        1.0
    }
}

impl Entry for Complex64 {
    fn magnitude(self) -> f64 {
        self.re.abs() + self.im.abs()
    }
    fn one() -> Self {
        Complex64::new(1.0, 0.0)
    }
}

/// PA = LU of an n×n matrix, stored row by row in place, the diagonal of U inverted.
#[derive(Debug, Clone)]
pub struct Lu<T> {
    n: usize,
    a: Vec<T>,
    pivot: Vec<usize>,
}

impl<T: Entry> Lu<T> {
    /// Factors `a` (row-major, n×n). None if a pivot vanishes or is not finite.
    pub fn factor(mut a: Vec<T>, n: usize) -> Option<Self> {
        let mut pivot = vec![0; n];
        for k in 0..n {
            let mut best = k;
            for i in k + 1..n {
                if a[i * n + k].magnitude() > a[best * n + k].magnitude() {
                    best = i;
                }
            }
            let size = a[best * n + k].magnitude();
            if !(size.is_finite() && size > 0.0) {
                return None;
            }
            pivot[k] = best;
            if best != k {
                for j in 0..n {
                    a.swap(k * n + j, best * n + j);
                }
            }
            let inverse = T::one() / a[k * n + k];
            a[k * n + k] = inverse;
            let (upper, lower) = a.split_at_mut((k + 1) * n);
            let row_k = &upper[k * n..];
            for row in lower.chunks_exact_mut(n) {
                let factor = row[k] * inverse;
                row[k] = factor;
                for j in k + 1..n {
                    row[j] = row[j] - factor * row_k[j];
                }
            }
        }
        Some(Lu { n, a, pivot })
    }

    /// Overwrites `b` with the solution of A·x = b.
    pub fn solve(&self, b: &mut [T]) {
        let n = self.n;
        for k in 0..n {
            b.swap(k, self.pivot[k]);
        }
        for i in 1..n {
            let row = &self.a[i * n..i * n + i];
            let mut sum = b[i];
            for (j, &l) in row.iter().enumerate() {
                sum = sum - l * b[j];
            }
            b[i] = sum;
        }
        for i in (0..n).rev() {
            let mut sum = b[i];
            for j in i + 1..n {
                sum = sum - self.a[i * n + j] * b[j];
            }
            b[i] = sum * self.a[i * n + i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_solution_put_back_gives_the_right_hand_side(
            a in proptest::collection::vec(-1.0..1.0f64, 36),
            b in proptest::collection::vec(-1.0..1.0f64, 6),
        ) {
            let n = 6;
            let shifted: Vec<Complex64> = a.iter().enumerate()
                .map(|(k, &x)| Complex64::new(x, if k % (n + 1) == 0 { 3.0 } else { 0.0 })).collect();
            let lu = Lu::factor(shifted.clone(), n).unwrap();
            let mut x: Vec<Complex64> = b.iter().map(|&x| x.into()).collect();
            lu.solve(&mut x);
            for i in 0..n {
                let back: Complex64 = (0..n).map(|j| shifted[i * n + j] * x[j]).sum();
                prop_assert!((back - b[i]).norm() < 1e-10);
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        assert!(Lu::factor(vec![1.0, 2.0, 2.0, 4.0], 2).is_none());
    }

    #[test]
    fn rows_are_swapped_where_the_diagonal_vanishes() {
        let lu = Lu::factor(vec![0.0, 1.0, 1.0, 0.0], 2).unwrap();
        let mut b = [3.0, 5.0];
        lu.solve(&mut b);
        assert_eq!(b, [5.0, 3.0]);
    }
}
