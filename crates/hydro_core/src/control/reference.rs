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
}

impl ReferenceState {
    /// One tick: both lifts' references [speed] for a request [mm/s] with the forks at `height` [counts].
    pub fn tick(&mut self, config: &Config, request: i32, height: i64) -> [i32; 2] {
        let word = config.word;
        let most = i64::from(config.request_most);
        let request = clamped(i64::from(request), 0, most >> word.speed()) << word.speed();
        let change = clamped(request - i64::from(self.ramp), -i64::from(config.ramp_down), i64::from(config.ramp_up));
        self.ramp = clamped(i64::from(self.ramp) + change, 0, most) as i32;
        let (pole, one) = (i64::from(config.ramp_pole), 1i64 << word.factor());
        let sum = pole * i64::from(self.smooth) + (one - pole) * (i64::from(self.ramp) << word.guard());
        self.smooth = clamped(truncated(sum, word.factor()), 0, most << word.guard()) as i32;
        let reference = rounded(i64::from(self.smooth), word.guard());
        [0, 1].map(|lift| rounded(config.ratio[lift].at(height) * reference, word.factor()) as i32)
    }
}
