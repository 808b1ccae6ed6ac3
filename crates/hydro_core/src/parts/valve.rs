//! Dynamics of the proportional valve: second order with hysteresis.

use crate::scalar::{Mask, Scalar};

/// d²i/dt² = ω²(u − 2D/ω·di/dt − i − F_hs) with the hysteresis as a LuGre bristle,
/// dz/dt = di/dt − σ0·z·|di/dt|/f_hs, F_hs = σ0·z + σ1·dz/dt
/// (Fri & Fahlén 2017, (3.11)–(3.13); 2D/ω as in Figure A.4).
#[derive(Debug, Clone, Copy)]
pub struct Valve<S> {
    omega_squared: S,
    two_d_over_omega: S,
    sigma_0: S,
    sigma_1: S,
    sigma_0_over_f_hs: S,
    fastest_rate: S,
    swing_rate: S,
}

/// The valve's effective current, its rate and the hysteresis bristle.
#[derive(Debug, Clone, Copy)]
pub struct ValveState<S> {
    /// i [A].
    pub i: S,
    /// di/dt [A/s].
    pub rate: S,
    /// z.
    pub bristle: S,
}

impl<S: Scalar> Valve<S> {
    pub fn new(omega: S, damping: S, f_hs: S, sigma_0: S, sigma_1: S) -> Self {
        let swing_rate = omega * (S::one() + sigma_0).sqrt();
        Valve {
            omega_squared: omega * omega,
            two_d_over_omega: S::constant(2.0) * damping / omega,
            sigma_0,
            sigma_1,
            sigma_0_over_f_hs: sigma_0 / f_hs,
            fastest_rate: omega * (S::constant(2.0) * damping + omega * (sigma_1 + sigma_1)) + swing_rate,
            swing_rate,
        }
    }

    /// Time derivatives of the three states under the command `u` [A].
    #[inline(always)]
    pub fn rates(&self, x: ValveState<S>, u: S) -> ValveState<S> {
        let dz = x.rate - self.sigma_0_over_f_hs * x.bristle * x.rate.abs();
        let hysteresis = self.sigma_0 * x.bristle + self.sigma_1 * dz;
        ValveState {
            i: x.rate,
            rate: self.omega_squared * (u - self.two_d_over_omega * x.rate - x.i - hysteresis),
            bristle: dz,
        }
    }

    /// At rest under the command `u` [A], the bristle bent by the share `bend` of its most: 1 where the
    /// current rose last, −1 where it fell. Then i = u − bend·f_hs.
    pub fn settled(&self, u: S, bend: S) -> ValveState<S> {
        let bristle = bend / self.sigma_0_over_f_hs;
        ValveState { i: u - self.sigma_0 * bristle, rate: S::zero(), bristle }
    }

    /// No disturbance of the current decays or swings faster than this [1/s]: 2Dω + 2ω²σ1 + ω√(1 + σ0),
    /// where σ1 counts twice because a bristle that is bent against the motion doubles it. A step must
    /// stay below four times its inverse: a longer one is stable while the bristle stays as it is, but
    /// not while it yields.
    pub fn fastest_rate(&self) -> S {
        self.fastest_rate
    }

    /// The part of it that no damping makes: ω√(1 + σ0) [1/s].
    pub fn swing_rate(&self) -> S {
        self.swing_rate
    }

    /// The same valve without derivatives.
    pub(super) fn real(&self) -> Valve<S::Real> {
        Valve {
            omega_squared: self.omega_squared.real(),
            two_d_over_omega: self.two_d_over_omega.real(),
            sigma_0: self.sigma_0.real(),
            sigma_1: self.sigma_1.real(),
            sigma_0_over_f_hs: self.sigma_0_over_f_hs.real(),
            fastest_rate: self.fastest_rate.real(),
            swing_rate: self.swing_rate.real(),
        }
    }

    /// How far a bristle bends that has yielded to a motion of the sign `way`.
    #[inline(always)]
    pub(super) fn yielded(&self, way: S) -> S {
        way / self.sigma_0_over_f_hs
    }

    /// dz/di of a bristle bent by `bristle` where the current goes the way of the sign `way`.
    #[inline(always)]
    pub(super) fn bends(&self, bristle: S, way: S) -> S {
        S::one() - way * self.sigma_0_over_f_hs * bristle
    }

    /// (e^s − 1)/s to the fourth order of e^s, so that 1/(1 + s·mean) stands for e^(−s).
    #[inline(always)]
    fn mean(s: S) -> S {
        let (second, third, fourth) = (S::constant(1.0 / 2.0), S::constant(1.0 / 6.0), S::constant(1.0 / 24.0));
        (S::one() + s * second) + (s * s) * (third + s * fourth)
    }

    /// How much the bristle bends while the current moves by `travel` [A] without turning:
    /// dz/di = ±1 − σ0·z/f_hs in closed form, with 1/(1 + s + s²/2 + s³/6 + s⁴/24) for e^(−s).
    #[inline(always)]
    pub(super) fn bend(&self, bristle: S, travel: S) -> S {
        let s = self.sigma_0_over_f_hs * travel.abs();
        let mean = Self::mean(s);
        mean * (travel - bristle * s) / (S::one() + s * mean)
    }

    /// Its slope in `travel`, where that goes the way of the sign `way`.
    #[inline(always)]
    pub(super) fn bend_slope(&self, bristle: S, travel: S, way: S) -> S {
        let s = self.sigma_0_over_f_hs * travel.abs();
        let whole = S::one() + s * Self::mean(s);
        let square = s * s;
        self.bends(bristle, way) * (whole - square * square * S::constant(1.0 / 24.0)) / (whole * whole)
    }

    /// The valve over steps of `h` [s].
    #[inline(always)]
    pub fn over(&self, h: S) -> ValveStep<S> {
        let stiffness = h * self.omega_squared;
        let elastic = h * stiffness;
        ValveStep {
            valve: *self,
            h,
            inverse_h: S::one() / h,
            damping: stiffness * self.two_d_over_omega,
            bristle_damping: stiffness * self.sigma_1,
            elastic,
            bristle_elastic: elastic * self.sigma_0,
        }
    }
}

/// A valve with what depends on the length of a step worked out. All coefficients are without unit.
#[derive(Debug, Clone, Copy)]
pub struct ValveStep<S> {
    pub(super) valve: Valve<S>,
    pub(super) h: S,
    pub(super) inverse_h: S,
    /// 2Dωh.
    pub(super) damping: S,
    /// ω²σ1·h.
    pub(super) bristle_damping: S,
    /// ω²h².
    pub(super) elastic: S,
    /// ω²σ0·h².
    pub(super) bristle_elastic: S,
}

/// Travels per step [A] below which the valve counts as at rest: it turns there without notice.
const AT_REST: f64 = 1e-6;

impl<S: Scalar> ValveStep<S> {
    /// One step with the command `u` [A] held. The valve depends on the command alone, so it can
    /// run ahead of the oil.
    ///
    /// The bristle knows no time, only the way of the current, so it follows in closed form. With
    /// p = di/dt + 2Dω·i + ω²σ1·z the rest is di/dt = p − 2Dω·i − ω²σ1·z, dp/dt = ω²(u − i − σ0·z):
    /// smooth as long as the current does not turn. A linearly implicit method of order three
    /// takes it ([`Self::onward`]). A step in which the current turns is cut there.
    #[inline(always)]
    pub fn advance(&self, x: ValveState<S>, u: S) -> ValveState<S> {
        self.end(&self.begin(x, u))
    }

    /// The first half of [`Self::advance`], for those who have other work to do in between.
    #[inline(always)]
    pub fn begin(&self, from: ValveState<S>, u: S) -> Begun<S> {
        let (zero, one) = (S::zero(), S::one());
        let pull = u - from.i - self.valve.sigma_0 * from.bristle;
        let moves = S::constant(AT_REST).lt((self.h * from.rate).abs());
        let way = S::select(S::select(moves, from.rate, pull).lt(zero), -one, one);
        Begun { from, u, moves, way, first: self.first(from, u, way) }
    }

    /// Its second half.
    #[inline(always)]
    pub fn end(&self, begun: &Begun<S>) -> ValveState<S> {
        let &Begun { from, u, moves, way, .. } = begun;
        let whole = self.last(from, &begun.first);
        let turns = moves.and((way * whole.rate).lt(S::zero()));
        if !turns.any() {
            return whole;
        }
        // The rate falls to zero nearly straight before the current turns.
        let share = from.rate / S::select(turns, from.rate - whole.rate, from.rate + from.rate);
        let share = S::select(turns, share, S::constant(0.5)).clamp_to(S::constant(1e-6), S::constant(1.0 - 1e-6));
        let turned = self.valve.over(share * self.h).onward(from, u, way);
        let after = self.valve.over((S::one() - share) * self.h).onward(turned, u, -way);
        ValveState {
            i: S::select(turns, after.i, whole.i),
            rate: S::select(turns, after.rate, whole.rate),
            bristle: S::select(turns, after.bristle, whole.bristle),
        }
    }

    /// h·di/dt and h²·dp/dt in the state `x`.
    #[inline(always)]
    pub(super) fn start(&self, x: ValveState<S>, u: S) -> (S, S) {
        (self.h * x.rate, self.elastic * (u - x.i) - self.bristle_elastic * x.bristle)
    }

    /// h·di/dt, h²·dp/dt and how much the bristle has bent, where the current has moved by `travel`
    /// and h·p by `momentum` since both rates were `start`.
    #[inline(always)]
    pub(super) fn rates(&self, bristle: S, start: (S, S), travel: S, momentum: S) -> (S, S, S) {
        let bend = self.valve.bend(bristle, travel);
        let rate = start.0 + momentum - self.damping * travel - self.bristle_damping * bend;
        (rate, start.1 - self.elastic * travel - self.bristle_elastic * bend, bend)
    }

    /// One step while the current goes the way of the sign `way`, by ROS3, an L-stable Rosenbrock
    /// method of order three with two evaluations (Sandu et al. 1997, Atmospheric Environment 31).
    /// Travels of i and, times the step, of p are in ampere.
    #[inline(always)]
    fn onward(&self, x: ValveState<S>, u: S, way: S) -> ValveState<S> {
        self.last(x, &self.first(x, u, way))
    }

    /// Its matrix and first stage.
    #[inline(always)]
    fn first(&self, x: ValveState<S>, u: S, way: S) -> FirstStage<S> {
        let start = self.start(x, u);
        // The bristle bends by 1 − way·σ0·z/f_hs of the travel.
        let share = self.valve.bends(x.bristle, way);
        let diagonal = S::constant(ros3::INVERSE_GAMMA);
        let other = diagonal + (self.damping + self.bristle_damping * share);
        let stiffness = self.elastic + self.bristle_elastic * share;
        let inverse = S::one() / (diagonal * other + stiffness);
        let matrix =
            Inverse { inverse, from_rate: diagonal * inverse, back: stiffness * inverse, from_pull: other * inverse };
        FirstStage { start, matrix, found: matrix.solve(start.0, start.1) }
    }

    /// Its other stages, and where they end.
    #[inline(always)]
    fn last(&self, x: ValveState<S>, first: &FirstStage<S>) -> ValveState<S> {
        let (start, matrix, (t1, m1)) = (first.start, first.matrix, first.found);
        let (rate, pull, _) = self.rates(x.bristle, start, t1, m1);
        let c = S::constant(ros3::C_21);
        let (t2, m2) = matrix.solve(rate + c * t1, pull + c * m1);
        let (c, d) = (S::constant(ros3::C_31), S::constant(ros3::C_32));
        let (t3, m3) = matrix.solve(rate + (c * t1 + d * t2), pull + (c * m1 + d * m2));
        let (b, c) = (S::constant(ros3::B_2), S::constant(ros3::B_3));
        let travel = t1 + (b * t2 + c * t3);
        let (rate, _, bend) = self.rates(x.bristle, start, travel, m1 + (b * m2 + c * m3));
        ValveState { i: x.i + travel, rate: rate * self.inverse_h, bristle: x.bristle + bend }
    }
}

/// Coefficients of ROS3.
mod ros3 {
    pub const INVERSE_GAMMA: f64 = 1.0 / 0.435_866_521_508_458_999_42;
    pub const C_21: f64 = -1.015_617_108_387_770_209_197_560_011_554_5;
    pub const C_31: f64 = 4.075_995_645_253_769_982_480_583_535_806_7;
    pub const C_32: f64 = 9.207_679_429_833_079_124_215_684_747_400_3;
    pub const B_2: f64 = 6.169_794_704_382_824_559_255_361_568_973_0;
    pub const B_3: f64 = -0.427_722_564_321_857_332_623_837_380_651_2;
}

/// The inverse of 1/γ − h·J.
#[derive(Debug, Clone, Copy)]
struct Inverse<S> {
    inverse: S,
    from_rate: S,
    back: S,
    from_pull: S,
}

impl<S: Scalar> Inverse<S> {
    /// Travels of i and p from their right-hand sides.
    #[inline(always)]
    fn solve(&self, rate: S, pull: S) -> (S, S) {
        (self.from_rate * rate + self.inverse * pull, self.from_pull * pull - self.back * rate)
    }
}

/// Where a step starts, its matrix, and what its first stage has found.
#[derive(Debug, Clone, Copy)]
struct FirstStage<S> {
    start: (S, S),
    matrix: Inverse<S>,
    found: (S, S),
}

/// A step half done.
#[derive(Debug, Clone, Copy)]
pub struct Begun<S: Scalar> {
    from: ValveState<S>,
    u: S,
    moves: S::Mask,
    way: S,
    first: FirstStage<S>,
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: ValveState<f64> = ValveState { i: 0.0, rate: 0.0, bristle: 0.0 };
    const F_HS: f64 = 0.018723;

    /// The free lift's of Table 5.1.
    fn thesis() -> Valve<f64> {
        Valve::new(34.327, 1.0, F_HS, 0.5, 0.1)
    }

    fn run(
        valve: &Valve<f64>,
        mut x: ValveState<f64>,
        command: impl Fn(f64) -> f64,
        h: f64,
        steps: usize,
    ) -> ValveState<f64> {
        for k in 0..steps {
            x = valve.over(h).advance(x, command(k as f64 * h));
        }
        x
    }

    #[test]
    fn halved_steps_show_order_three() {
        // During the first 40 ms of a step of the command the current only rises, so nothing kinks.
        let at = |steps: usize| run(&thesis(), REST, |_| 1.0, 0.04 / steps as f64, steps).i;
        let exact = at(4096);
        let errors = [32, 64, 128, 256].map(|steps| (at(steps) - exact).abs());
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 3.0).abs() < 0.3, "{order:.2}, {errors:?}");
        }
    }

    #[test]
    fn a_current_that_turns_costs_no_accuracy() {
        // Up for 60 ms, then down: it turns some time after, within a step.
        let command = |t: f64| if t < 0.06 - 1e-9 { 1.0 } else { 0.1 };
        let at = |steps: usize| run(&thesis(), REST, command, 0.16 / steps as f64, steps);
        let exact = at(1 << 14);
        for (steps, error) in [(16, 2e-5), (32, 1e-5), (64, 3e-6)] {
            let got = at(steps);
            assert!((got.i - exact.i).abs() < error, "{steps}: {:e}", got.i - exact.i);
        }
    }

    #[test]
    fn without_hysteresis_a_critically_damped_valve_answers_as_the_textbook_says() {
        // i = 1 − (1 + ωt)e^(−ωt).
        let valve = Valve::new(34.327, 1.0, F_HS, 0.0, 0.0);
        let wt: f64 = 34.327 * 0.05;
        let i = run(&valve, REST, |_| 1.0, 1e-4, 500).i;
        assert!((i - (1.0 - (1.0 + wt) * (-wt).exp())).abs() < 1e-9, "{i}");
    }

    #[test]
    fn swept_slowly_up_and_down_the_current_lags_by_the_hysteresis() {
        // 40 s up to 1 A and 40 s down again; at 0.5 A the bristle is fully bent both times.
        let sweep = |t: f64| if t < 40.0 { t / 40.0 } else { (80.0 - t) / 40.0 };
        let up = run(&thesis(), REST, sweep, 1e-3, 20_000);
        let down = run(&thesis(), up, |t| sweep(t + 20.0), 1e-3, 40_000);
        // 2D/ω and σ1 make it lag by another some milliseconds of the sweep.
        let lag = 0.025 * (2.0 / 34.327 + 0.1);
        assert!(((0.5 - up.i) - F_HS).abs() < lag, "{}", 0.5 - up.i);
        assert!(((down.i - 0.5) - F_HS).abs() < lag, "{}", down.i - 0.5);
    }

    #[test]
    fn settled_it_rests_beside_the_command_by_the_bent_share_of_the_hysteresis() {
        for bend in [-1.0, -0.3, 0.0, 1.0] {
            let x = thesis().settled(0.8, bend);
            assert!((0.8 - x.i - bend * F_HS).abs() < 1e-15);
            let rates = thesis().rates(x, 0.8);
            assert!(rates.i == 0.0 && rates.bristle == 0.0 && rates.rate.abs() < 1e-12, "{rates:?}");
        }
    }

    #[test]
    fn the_bristle_never_bends_beyond_the_hysteresis() {
        let valve = thesis();
        let mut x = REST;
        for k in 0..20_000 {
            let command = 0.7 + 0.7 * (k as f64 * 1e-3 * 7.0).sin();
            x = valve.over(1e-3).advance(x, command);
            assert!((0.5 * x.bristle).abs() <= F_HS * (1.0 + 1e-6), "{k}: {x:?}");
        }
    }

    #[test]
    fn steps_as_long_as_four_over_the_fastest_rate_stay_stable() {
        for (omega, damping, sigma_0, sigma_1) in
            [(34.327, 1.0, 0.1, 0.1), (500.0, 0.1, 0.1, 0.0), (100.0, 5.0, 1.0, 1.0), (1000.0, 0.1, 1e3, 0.1)]
        {
            for f_hs in [1e-5, 0.01, 0.3] {
                let valve = Valve::new(omega, damping, f_hs, sigma_0, sigma_1);
                let h = 4.0 / valve.fastest_rate();
                let x = run(&valve, REST, |_| 1.0, h, 20_000 + (20.0 / (omega * h)) as usize);
                assert!((x.i - 1.0).abs() < f_hs + 0.01, "{omega} {damping} {sigma_0} {sigma_1} {f_hs}: {x:?}");
            }
        }
    }
}
