//! The random numbers of a member: a function of seed, index and place alone.

use crate::random::Random;

/// The sequence of a member that its parameters are drawn from.
pub fn of_parameters(index: u64) -> u64 {
    3 * index
}

/// The sequence of a member that its sensors' noise is drawn from.
pub fn of_sensors(index: u64) -> u64 {
    3 * index + 1
}

/// The sequence of a member that its encoders' zeros are drawn from.
pub fn of_zeros(index: u64) -> u64 {
    3 * index + 2
}

/// Uniform numbers in (0, 1) of the members `first`, `first` + 1, …: (count, dimensions), row-major.
///
/// Number k of a member is the same however many dimensions are asked for. None is 0 or 1, so that every quantile of
/// it is finite.
pub fn uniform(seed: u64, first: u64, count: usize, dimensions: usize) -> Vec<f64> {
    let mut numbers = Vec::with_capacity(count * dimensions);
    for index in first..first + count as u64 {
        let mut random = Random::new(seed, of_parameters(index));
        // The middles of 2^52 equal parts.
        let parts = 2f64.powi(52);
        numbers.extend((0..dimensions).map(|_| ((random.uniform() * parts).floor() + 0.5) / parts));
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_member_is_the_same_whichever_chunk_holds_it_and_however_many_numbers_are_asked_for() {
        let all = uniform(7, 0, 100, 5);
        let part = uniform(7, 40, 10, 3);
        for k in 0..10 {
            assert_eq!(part[3 * k..3 * k + 3], all[5 * (40 + k)..5 * (40 + k) + 3]);
        }
        assert_ne!(uniform(8, 40, 1, 3), part[..3]);
    }

    #[test]
    fn the_numbers_of_neighbours_are_uncorrelated_and_none_is_0_or_1() {
        let n = 20_000;
        let numbers = uniform(1, 0, n, 2);
        assert!(numbers.iter().all(|&u| u > 0.0 && u < 1.0));
        let centred = |k: usize| numbers[k] - 0.5;
        // Five standard errors of a mean of products of two numbers of variance 1/12.
        let bound = 5.0 / 12.0 / (n as f64).sqrt();
        let within: f64 = (0..n).map(|k| centred(2 * k) * centred(2 * k + 1)).sum::<f64>() / n as f64;
        let between: f64 = (1..n).map(|k| centred(2 * k) * centred(2 * k - 2)).sum::<f64>() / n as f64;
        assert!(within.abs() < bound && between.abs() < bound, "{within} {between}");
    }
}
