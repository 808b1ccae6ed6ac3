//! The reference: what the operator asks for, as a ramp with rounded edges, and each lift's share of it.

use super::config::LEAST_REFERENCE;
use super::fixed::{clamped, rounded, truncated, FACTOR_SHIFT, SPEED_SHIFT};
use super::numbers::Numbers;
use crate::integer::Integer;

/// What the reference remembers from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReferenceState<I = i64> {
    /// [speed].
    pub ramp: I,
    /// The ramp low-passed [speed].
    pub smooth: I,
    /// The ramp low-passed ahead of each lift's shaper [speed].
    pub early: [I; 2],
}

/// Each lift's share of what the operator asks for [speed].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shares<I> {
    /// What the operator is used to.
    pub wanted: [I; 2],
    /// What goes through the lift's shaper: the same where its low-pass is the same.
    pub asked: [I; 2],
}

impl<I: Integer> ReferenceState<I> {
    /// Before the first tick.
    pub fn at_rest() -> Self {
        ReferenceState { ramp: I::zero(), smooth: I::zero(), early: [I::zero(); 2] }
    }

    /// One tick: both lifts' references for a request [mm/s] with the forks at `height` [counts].
    #[inline(always)]
    pub fn tick(&mut self, numbers: &Numbers<I>, request: I, height: I) -> Shares<I> {
        let most = numbers.request_most;
        let request = clamped(request, I::zero(), most.shr(SPEED_SHIFT)).shl(SPEED_SHIFT);
        let change = clamped(request - self.ramp, -numbers.ramp_down, numbers.ramp_up);
        self.ramp = clamped(self.ramp + change, I::zero(), most);
        self.smooth = passed(numbers.ramp_pole, self.smooth, self.ramp, most);
        let mut shares = Shares { wanted: [I::zero(); 2], asked: [I::zero(); 2] };
        for lift in 0..2 {
            let parts = numbers.lifts[lift].parts;
            if !parts.works {
                continue;
            }
            shares.wanted[lift] = share(numbers, lift, height, self.smooth);
            shares.asked[lift] = shares.wanted[lift];
            if parts.early {
                self.early[lift] = passed(numbers.lifts[lift].early_pole, self.early[lift], self.ramp, most);
                shares.asked[lift] = share(numbers, lift, height, self.early[lift]);
            }
        }
        shares
    }
}

/// A low-pass on the ramp; `state` and `ramp` from zero to `most`.
#[inline(always)]
fn passed<I: Integer>(pole: I, state: I, ramp: I, most: I) -> I {
    let one = I::constant(1i64 << FACTOR_SHIFT);
    let sum = pole.product(state) + (one - pole).product(ramp);
    clamped(truncated(sum, FACTOR_SHIFT), I::zero(), most)
}

/// A lift's share of a low-passed ramp [speed].
#[inline(always)]
fn share<I: Integer>(numbers: &Numbers<I>, lift: usize, height: I, state: I) -> I {
    let reference = I::select(state.lt(I::constant(LEAST_REFERENCE)), I::zero(), state);
    rounded(numbers.ratio[lift].at(height).product(reference), FACTOR_SHIFT)
}
