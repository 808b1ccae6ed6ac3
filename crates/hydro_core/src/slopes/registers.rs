//! Derivatives in single precision, in vector registers by name.
//!
//! As with lanes ([`crate::lanes`]), the compiler left to itself cuts the long straight arithmetic of a substep into
//! vectors of several widths and single numbers.
//!
//! Why the calls are sound: these types cannot be named outside the crate, and the one place that works with them,
//! [`crate::run::sensitivity`], has asked the processor first. They are fast only where they are inlined into code
//! compiled for their vectors, as under [`crate::solver::vectors::widest`].

use std::arch::x86_64::*;

use super::Slopes;
use crate::scalar::Vectors;

macro_rules! registers {
    ($(#[$doc:meta])* $name:ident: $register:ty, $each:literal, $needs:ident,
        $zero:ident $fill:ident $add:ident $sub:ident $mul:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name<const R: usize>([$register; R]);

        // SAFETY, of every call below: the processor has these vectors (see the module).
        impl<const R: usize, const P: usize> Slopes<f64, P> for $name<R> {
            const NEEDS: Vectors = Vectors::$needs;
            #[inline(always)]
            fn none() -> Self {
                const { assert!(R * $each == P) };
                $name([unsafe { $zero() }; R])
            }
            #[inline(always)]
            fn along(direction: usize, seed: f64) -> Self {
                let mut all = [[0.0f32; $each]; R];
                all[direction / $each][direction % $each] = seed as f32;
                // SAFETY: both are so many plain numbers.
                $name(all.map(|each| unsafe { std::mem::transmute::<[f32; $each], $register>(each) }))
            }
            #[inline(always)]
            fn get(&self, direction: usize) -> f64 {
                // SAFETY: both are so many plain numbers.
                let each = unsafe { std::mem::transmute::<$register, [f32; $each]>(self.0[direction / $each]) };
                f64::from(each[direction % $each])
            }
            #[inline(always)]
            fn plus(mut self, other: Self) -> Self {
                for r in 0..R {
                    self.0[r] = unsafe { $add(self.0[r], other.0[r]) };
                }
                self
            }
            #[inline(always)]
            fn minus(mut self, other: Self) -> Self {
                for r in 0..R {
                    self.0[r] = unsafe { $sub(self.0[r], other.0[r]) };
                }
                self
            }
            #[inline(always)]
            fn times(mut self, factor: f64) -> Self {
                for r in 0..R {
                    self.0[r] = unsafe { $mul(self.0[r], $fill(factor as f32)) };
                }
                self
            }
            #[inline(always)]
            fn combined(mut self, f: f64, other: Self, g: f64) -> Self {
                for r in 0..R {
                    self.0[r] = unsafe {
                        let (a, b) = (self.0[r], other.0[r]);
                        $add($mul(a, $fill(f as f32)), $mul(b, $fill(g as f32)))
                    };
                }
                self
            }
            #[inline(always)]
            fn quotient(mut self, other: Self, q: f64, inverse: f64) -> Self {
                for r in 0..R {
                    self.0[r] = unsafe {
                        let (a, b) = (self.0[r], other.0[r]);
                        $mul($sub(a, $mul($fill(q as f32), b)), $fill(inverse as f32))
                    };
                }
                self
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask {
                    yes
                } else {
                    no
                }
            }
        }
    };
}

registers! {
    /// Sixteen to a register of AVX-512.
    Sixteens: __m512, 16, Avx512, _mm512_setzero_ps _mm512_set1_ps _mm512_add_ps _mm512_sub_ps _mm512_mul_ps
}
registers! {
    /// Eight to a register of AVX2.
    Eights: __m256, 8, Avx2, _mm256_setzero_ps _mm256_set1_ps _mm256_add_ps _mm256_sub_ps _mm256_mul_ps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::vectors::{has_avx2, has_avx512};
    use proptest::prelude::*;

    const P: usize = 32;

    /// Every operation on derivatives along 32 directions, and what each gives along each.
    fn operations<E: Slopes<f64, P>>(a: &[f64], b: &[f64], f: f64, g: f64) -> Vec<Vec<f64>> {
        let of = |values: &[f64]| {
            let each = values.iter().enumerate().map(|(p, &value)| E::along(p, value));
            each.fold(E::none(), |sum, one| sum.plus(one))
        };
        let (a, b) = (of(a), of(b));
        let all = [
            a.plus(b),
            a.minus(b),
            a.times(f),
            a.combined(f, b, g),
            a.quotient(b, f, g),
            E::select(true, a, b),
            E::select(false, a, b),
            E::none(),
        ];
        all.iter().map(|eps| (0..P).map(|p| eps.get(p)).collect()).collect()
    }

    proptest! {
        #[test]
        fn registers_do_what_is_done_one_by_one_to_the_bit(
            a in prop::collection::vec(-1.0..1.0f64, P), b in prop::collection::vec(-1.0..1.0f64, P),
            f in -1.0..1.0f64, g in -1.0..1.0f64,
        ) {
            let one_by_one = operations::<[f32; P]>(&a, &b, f, g);
            if has_avx512() {
                prop_assert_eq!(&operations::<Sixteens<2>>(&a, &b, f, g), &one_by_one);
            }
            if has_avx2() {
                prop_assert_eq!(&operations::<Eights<4>>(&a, &b, f, g), &one_by_one);
            }
            // In double precision the same, but for rounding.
            let double = operations::<[f64; P]>(&a, &b, f, g);
            for (single, double) in one_by_one.iter().flatten().zip(double.iter().flatten()) {
                prop_assert!((single - double).abs() < 1e-6, "{single} is not {double}");
            }
        }
    }
}
