//! Runs a piece of work with the widest vectors the processor has, chosen at run time.
//!
//! The work's code must be `#[inline(always)]` down to the arithmetic, so that it is compiled anew
//! for each kind of vector. No fused multiply-add is involved: the bits are the same on all of them.

use crate::scalar::{Scalar, Vectors};

/// Work that is compiled once per kind of vector.
pub trait Work {
    /// What the arithmetic is done on.
    type Number: Scalar;
    type Output;
    fn run(self) -> Self::Output;
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
fn with_avx512<W: Work>(work: W) -> W::Output {
    work.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2<W: Work>(work: W) -> W::Output {
    work.run()
}

/// True where the processor has all that [`with_avx512`] is compiled with.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn has_avx512() -> bool {
    use std::arch::is_x86_feature_detected as has;
    has!("avx512f") && has!("avx512dq") && has!("avx512vl") && has!("avx512bw")
}

/// True where the processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn has_avx2() -> bool {
    std::arch::is_x86_feature_detected!("avx2")
}

/// Runs `work` with AVX-512 or AVX2 where the processor has it, else as compiled.
// What a kind of number decides stands in constants, or paths that are never taken are compiled too.
#[inline(always)]
pub fn widest<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if const { matches!(W::Number::NEEDS, Vectors::Avx512) } {
            // SAFETY: such a number can only have been made where the processor has AVX-512.
            return unsafe { with_avx512(work) };
        }
        if const { matches!(W::Number::NEEDS, Vectors::Avx2) } {
            // SAFETY: such a number can only have been made where the processor has AVX2.
            return unsafe { with_avx2(work) };
        }
        if const { matches!(W::Number::NEEDS, Vectors::Any) } {
            // A single number gains nothing from wider vectors, and loses by AVX-512's slower choices.
            if const { W::Number::NUMBERS > 1 } && has_avx512() {
                // SAFETY: the processor has every feature the function is compiled with.
                return unsafe { with_avx512(work) };
            }
            if has_avx2() {
                // SAFETY: as above.
                return unsafe { with_avx2(work) };
            }
        }
    }
    work.run()
}
