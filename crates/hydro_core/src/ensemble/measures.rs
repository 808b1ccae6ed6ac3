//! What is measured of a lowering while it runs: a few numbers of constant memory in place of a trajectory.

use super::requirement::Moment;
use super::window::Extremes;
use crate::scalar::{Mask, Scalar};

/// What [`Measures::finish`] gives, by name, unit and meaning. Steady: the speed asked for has stood for the settling
/// time. Not a number where there was nothing to measure.
pub const MEASURES: &[(&str, &str, &str)] = &[
    ("peak_speed_m_s", "m/s", "highest lowering speed of the forks"),
    ("steady_peak_speed_m_s", "m/s", "highest lowering speed of the forks in steady stretches"),
    ("peak_pressure_pa", "Pa", "highest cylinder pressure"),
    ("overshoot_m_s", "m/s", "most that the speed exceeded the speed asked for after a step"),
    ("settling_time_s", "s", "longest time after a step until the error stays within the band"),
    ("oscillation_m_s", "m/s", "largest amplitude of the speed over a second in steady stretches"),
    ("last_oscillation_m_s", "m/s", "amplitude of the speed over the last whole second of a steady stretch"),
    ("growth", "1", "natural logarithm of that amplitude over the one a second before"),
    ("frequency_hz", "Hz", "of the oscillation, from crossings of its middle"),
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
    tick_s: f64,
    /// Ticks of a second, and of the settling time.
    second: f64,
    after: f64,
    window: Extremes<S>,
    peak_speed: S,
    steady_peak: S,
    peak_pressure: S,
    overshoot: S,
    /// Ticks since the step when the error was outside the band last.
    outside: S,
    oscillation: S,
    /// Of the present second: ticks, extremes, sum of errors.
    ticks: S,
    high: S,
    low: S,
    errors: S,
    /// Of the last two whole seconds: peak to peak; of the last one its middle and mean error.
    swing: S,
    swing_before: S,
    middle: S,
    mean_error: S,
    /// Which side of the middle the speed was on last, upward crossings, and the ticks over which they were counted.
    side: S,
    crossings: S,
    first_crossing: S,
    last_crossing: S,
    steady_ticks: S,
    ended: S,
}

impl<S: Scalar> Measures<S> {
    pub fn new(settling: Settling, tick_s: f64) -> Self {
        let second = (1.0 / tick_s).round();
        let (zero, none) = (S::zero(), S::constant(f64::NAN));
        let low = S::constant(f64::NEG_INFINITY);
        Measures {
            settling,
            tick_s,
            second,
            after: (settling.after_s / tick_s).round(),
            window: Extremes::new(second as usize + 1),
            peak_speed: low,
            steady_peak: low,
            peak_pressure: low,
            overshoot: low,
            outside: zero,
            oscillation: low,
            ticks: zero,
            high: low,
            low: S::constant(f64::INFINITY),
            errors: zero,
            swing: none,
            swing_before: none,
            middle: none,
            mean_error: none,
            side: zero,
            crossings: zero,
            first_crossing: none,
            last_crossing: none,
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
        self.overshoot = keep(counted.and(S::zero().lt(now.request)), self.overshoot.max(over), self.overshoot);
        let strays = number(self.settling.band_m_s).lt(now.error.abs()).and(counted);
        self.outside = keep(strays, self.outside.max(now.since + S::one()), self.outside);

        let steady = now.since.lt(number(self.after)).not().and(counted);
        self.steady_peak = keep(steady, self.steady_peak.max(now.speed), self.steady_peak);
        self.oscillation = keep(steady, self.oscillation.max(number(0.5) * (high - low)), self.oscillation);

        // Whole seconds since the stretch became steady.
        let begins = steady.and(now.since.lt(number(self.after + 1.0)));
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
        let first = crosses.and(self.crossings.lt(number(0.5)));
        self.first_crossing = keep(first, self.steady_ticks, self.first_crossing);
        self.last_crossing = keep(crosses, self.steady_ticks, self.last_crossing);
        self.crossings = keep(crosses, self.crossings + S::one(), self.crossings);
        self.side = keep(above, S::one(), keep(below, -S::one(), self.side));

        let full = steady.and(self.ticks.lt(number(self.second)).not());
        if full.any() {
            self.swing_before = keep(full, self.swing, self.swing_before);
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
        let half = S::constant(0.5);
        // Two swings that are not positive have no ratio.
        let both = S::zero().lt(self.swing).and(S::zero().lt(self.swing_before));
        let ratio = S::select(both, self.swing / self.swing_before, S::one());
        let twice = S::one().lt(self.crossings);
        let periods = S::select(twice, self.crossings - S::one(), S::one());
        let ticks = S::select(twice, self.last_crossing - self.first_crossing, S::one());
        [
            found(self.peak_speed),
            found(self.steady_peak),
            found(self.peak_pressure),
            found(self.overshoot),
            S::constant(self.tick_s) * self.outside,
            found(self.oscillation),
            half * self.swing,
            S::select(both, ratio.ln(), none),
            S::select(twice, periods / (S::constant(self.tick_s) * ticks), none),
            self.mean_error,
            self.ended,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 0.02;

    fn measured(speed: impl Fn(f64) -> f64) -> Vec<f64> {
        let settling = Settling { after_s: 2.0, band_m_s: 0.05 };
        let mut measures = Measures::<f64>::new(settling, TICK);
        for k in 0..500 {
            let speed = speed(k as f64 * TICK);
            let moment = Moment {
                speed,
                error: speed - 0.5,
                pressure: 1e6 + speed,
                position: 0.0,
                current: 0.0,
                request: 0.5,
                step: if k == 0 { 0.5 } else { 0.0 },
                since: k as f64,
            };
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
}
