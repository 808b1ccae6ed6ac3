//! Random numbers that are the same on every machine: a seed and a stream name a sequence.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};

use crate::integer::Integer;
use crate::lanes::LaneScalar;

/// A counter-based sequence (ChaCha with 8 rounds; Bernstein 2008).
pub struct Random(ChaCha8Rng);

impl Random {
    /// Different streams of one seed are independent.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        Random(generator)
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform among 0, 1, … count − 1.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    /// Nearly normal, of mean zero and variance one, and never beyond 3.47: the sum of four uniform numbers
    /// (Irwin 1927, Hall 1927), a tenth of the cost of [`Random::normal`].
    pub fn bell(&mut self) -> f64 {
        bell::<f64, 1>(self.0.next_u64() as i64)
    }

    /// The words of as many [`Random::bell`] to come.
    pub fn words(&mut self, words: &mut [i64]) {
        for word in words {
            *word = self.0.next_u64() as i64;
        }
    }

    /// What ChaCha makes its first block of: four constants, the key, the counter, and the stream.
    pub(crate) fn start(&self) -> [u32; 16] {
        let (seed, stream) = (self.0.get_seed(), self.0.get_stream());
        let mut start = [0; 16];
        start[..4].copy_from_slice(&[0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574]); // "expand 32-byte k"
        for (word, bytes) in start[4..12].iter_mut().zip(seed.chunks_exact(4)) {
            *word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        }
        (start[14], start[15]) = (stream as u32, (stream >> 32) as u32);
        start
    }

    /// Standard normal (Box & Muller 1958), through functions that round alike everywhere.
    pub fn normal(&mut self) -> f64 {
        let (u, angle) = (1.0 - self.uniform(), 2.0 * std::f64::consts::PI * self.uniform());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(angle)
    }
}

/// [`Random::bell`] of a word in each lane.
#[inline(always)]
pub fn bell<S: LaneScalar<N>, const N: usize>(word: S::Integer) -> S {
    // Two sums of two sixteen bits each side by side, then their sum.
    let pairs = word.and(S::Integer::constant(0x0000_ffff_0000_ffff))
        + word.and(S::Integer::constant(0xffff_0000_ffff_0000_u64 as i64)).shr(16);
    let sum = pairs.and(S::Integer::constant(0xffff_ffff)) + pairs.shr(32);
    // Each of the four is uniform on 0, 1, … 65535: mean 65535/2, variance (65536² − 1)/12.
    (S::of_integer(sum) - S::constant(131_070.0)) * S::constant(1.0 * (1.0 / 37_837.227_237))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Integers, Lanes};

    #[test]
    fn a_seed_gives_the_same_numbers_on_every_machine() {
        // Made once by this code; a change of generator or of seeding would show here.
        let first = |seed: u64, stream: u64| {
            let mut random = Random::new(seed, stream);
            [(); 3].map(|()| (random.uniform() * (1u64 << 52) as f64) as u64)
        };
        assert_eq!(first(2017, 3), [3667866923885729, 1251573846878938, 2443747853995828]);
        assert_eq!(first(2017, 6), [2365228621980774, 1669043991363648, 4178572571509913]);
    }

    #[test]
    fn normal_numbers_have_mean_zero_and_variance_one() {
        let mut random = Random::new(1, 0);
        let n = 100_000;
        for draw in [Random::normal, Random::bell] {
            let (mut sum, mut square) = (0.0, 0.0);
            for _ in 0..n {
                let x = draw(&mut random);
                sum += x;
                square += x * x;
            }
            // Five standard errors.
            assert!((sum / n as f64).abs() < 5.0 / (n as f64).sqrt());
            assert!((square / n as f64 - 1.0).abs() < 5.0 * (2.0 / n as f64).sqrt());
        }
    }

    #[test]
    fn a_bell_is_the_sum_of_four_uniform_numbers_in_every_lane() {
        let mut random = Random::new(3, 1);
        for _ in 0..1000 {
            let mut words = [0; 4];
            random.words(&mut words);
            let lanes = bell::<Lanes<4>, 4>(Integers(words)).0;
            for (word, lane) in words.into_iter().zip(lanes) {
                let sum: u64 = (0..4).map(|k| (word as u64 >> (16 * k)) & 0xffff).sum();
                assert_eq!(lane.to_bits(), ((sum as f64 - 131_070.0) * (1.0 / 37_837.227_237)).to_bits());
                assert_eq!(lane.to_bits(), bell::<f64, 1>(word).to_bits());
            }
        }
    }
}
