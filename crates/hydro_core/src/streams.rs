//! One random sequence in each lane, the words of [`Random`] to the bit, drawn side by side.
//!
//! A number of 64 bits holds a word of 32 bits of two blocks of a sequence, so that no half of a register idles.

use crate::integer::{Integer, LaneInteger};
use crate::lanes::LaneScalar;
use crate::random::Random;
use crate::solver::vectors::{widest, Work};

/// Words of 64 bits in two blocks.
const WORDS: usize = 16;
/// Places of ChaCha's counter among its words of 32 bits.
const COUNTER: [usize; 2] = [12, 13];
const LOWER: i64 = 0xffff_ffff;

/// ChaCha with 8 rounds (Bernstein 2008) in each lane.
pub struct Streams<S: LaneScalar<N>, const N: usize> {
    /// Words of 32 bits, in both halves: constants, key, counter, stream.
    start: [S::Integer; 16],
    /// Of the next two blocks.
    counter: u64,
    words: [S::Integer; WORDS],
    used: usize,
}

impl<S: LaneScalar<N>, const N: usize> Streams<S, N> {
    /// Sequences from their beginnings, whatever was drawn of them.
    pub fn of(random: [&Random; N]) -> Self {
        let starts = random.map(Random::start);
        let start = std::array::from_fn(|word| {
            S::Integer::from_lanes(starts.map(|start| (i64::from(start[word]) << 32) | i64::from(start[word])))
        });
        Streams { start, counter: 0, words: [S::Integer::zero(); WORDS], used: WORDS }
    }

    /// The next word of each lane.
    #[inline(always)]
    pub fn word(&mut self) -> S::Integer {
        if self.used == WORDS {
            widest(Draw(self));
        }
        self.used += 1;
        self.words[self.used - 1]
    }

    #[inline(always)]
    fn draw(&mut self) {
        for (half, place) in COUNTER.into_iter().enumerate() {
            let of = |block: u64| i64::from((block >> (32 * half)) as u32);
            self.start[place] = S::Integer::constant((of(self.counter + 1) << 32) | of(self.counter));
        }
        self.counter += 2;
        let mut x = self.start;
        for _ in 0..4 {
            for column in 0..4 {
                quarter(&mut x, [column, 4 + column, 8 + column, 12 + column]);
            }
            for diagonal in 0..4 {
                let at = |row: usize| 4 * row + (diagonal + row) % 4;
                quarter(&mut x, [at(0), at(1), at(2), at(3)]);
            }
        }
        let (lower, upper) = (S::Integer::constant(LOWER), S::Integer::constant(!LOWER));
        for k in 0..WORDS / 2 {
            let low = x[2 * k].add_halves(self.start[2 * k]);
            let high = x[2 * k + 1].add_halves(self.start[2 * k + 1]);
            self.words[k] = low.and(lower) + high.shl(32);
            self.words[WORDS / 2 + k] = low.shr(32) + high.and(upper);
        }
        self.used = 0;
    }
}

/// The next two blocks, with the widest vectors.
struct Draw<'s, S: LaneScalar<N>, const N: usize>(&'s mut Streams<S, N>);

impl<S: LaneScalar<N>, const N: usize> Work for Draw<'_, S, N> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.0.draw();
    }
}

/// A quarter round.
#[inline(always)]
fn quarter<I: Integer>(x: &mut [I; 16], [a, b, c, d]: [usize; 4]) {
    x[a] = x[a].add_halves(x[b]);
    x[d] = x[d].xor(x[a]).turn_halves::<16>();
    x[c] = x[c].add_halves(x[d]);
    x[b] = x[b].xor(x[c]).turn_halves::<12>();
    x[a] = x[a].add_halves(x[b]);
    x[d] = x[d].xor(x[a]).turn_halves::<8>();
    x[c] = x[c].add_halves(x[d]);
    x[b] = x[b].xor(x[c]).turn_halves::<7>();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{with_four, with_registers, with_single_registers, LaneScalar, LaneWork, Precision};

    struct Compare;

    impl<const N: usize> LaneWork<N> for Compare {
        type Output = ();
        fn run<S: LaneScalar<N>>(self) {
            let mut alone: Vec<Random> = (0..N as u64).map(|lane| Random::new(7 + lane / 3, lane << 33)).collect();
            let mut side_by_side = Streams::<S, N>::of(std::array::from_fn(|lane| &alone[lane]));
            let drawn: Vec<[i64; N]> = (0..1000).map(|_| side_by_side.word().lanes()).collect();
            for (lane, random) in alone.iter_mut().enumerate() {
                let mut words = [0; 1000];
                random.words(&mut words);
                assert!(words.iter().zip(&drawn).all(|(word, drawn)| *word == drawn[lane]), "lane {lane} of {N}");
            }
        }
    }

    #[test]
    fn a_lane_draws_the_words_of_its_own_sequence_whatever_its_width() {
        let here = |precision: Precision| precision.widths().iter().copied().filter(|width| width.is_here());
        here(Precision::Double).for_each(|width| with_registers(width, Compare));
        here(Precision::Single).for_each(|width| with_single_registers(width, Compare));
        with_four(Compare);
    }
}
