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

#[cfg(test)]
mod tests {
    use super::*;

    const STOP: EndStop<f64> = EndStop { lower: 0.0, upper: 1.0 };

    #[test]
    fn a_stop_blocks_what_points_into_it_and_nothing_else() {
        for (x, direction, blocked) in [
            (0.0, -1.0, true),
            (0.0, 1.0, false),
            (0.0, 0.0, false),
            (-0.1, -1.0, true),
            (0.5, -1.0, false),
            (0.5, 1.0, false),
            (1.0, 1.0, true),
            (1.0, -1.0, false),
            (1.1, 1.0, true),
        ] {
            assert_eq!(STOP.blocks(x, direction), blocked, "{x} {direction}");
        }
    }

    #[test]
    fn a_position_beyond_the_stroke_is_put_on_its_end_at_rest() {
        assert_eq!(STOP.limit(-1e-9, -0.3), (0.0, 0.0));
        assert_eq!(STOP.limit(1.5, 0.3), (1.0, 0.0));
        assert_eq!(STOP.limit(0.4, -0.3), (0.4, -0.3));
        // Away from the stop the lift is free.
        assert_eq!(STOP.limit(0.0, 0.3), (0.0, 0.3));
    }
}
