//! Ends of the stroke: the limited integrator of Figure A.11.

use crate::scalar::{Mask, Scalar};

/// x stays in [lower, upper]; at an end the velocity and the acceleration into the stop vanish.
#[derive(Debug, Clone, Copy)]
pub struct EndStop<S> {
    pub lower: S,
    pub upper: S,
}

impl<S: Scalar> EndStop<S> {
    /// True where `direction` (a velocity or a force) points into a stop that `x` has reached.
    #[inline(always)]
    pub fn blocks(&self, x: S, direction: S) -> S::Mask {
        let zero = S::zero();
        let down = self.lower.lt(x).not().and(direction.lt(zero));
        let up = x.lt(self.upper).not().and(zero.lt(direction));
        down.or(up)
    }

    /// `x` and `v` with `x` on its stroke and no velocity into a stop.
    #[inline(always)]
    pub fn limit(&self, x: S, v: S) -> (S, S) {
        (x.clamp_to(self.lower, self.upper), S::select(self.blocks(x, v), S::zero(), v))
    }
}
