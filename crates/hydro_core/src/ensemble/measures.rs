//! What is measured of a lowering while it runs: a few numbers of constant memory in place of a trajectory.

use super::requirement::Moment;
use super::window::Extremes;
use crate::scalar::{Mask, Scalar};

/// What [`Measures::finish`] gives, by name, unit and meaning. Steady: the speed asked for has stood for the settling
/// time. Not a number where there was nothing to measure, as of an error where a current is asked for.
pub const MEASURES: &[(&str, &str, &str)] = &[
    ("peak_speed_m_s", "m/s", "highest lowering speed of the forks"),
    ("steady_peak_speed_m_s", "m/s", "highest lowering speed of the forks in steady stretches"),
    ("peak_pressure_pa", "Pa", "highest cylinder pressure"),
    ("overshoot_m_s", "m/s", "most that the speed exceeded the speed asked for after a step to a higher one"),
    ("settling_time_s", "s", "longest time after a step until the error stays within the band"),
    ("oscillation_m_s", "m/s", "largest amplitude of the speed over a second that ends in a steady stretch"),
    ("last_oscillation_m_s", "m/s", "amplitude of the speed over the last whole second of a steady stretch"),
    ("growth", "1", "natural logarithm of that amplitude over the one a second before"),
    ("frequency_hz", "Hz", "of the oscillation in steady stretches, from crossings of its middle"),
    ("steady_error_m_s", "m/s", "mean error over the last whole second of a steady stretch"),
    ("ended_s", "s", "when the lift landed, or the run ended"),
];

/// Settling time and band of the measures, which are not those of any requirement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settling {
    /// After a step the reference has to stand so long to be steady [s].
    pub after_s: f64,
    /// An error within it counts as settled [m/s].
    pub band_m_s: f64,
}

/// A crossing counts once the signal has passed the middle by this share of the peak to peak: noise of a tenth of
/// the oscillation is not counted.
const HYSTERESIS: f64 = 0.1;

/// The measures of one lift on their way.
#[derive(Debug, Clone)]
pub struct Measures<S> {
    settling: Settling,
    /// Whether a speed is asked for, and followed.
    followed: bool,
    tick_s: f64,
    /// Ticks of a second, and of the settling time.
    second: f64,
    after: f64,
    window: Extremes<S>,
    peak_speed: S,
    steady_peak: S,
    peak_pressure: S,
    overshoot: S,
    /// By how much the speed asked for changed last.
    step: S,
    /// Ticks since the step when the error was outside the band last.
    outside: S,
    oscillation: S,
    /// Of the present second: ticks, extremes, sum of errors.
    ticks: S,
    high: S,
    low: S,
    errors: S,
    /// Whole seconds of the present stretch.
    seconds: S,
    /// Of the last two whole seconds of a stretch: peak to peak; of the last one its mean error.
    swing: S,
    swing_before: S,
    mean_error: S,
    /// The last whole second's middle in the present stretch, which side of it the speed was on last, and when it
    /// crossed it upwards last; whole periods so far, and the ticks that they took.
    middle: S,
    side: S,
    crossed: S,
    periods: S,
    period_ticks: S,
    steady_ticks: S,
    ended: S,
}

impl<S: Scalar> Measures<S> {
    pub fn new(settling: Settling, tick_s: f64, followed: bool) -> Self {
        let second = (1.0 / tick_s).round();
        let (zero, none) = (S::zero(), S::constant(f64::NAN));
        let low = S::constant(f64::NEG_INFINITY);
        Measures {
            settling,
            followed,
            tick_s,
            second,
            after: (settling.after_s / tick_s).round(),
            window: Extremes::new(second as usize + 1),
            peak_speed: low,
            steady_peak: low,
            peak_pressure: low,
            overshoot: low,
            step: zero,
            outside: zero,
            oscillation: low,
            ticks: zero,
            high: low,
            low: S::constant(f64::INFINITY),
            errors: zero,
            seconds: zero,
            swing: none,
            swing_before: none,
            mean_error: none,
            middle: none,
            side: zero,
            crossed: none,
            periods: zero,
            period_ticks: zero,
            steady_ticks: zero,
            ended: zero,
        }
    }

    /// Tick `k` of the lanes that are `counted`.
    #[inline(always)]
    pub fn see(&mut self, k: usize, now: &Moment<S>, counted: S::Mask) {
        let number = S::constant;
        let keep = |mask: S::Mask, new: S, old: S| S::select(mask, new, old);
        let (high, low) = self.window.push(now.speed);
        self.ended = keep(counted, number(k as f64 * self.tick_s), self.ended);
        self.peak_speed = keep(counted, self.peak_speed.max(now.speed), self.peak_speed);
        self.peak_pressure = keep(counted, self.peak_pressure.max(now.pressure), self.peak_pressure);
        let over = now.speed - now.request;
        self.step = keep(S::zero().lt(now.step.abs()), now.step, self.step);
        let rose = counted.and(S::zero().lt(now.request)).and(S::zero().lt(self.step));
        self.overshoot = keep(rose, self.overshoot.max(over), self.overshoot);
        let strays = number(self.settling.band_m_s).lt(now.error.abs()).and(counted);
        self.outside = keep(strays, self.outside.max(now.since + S::one()), self.outside);

        let steady = now.since.lt(number(self.after)).not().and(counted);
        self.steady_peak = keep(steady, self.steady_peak.max(now.speed), self.steady_peak);
        // The window must not look back over the step.
        let whole = steady.and(now.since.lt(number(self.second)).not());
        self.oscillation = keep(whole, self.oscillation.max(number(0.5) * (high - low)), self.oscillation);

        // Whole seconds since the stretch became steady. What an earlier stretch came to stays until this one has one.
        let begins = steady.and(now.since.lt(number(self.after + 1.0)));
        let none = number(f64::NAN);
        self.seconds = keep(begins, S::zero(), self.seconds);
        (self.middle, self.crossed) = (keep(begins, none, self.middle), keep(begins, none, self.crossed));
        self.side = keep(begins, S::zero(), self.side);
        self.ticks = keep(steady, keep(begins, S::zero(), self.ticks) + S::one(), self.ticks);
        self.high = keep(steady, keep(begins, now.speed, self.high.max(now.speed)), self.high);
        self.low = keep(steady, keep(begins, now.speed, self.low.min(now.speed)), self.low);
        self.errors = keep(steady, keep(begins, S::zero(), self.errors) + now.error, self.errors);
        // Crossings of the last second's middle.
        let reach = number(HYSTERESIS) * self.swing;
        let above = (self.middle + reach).lt(now.speed).and(steady);
        let below = now.speed.lt(self.middle - reach).and(steady);
        let crosses = above.and(self.side.lt(S::zero()));
        self.steady_ticks = keep(steady, self.steady_ticks + S::one(), self.steady_ticks);
        let again = crosses.and(self.crossed.is_finite());
        self.periods = keep(again, self.periods + S::one(), self.periods);
        let since = self.steady_ticks - self.crossed;
        self.period_ticks = keep(again, self.period_ticks + since, self.period_ticks);
        self.crossed = keep(crosses, self.steady_ticks, self.crossed);
        self.side = keep(above, S::one(), keep(below, -S::one(), self.side));

        let full = steady.and(self.ticks.lt(number(self.second)).not());
        if full.any() {
            let before = keep(S::zero().lt(self.seconds), self.swing, none);
            self.swing_before = keep(full, before, self.swing_before);
            self.seconds = keep(full, self.seconds + S::one(), self.seconds);
            self.swing = keep(full, self.high - self.low, self.swing);
            self.middle = keep(full, number(0.5) * (self.high + self.low), self.middle);
            self.mean_error = keep(full, self.errors / self.ticks, self.mean_error);
            self.ticks = keep(full, S::zero(), self.ticks);
            self.errors = keep(full, S::zero(), self.errors);
            self.high = keep(full, number(f64::NEG_INFINITY), self.high);
            self.low = keep(full, number(f64::INFINITY), self.low);
        }
    }

    /// In the order of [`MEASURES`].
    pub fn finish(&self) -> [S; MEASURES.len()] {
        let none = S::constant(f64::NAN);
        let found = |x: S| S::select(x.is_finite(), x, none);
        let follows = |x: S| if self.followed { x } else { none };
        let half = S::constant(0.5);
        // Two swings that are not positive have no ratio.
        let both = S::zero().lt(self.swing).and(S::zero().lt(self.swing_before));
        let ratio = S::select(both, self.swing / self.swing_before, S::one());
        let rings = S::zero().lt(self.periods);
        let ticks = S::select(rings, self.period_ticks, S::one());
        [
            found(self.peak_speed),
            found(self.steady_peak),
            found(self.peak_pressure),
            follows(found(self.overshoot)),
            follows(S::constant(self.tick_s) * self.outside),
            found(self.oscillation),
            half * self.swing,
            S::select(both, ratio.ln(), none),
            S::select(rings, self.periods / (S::constant(self.tick_s) * ticks), none),
            follows(self.mean_error),
            self.ended,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 0.02;

    fn measured(speed: impl Fn(f64) -> f64) -> Vec<f64> {
        stepped(2.0, &[(0.0, 0.5)], 10.0, speed)
    }

    /// Of what is asked for from several times on; steady after `after_s`.
    fn stepped(after_s: f64, profile: &[(f64, f64)], end_s: f64, speed: impl Fn(f64) -> f64) -> Vec<f64> {
        let settling = Settling { after_s, band_m_s: 0.05 };
        let mut measures = Measures::<f64>::new(settling, TICK, true);
        let (mut request, mut since) = (0.0, 0.0);
        for k in 0..(end_s / TICK).round() as usize {
            let time = k as f64 * TICK;
            let asked = profile.iter().rfind(|(from, _)| *from <= time + 1e-9).map_or(0.0, |(_, level)| *level);
            let step = asked - request;
            since = if k == 0 || step != 0.0 { 0.0 } else { since + 1.0 };
            request = asked;
            let speed = speed(time);
            let (error, pressure) = (speed - request, 1e6 + speed);
            let moment = Moment { speed, error, pressure, position: 0.0, current: 0.0, request, step, since };
            measures.see(k, &moment, true);
        }
        measures.finish().to_vec()
    }

    fn of(all: &[f64], name: &str) -> f64 {
        all[MEASURES.iter().position(|(known, ..)| *known == name).unwrap()]
    }

    #[test]
    fn a_decaying_oscillation_gives_its_frequency_growth_and_settling_time() {
        let two_pi = 2.0 * std::f64::consts::PI;
        let found = measured(|t| 0.51 + 0.1 * (-0.3 * t).exp() * (two_pi * 2.5 * t).sin());
        assert!((of(&found, "frequency_hz") - 2.5).abs() < 0.05, "{found:?}");
        assert!((of(&found, "growth") + 0.3).abs() < 0.01, "{found:?}");
        assert!((of(&found, "steady_error_m_s") - 0.01).abs() < 1e-3, "{found:?}");
        // 0.01 + 0.1 e^(−0.3 t) leaves the band of 0.05 at ln(0.1/0.04)/0.3 = 3.05 s at the latest, half a period before
        // at the earliest.
        let settled = of(&found, "settling_time_s");
        assert!(settled <= 3.05 + TICK && settled > 3.05 - 0.4, "{settled}");
        // The amplitude at 1 s, where the first steady window begins, at most.
        assert!(of(&found, "oscillation_m_s") < 0.1 * (-0.3f64).exp() && of(&found, "oscillation_m_s") > 0.06);
    }

    #[test]
    fn what_does_not_move_has_no_oscillation_and_no_frequency() {
        let found = measured(|_| 0.5);
        assert_eq!(of(&found, "oscillation_m_s"), 0.0);
        assert!(of(&found, "frequency_hz").is_nan() && of(&found, "growth").is_nan());
        assert_eq!(of(&found, "overshoot_m_s"), 0.0);
        assert_eq!(of(&found, "settling_time_s"), 0.0);
    }

    #[test]
    fn a_stretch_that_is_steady_has_its_own_growth_and_no_period_reaches_over_a_step() {
        let two_pi = 2.0 * std::f64::consts::PI;
        // Twice a decaying swing of 2.5 Hz, about another speed and begun at another phase.
        let swing = |t: f64| 0.1 * (-0.3 * t).exp() * (two_pi * 2.5 * t).sin();
        let speed = |t: f64| if t < 6.05 { 0.2 + swing(t) } else { 0.5 + swing(t - 6.05) };
        let found = |end_s| stepped(2.0, &[(0.0, 0.2), (6.04, 0.5)], end_s, speed);
        for end_s in [7.0, 8.5, 9.5, 10.5, 12.0] {
            let all = found(end_s);
            assert!((of(&all, "frequency_hz") - 2.5).abs() < 0.05, "{end_s} s: {all:?}");
            let growth = of(&all, "growth");
            // Of the second stretch's only whole second, from 8.04 to 9.04 s, there is none before.
            let single = (9.04..10.04).contains(&end_s);
            assert!(if single { growth.is_nan() } else { (growth + 0.3).abs() < 0.02 }, "{end_s} s: {growth}");
            assert!(of(&all, "last_oscillation_m_s") < 0.1 && of(&all, "last_oscillation_m_s") > 0.01);
        }
    }

    #[test]
    fn a_step_downwards_is_no_overshoot_and_no_oscillation() {
        let profile = [(0.0, 0.4), (4.0, 0.1)];
        let speed = |t: f64| if t < 4.0 - 0.5 * TICK { 0.41 } else { 0.1 };
        for after_s in [0.1, 0.5, 1.0, 3.0] {
            let all = stepped(after_s, &profile, 8.0, speed);
            assert!((of(&all, "overshoot_m_s") - 0.01).abs() < 1e-12, "{all:?}");
            assert_eq!(of(&all, "oscillation_m_s"), 0.0, "{after_s} s: {all:?}");
        }
    }
}
