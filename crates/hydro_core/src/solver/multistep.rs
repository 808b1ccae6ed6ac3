//! Multistep methods on a uniform grid: weights of growing order, and the past values that they weigh.

use crate::scalar::Scalar;

/// Values of the last substeps, in a ring, so that none has to move when a new one comes. Which place
/// holds the newest is the same for all values of a run, and stands with them once ([`before`]).
#[derive(Debug, Clone, Copy)]
pub struct Past<S>([S; PLACES]);

/// One more than a method asks for, so that the new value has a place while the past ones are still read.
const PLACES: usize = 4;

/// Where the value after that at `newest` goes.
#[inline(always)]
pub fn next(newest: usize) -> usize {
    (newest + PLACES - 1) % PLACES
}

impl<S: Scalar> Past<S> {
    /// As if it had always been `value`.
    pub fn always(value: S) -> Self {
        Past([value; PLACES])
    }

    /// The value of `k` substeps before the one at `newest`.
    #[inline(always)]
    pub fn before(&self, newest: usize, k: usize) -> S {
        self.0[(newest + k) % PLACES]
    }

    #[inline(always)]
    pub fn set(&mut self, place: usize, value: S) {
        self.0[place % PLACES] = value;
    }

    /// The value of `k` substeps before the one at `newest`, to be changed.
    pub fn before_mut(&mut self, newest: usize, k: usize) -> &mut S {
        &mut self.0[(newest + k) % PLACES]
    }

    /// Zero in the lanes of `mask`.
    #[inline(always)]
    pub fn forget(&mut self, mask: S::Mask) {
        self.0 = self.0.map(|value| S::select(mask, S::zero(), value));
    }

    /// The weighted sum from the newest back; in pairs, so that the additions do not wait for each other.
    #[inline(always)]
    pub fn weigh<const N: usize>(&self, newest: usize, weights: [f64; N]) -> S {
        let term = |k: usize| self.before(newest, k).scaled(weights[k]);
        match N {
            2 => term(0) + term(1),
            _ => term(0) + (term(1) + term(2)),
        }
    }

    /// Linear continuation by one substep.
    #[inline(always)]
    pub fn onward(&self, newest: usize) -> S {
        let last = self.before(newest, 0);
        last + last - self.before(newest, 1)
    }

    /// One step of `h` from `value` with the new rate, these being the past ones.
    #[inline(always)]
    pub fn correct(&self, newest: usize, value: S, h: f64, rate: S, weights: [f64; 4]) -> S {
        let [new, first, second, third] = weights;
        value + (self.weigh(newest, [first, second, third]) + rate.scaled(new)).scaled(h)
    }
}

/// Weights of a method of growing order: a row for each of the first substeps, the last for all later ones.
pub struct Weights {
    /// Adams–Bashforth, of past rates.
    pub predict: [f64; 3],
    /// Adams–Moulton, of the new rate and past ones.
    pub correct: [f64; 4],
    /// The same for p_A.
    pub pressure: [f64; 4],
    /// Adams–Bashforth for the p_A from which the iteration starts.
    pub ahead: [f64; 3],
    /// BDF for p_B, of past values and of the new rate.
    pub volume: [f64; 2],
    pub volume_rate: f64,
    /// BDF for the compensator's opening.
    pub opening: [f64; 3],
    pub opening_rate: f64,
}

pub const WEIGHTS: [Weights; 4] = [
    Weights {
        predict: [1.0, 0.0, 0.0],
        correct: [1.0 / 2.0, 1.0 / 2.0, 0.0, 0.0],
        pressure: [1.0, 0.0, 0.0, 0.0],
        ahead: [1.0, 0.0, 0.0],
        volume: [1.0, 0.0],
        volume_rate: 1.0,
        opening: [1.0, 0.0, 0.0],
        opening_rate: 1.0,
    },
    Weights {
        predict: [3.0 / 2.0, -1.0 / 2.0, 0.0],
        correct: [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0, 0.0],
        pressure: [1.0 / 2.0, 1.0 / 2.0, 0.0, 0.0],
        ahead: [3.0 / 2.0, -1.0 / 2.0, 0.0],
        volume: [4.0 / 3.0, -1.0 / 3.0],
        volume_rate: 2.0 / 3.0,
        opening: [4.0 / 3.0, -1.0 / 3.0, 0.0],
        opening_rate: 2.0 / 3.0,
    },
    Weights {
        predict: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        correct: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        pressure: [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0, 0.0],
        ahead: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        volume: [4.0 / 3.0, -1.0 / 3.0],
        volume_rate: 2.0 / 3.0,
        opening: [18.0 / 11.0, -9.0 / 11.0, 2.0 / 11.0],
        opening_rate: 6.0 / 11.0,
    },
    Weights {
        predict: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        correct: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        pressure: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        ahead: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        volume: [4.0 / 3.0, -1.0 / 3.0],
        volume_rate: 2.0 / 3.0,
        opening: [18.0 / 11.0, -9.0 / 11.0, 2.0 / 11.0],
        opening_rate: 6.0 / 11.0,
    },
];
