//! The valve over steps that are long beside what damps it.

use crate::parts::valve::{ValveState, ValveStep};
use crate::scalar::{Mask, Scalar};

/// γ of Alexander's method.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Share of the travel below which a Newton step is the last: what is left is of the order of its square.
const CONVERGED: f64 = 1e-6;
/// Most Newton iterations of a stage. They start at the corner of the two lines that enclose the equation;
/// two or three are the rule.
const MOST_ITERATIONS: usize = 12;

/// A step of the valve by Alexander's method, diagonally implicit, L-stable and of order two
/// (Alexander 1977, SIAM Journal on Numerical Analysis 14, 1006–1021), with the bristle inside.
///
/// With p = di/dt + 2Dω·i + ω²σ1·z the valve is di/dt = p − 2Dω·i − ω²σ1·z(i), dp/dt = ω²(u − i − σ0·z(i)),
/// where z(i) is the bristle in closed form, which rises with i. So each stage is one equation in the
/// travel t of the current, a·t + b·(z(t) − z(0)) = rest, that rises with t and bends one way only:
/// Newton's method cannot miss its root. A bristle that is bent against the motion damps twice as much as
/// one that is not bent, a bristle that has yielded not at all; here that change is part of the
/// equation, so a step may be as long as the valve's swings allow.
#[derive(Debug, Clone, Copy)]
pub struct StiffValveStep<S> {
    step: ValveStep<S>,
    /// a = 1 + γ·2Dωh + γ²ω²h².
    by_travel: S,
    /// b = γω²σ1·h + γ²ω²σ0·h².
    by_bend: S,
}

/// What a stage has found: the travels of i and, times the step, of p, and their rates times the step.
#[derive(Debug, Clone, Copy)]
struct Stage<S> {
    travel: S,
    bend: S,
    rate: S,
    pull: S,
}

impl<S: Scalar> StiffValveStep<S> {
    /// Steps as long as `step`.
    pub fn new(step: ValveStep<S>) -> Self {
        let gamma = S::constant(GAMMA);
        StiffValveStep {
            step,
            by_travel: S::one() + gamma * (step.damping + gamma * step.elastic),
            by_bend: gamma * (step.bristle_damping + gamma * step.bristle_elastic),
        }
    }

    /// One step with the command `u` [A] held. A current may turn within it.
    #[inline(always)]
    pub fn advance(&self, x: ValveState<S>, u: S) -> ValveState<S> {
        let (zero, rest) = (S::zero(), S::constant(1.0 - GAMMA));
        let start = self.step.start(x, u);
        let mut stage = Stage { travel: zero, bend: zero, rate: zero, pull: zero };
        // The first of two begins where the step does, the second where the first one's rates have led.
        for _ in 0..2 {
            stage = self.stage(x.bristle, start, rest * stage.rate, rest * stage.pull);
        }
        let rate = stage.rate * self.step.inverse_h;
        ValveState { i: x.i + stage.travel, rate, bristle: x.bristle + stage.bend }
    }

    /// The stage that starts after the travels `travel` and `momentum`, where both rates were `start` at first.
    #[inline(always)]
    fn stage(&self, bristle: S, start: (S, S), travel: S, momentum: S) -> Stage<S> {
        let gamma = S::constant(GAMMA);
        let found = self.solve(bristle, travel + gamma * (start.0 + (momentum + gamma * start.1)));
        let (rate, pull, bend) = self.step.rates(bristle, start, found, momentum);
        Stage { travel: found, bend, rate: rate + gamma * pull, pull }
    }

    /// The travel t with a·t + b·bend(t) = `rest`.
    #[inline(always)]
    fn solve(&self, bristle: S, rest: S) -> S {
        let valve = self.step.valve.real();
        let (a, b) = (self.by_travel.real(), self.by_bend.real());
        let (z, aim) = (bristle.real(), rest.real());
        let one = S::Real::one();
        let way = S::Real::select(aim.lt(S::Real::zero()), -one, one);
        // The bristle as it bends at first, and as it stands when it has yielded; the truth lies beyond both.
        let at_first = aim / (a + b * valve.bends(z, way));
        let yielded = (aim - b * (valve.yielded(way) - z)) / a;
        let mut travel = S::Real::select((way * at_first).lt(way * yielded), yielded, at_first);
        // A lane that has converged stays as it is, so that its bits do not depend on its neighbours.
        let mut moves = one.lt(one).not();
        for _ in 0..MOST_ITERATIONS {
            let slope = a + b * valve.bend_slope(z, travel, way);
            let step = (aim - a * travel - b * valve.bend(z, travel)) / slope;
            travel = S::Real::select(moves, travel + step, travel);
            moves = moves.and((S::Real::constant(CONVERGED) * travel.abs()).lt(step.abs()));
            if !moves.any() {
                break;
            }
        }
        let at = S::from_real(travel);
        let residual = self.by_travel * at + self.by_bend * self.step.valve.bend(bristle, at) - rest;
        S::implicit(travel, residual, a + b * valve.bend_slope(z, travel, way))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parts::valve::Valve;

    const REST: ValveState<f64> = ValveState { i: 0.0, rate: 0.0, bristle: 0.0 };
    const H: f64 = 0.005;

    /// Valves whose damping asks for 24 to 2505 linearly implicit steps in 5 ms: ω, D, f_hs, σ0, σ1.
    const STIFF: [(f64, f64, f64, f64, f64); 6] = [
        (300.0, 1.0, 0.018723, 0.5, 0.1),
        (300.0, 1.0, 1e-4, 0.5, 0.1),
        (300.0, 1.0, 0.3, 0.5, 0.1),
        (569.0, 1.0, 0.018723, 0.5, 0.1),
        (569.0, 0.3, 0.018723, 0.5, 0.1),
        (1000.0, 1.0, 0.018723, 0.5, 1.0),
    ];

    fn valve((omega, damping, f_hs, sigma_0, sigma_1): (f64, f64, f64, f64, f64)) -> Valve<f64> {
        Valve::new(omega, damping, f_hs, sigma_0, sigma_1)
    }

    /// Steps of the command [A] every 40 ms, up and down.
    fn command(t: f64) -> f64 {
        [0.4, 0.9, 0.85, 0.2, 0.23, 0.5, 0.0, 0.7][(t / 0.04 + 1e-9) as usize % 8]
    }

    /// The current every 5 ms for 0.32 s, by `steps` in each.
    fn currents(steps: usize, advance: impl Fn(ValveState<f64>, f64) -> ValveState<f64>) -> Vec<f64> {
        let mut x = REST;
        let mut every = |k: usize| {
            x = (0..steps).fold(x, |x, _| advance(x, command(k as f64 * H)));
            x.i
        };
        (0..64).map(&mut every).collect()
    }

    fn stiff(valve: &Valve<f64>, steps: usize) -> Vec<f64> {
        let step = StiffValveStep::new(valve.over(H / steps as f64));
        currents(steps, |x, u| step.advance(x, u))
    }

    /// By the linearly implicit method, in steps that its stability allows and shorter ones.
    fn witness(valve: &Valve<f64>) -> Vec<f64> {
        let steps = ((valve.fastest_rate() * H / 2.0).ceil() as usize).max(400);
        let step = valve.over(H / steps as f64);
        currents(steps, |x, u| step.advance(x, u))
    }

    fn root_mean_square(a: &[f64], b: &[f64]) -> f64 {
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
    }

    #[test]
    fn a_step_twice_a_swing_long_agrees_with_many_short_ones_of_the_other_method() {
        for of in STIFF {
            let valve = valve(of);
            let steps = (2.0 * valve.swing_rate() * H).ceil() as usize;
            let error = root_mean_square(&stiff(&valve, steps), &witness(&valve));
            assert!(error < 2.5e-3, "{of:?}, {steps} steps: {error:e}");
        }
    }

    #[test]
    fn halved_steps_show_order_two_while_the_current_does_not_turn() {
        // During the first 15 ms of a step of the command the current only rises.
        for of in &STIFF[..4] {
            let valve = valve(*of);
            let at = |steps: usize| {
                let step = StiffValveStep::new(valve.over(0.015 / steps as f64));
                (0..steps).fold(REST, |x, _| step.advance(x, 1.0)).i
            };
            let exact = at(1 << 15);
            let errors = [128, 256, 512].map(|steps| (at(steps) - exact).abs());
            for pair in errors.windows(2) {
                let order = (pair[0] / pair[1]).log2();
                assert!((order - 2.0).abs() < 0.3, "{of:?}: {order:.2}, {errors:?}");
            }
        }
    }

    #[test]
    fn a_single_step_of_any_length_ends_where_the_valve_would_rest() {
        for of in STIFF {
            let valve = valve(of);
            for u in [0.3, 1.5] {
                let mut x = REST;
                for _ in 0..200 {
                    x = StiffValveStep::new(valve.over(10.0)).advance(x, u);
                }
                let rest = valve.settled(u, x.bristle * of.3 / of.2);
                assert!((x.i - rest.i).abs() < 1e-9 && x.bristle * of.3 <= of.2 * 1.000_001, "{of:?}: {x:?}");
            }
        }
    }

    #[test]
    fn no_bristle_or_none_that_gives_way_is_no_trouble() {
        for (sigma_0, sigma_1) in [(0.0, 0.0), (0.0, 10.0), (1e3, 0.0), (1e3, 10.0)] {
            let valve = Valve::new(1000.0, 0.1, 1e-5, sigma_0, sigma_1);
            let i = stiff(&valve, 2);
            assert!(i.iter().all(|i| i.is_finite() && i.abs() < 2.0), "{sigma_0} {sigma_1}: {i:?}");
        }
    }
}
