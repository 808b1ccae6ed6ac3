//! The largest and the least of a signal's last samples, in lanes.

use crate::scalar::Scalar;

/// The extremes over a window that slides by one sample: three comparisons a sample, whatever its length.
///
/// Blocks of the window's length are gone through forwards as they come and once backwards when they are full (van
/// Herk 1992; Gil & Werman 1993).
#[derive(Debug, Clone)]
pub struct Extremes<S> {
    /// Of the block before this one, the extremes from a place on; as far as this one has come, its samples.
    high: Vec<S>,
    low: Vec<S>,
    /// Extremes of this block so far.
    so_far: (S, S),
    at: usize,
    seen: usize,
}

impl<S: Scalar> Extremes<S> {
    /// Over `length` samples, one or more.
    pub fn new(length: usize) -> Self {
        let zero = vec![S::zero(); length.max(1)];
        Extremes { high: zero.clone(), low: zero, so_far: (S::zero(), S::zero()), at: 0, seen: 0 }
    }

    /// Takes a sample; gives the largest and the least of the last ones, itself included. Before the window is full
    /// they are those of the samples so far.
    #[inline(always)]
    pub fn push(&mut self, value: S) -> (S, S) {
        let length = self.high.len();
        let (high, low) =
            if self.at == 0 { (value, value) } else { (self.so_far.0.max(value), self.so_far.1.min(value)) };
        self.so_far = (high, low);
        self.high[self.at] = value;
        self.low[self.at] = value;
        self.at += 1;
        self.seen += 1;
        if self.at == length {
            for k in (1..length).rev() {
                self.high[k - 1] = self.high[k - 1].max(self.high[k]);
                self.low[k - 1] = self.low[k - 1].min(self.low[k]);
            }
            self.at = 0;
            return (high, low);
        }
        if self.seen < length {
            return (high, low);
        }
        (high.max(self.high[self.at]), low.min(self.low[self.at]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_extremes_are_those_of_the_last_samples(values in proptest::collection::vec(-5.0..5.0f64, 1..80), length in 1usize..20) {
            let mut window = Extremes::new(length);
            for (k, &value) in values.iter().enumerate() {
                let last = &values[(k + 1).saturating_sub(length)..=k];
                let expected = (
                    last.iter().copied().fold(f64::MIN, f64::max),
                    last.iter().copied().fold(f64::MAX, f64::min),
                );
                prop_assert_eq!(window.push(value), expected, "sample {}", k);
            }
        }
    }
}
