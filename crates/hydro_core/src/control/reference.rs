//! The reference: what the operator asks for, as a ramp with rounded edges, and each lift's share of it.

use super::config::Config;
use super::fixed::{clamped, rounded, truncated};

/// What the reference remembers from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ReferenceState {
    /// [speed].
    pub ramp: i32,
    /// The ramp low-passed, with guard bits.
    pub smooth: i32,
    /// The ramp low-passed ahead of each lift's shaper, with guard bits.
    pub early: [i32; 2],
}

/// Each lift's share of what the operator asks for [speed].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shares {
    /// What the operator is used to.
    pub wanted: [i32; 2],
    /// What goes through the lift's shaper: the same where its low-pass is the same.
    pub asked: [i32; 2],
}

impl ReferenceState {
    /// One tick: both lifts' references for a request [mm/s] with the forks at `height` [counts].
    pub fn tick(&mut self, config: &Config, request: i32, height: i64) -> Shares {
        let word = config.word;
        let most = i64::from(config.request_most);
        let request = clamped(i64::from(request), 0, most >> word.speed()) << word.speed();
        let change = clamped(request - i64::from(self.ramp), -i64::from(config.ramp_down), i64::from(config.ramp_up));
        self.ramp = clamped(i64::from(self.ramp) + change, 0, most) as i32;
        let ramp = i64::from(self.ramp) << word.guard();
        let passed = |pole: i32, state: i32| {
            let (pole, one) = (i64::from(pole), 1i64 << word.factor());
            let sum = pole * i64::from(state) + (one - pole) * ramp;
            clamped(truncated(sum, word.factor()), 0, most << word.guard()) as i32
        };
        self.smooth = passed(config.ramp_pole, self.smooth);
        self.early = [0, 1].map(|lift| passed(config.lifts[lift].early_pole, self.early[lift]));
        let share = |lift: usize, state: i32| {
            let reference = rounded(i64::from(state), word.guard());
            rounded(config.ratio[lift].at(height) * reference, word.factor()) as i32
        };
        Shares {
            wanted: [0, 1].map(|lift| share(lift, self.smooth)),
            asked: [0, 1].map(|lift| share(lift, self.early[lift])),
        }
    }
}
