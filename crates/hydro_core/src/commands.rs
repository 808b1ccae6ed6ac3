//! Test signals for the valve's current, section 3.5 of the thesis.

use crate::error::{refuse, Error};
use crate::random::Random;

/// Steps of the ECU's current.
pub const STEPS: u16 = 256;
/// Current of the highest step [A].
pub const FULL_CURRENT: f64 = 1.75;

/// Longest signal [samples]: more than a day at 50 Hz.
pub const MOST_SAMPLES: usize = 5_000_000;

/// A pseudo-random multilevel signal in steps of the ECU.
///
/// At each sample, with `switching_probability`, the level is drawn anew from `levels` evenly
/// spaced ones in [low, high] (Fri & Fahlén 2017, section 3.5: 58 to 174, 8 levels, 0.05).
///
/// # Errors
/// A range outside 0..=255 or empty, fewer than 2 levels, a probability outside (0, 1].
pub fn prms(
    samples: usize,
    seed: u64,
    low: i64,
    high: i64,
    levels: usize,
    switching_probability: f64,
) -> Result<Vec<i64>, Error> {
    if samples > MOST_SAMPLES {
        return refuse("n_samples", samples, &format!("at most {MOST_SAMPLES}"));
    }
    let most = i64::from(STEPS) - 1;
    if !(0..=most).contains(&low) {
        return refuse("low", low, "a step between 0 and 255");
    }
    if !(low + 1..=most).contains(&high) {
        return refuse("high", high, &format!("a step above low, {low}, and up to 255"));
    }
    if !(2..=(high - low + 1) as usize).contains(&levels) {
        return refuse("levels", levels, &format!("from 2 to {}, the steps in the range", high - low + 1));
    }
    if !(switching_probability > 0.0 && switching_probability <= 1.0) {
        return refuse("switching_probability", switching_probability, "above 0 and up to 1");
    }
    let level = |k: usize| {
        let share = k as f64 / (levels - 1) as f64;
        (low as f64 + share * (high - low) as f64).round() as i64
    };
    let mut random = Random::new(seed, 0);
    let mut present = level(random.below(levels));
    Ok((0..samples)
        .map(|k| {
            if k > 0 && random.uniform() < switching_probability {
                present = level(random.below(levels));
            }
            present
        })
        .collect())
}

/// Each level held for `samples_per_level` samples.
///
/// # Errors
/// A level outside 0..=255, or no samples.
pub fn staircase(levels: &[i64], samples_per_level: usize) -> Result<Vec<i64>, Error> {
    if samples_per_level == 0 {
        return refuse("samples_per_level", samples_per_level, "at least 1");
    }
    if levels.len().saturating_mul(samples_per_level) > MOST_SAMPLES {
        return refuse(
            "samples_per_level",
            samples_per_level,
            &format!("such that there are at most {MOST_SAMPLES} samples"),
        );
    }
    if let Some(level) = levels.iter().find(|level| !(0..i64::from(STEPS)).contains(*level)) {
        return refuse("levels", level, "steps between 0 and 255");
    }
    Ok(levels.iter().flat_map(|&level| std::iter::repeat_n(level, samples_per_level)).collect())
}

/// The current [A] of a step: step/255·1.75 A.
///
/// # Errors
/// A step outside 0..=255.
pub fn steps_to_current(steps: &[i64]) -> Result<Vec<f64>, Error> {
    if let Some(step) = steps.iter().find(|step| !(0..i64::from(STEPS)).contains(*step)) {
        return refuse("steps", step, "between 0 and 255");
    }
    Ok(steps.iter().map(|&step| step as f64 * FULL_CURRENT / f64::from(STEPS - 1)).collect())
}

/// The nearest current the ECU can command [A], between 0 and 1.75 A.
pub fn quantise_current(current: &[f64]) -> Vec<f64> {
    let most = f64::from(STEPS - 1);
    current.iter().map(|&u| (u * most / FULL_CURRENT).round().clamp(0.0, most) * FULL_CURRENT / most).collect()
}

/// First-order low-pass at `cutoff_hz`, exact for an input held between samples:
/// yₖ = yₖ₋₁ + (1 − e^(−2πf/f_s))(uₖ − yₖ₋₁), from rest at the first sample.
///
/// # Errors
/// A sample rate or cut-off that is not positive and finite.
pub fn low_pass(current: &[f64], sample_rate_hz: f64, cutoff_hz: f64) -> Result<Vec<f64>, Error> {
    for (name, value) in [("sample_rate_hz", sample_rate_hz), ("cutoff_hz", cutoff_hz)] {
        if !(value > 0.0 && value.is_finite()) {
            return refuse(name, value, "positive and finite");
        }
    }
    let share = 1.0 - libm::exp(-2.0 * std::f64::consts::PI * cutoff_hz / sample_rate_hz);
    let mut y = current.first().copied().unwrap_or(0.0);
    Ok(current
        .iter()
        .map(|u| {
            y += share * (u - y);
            y
        })
        .collect())
}

/// Dither: a square wave of `amplitude` [A] and `frequency_hz` on a command that is held between
/// its samples, where the command is above zero. It acts through the valve's hysteresis.
///
/// Gives the times and currents of the refined command: every sample and every edge.
///
/// # Errors
/// Unequal lengths, times that do not increase, a negative amplitude, a frequency that is not positive, more edges
/// than a command may have.
pub fn dither(time: &[f64], current: &[f64], amplitude: f64, frequency_hz: f64) -> Result<(Vec<f64>, Vec<f64>), Error> {
    if time.len() != current.len() {
        return refuse("current", current.len(), &format!("as long as time, {}", time.len()));
    }
    if !(0.0..=1.0).contains(&amplitude) {
        return refuse("amplitude", amplitude, "between 0 and 1 A");
    }
    if !(1e-6..=1e4).contains(&frequency_hz) {
        return refuse("frequency_hz", frequency_hz, "between 1e-6 and 10000 Hz");
    }
    if let Some(pair) = time.windows(2).find(|pair| !(pair[0] < pair[1] && pair[1].is_finite())) {
        return refuse("time", pair[1], "finite, and after the time before");
    }
    let half = 0.5 / frequency_hz;
    let (mut times, mut currents) = (Vec::new(), Vec::new());
    let start = time.first().copied().unwrap_or(0.0);
    let edges = (time.last().copied().unwrap_or(0.0) - start) / half;
    if edges + time.len() as f64 > MOST_SAMPLES as f64 {
        let requirement = format!("so low that a command has {MOST_SAMPLES} edges and samples at most");
        return refuse("frequency_hz", frequency_hz, &requirement);
    }
    let mut edge = 0usize;
    for (k, (&t, &u)) in time.iter().zip(current).enumerate() {
        let shaken = |edge: usize| {
            let sign = if edge.is_multiple_of(2) { 1.0 } else { -1.0 };
            if u > 0.0 {
                u + sign * amplitude
            } else {
                u
            }
        };
        // The half period the sample falls into.
        while start + (edge + 1) as f64 * half <= t + 1e-9 * half {
            edge += 1;
        }
        times.push(t);
        currents.push(shaken(edge));
        let end = time.get(k + 1).copied().unwrap_or(t);
        while start + (edge + 1) as f64 * half < end - 1e-9 * half {
            edge += 1;
            times.push(start + edge as f64 * half);
            currents.push(shaken(edge));
        }
    }
    Ok((times, currents))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_multilevel_signal_keeps_to_its_levels_and_switches_as_often_as_asked() {
        let signal = prms(100_000, 7, 58, 174, 8, 0.05).unwrap();
        let levels: std::collections::BTreeSet<i64> = signal.iter().copied().collect();
        assert_eq!(levels.len(), 8);
        assert_eq!((levels.first(), levels.last()), (Some(&58), Some(&174)));
        let switches = signal.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
        // One draw in eight meets the present level; five standard errors of a binomial count.
        let expected = 100_000.0 * 0.05 * 7.0 / 8.0;
        assert!((switches - expected).abs() < 5.0 * expected.sqrt(), "{switches}");
    }

    #[test]
    fn a_dither_without_end_is_refused() {
        let refused = |time: &[f64], hz: f64| dither(time, &vec![1.0; time.len()], 0.1, hz).is_err();
        assert!(!refused(&[0.0, 1.0], 100.0));
        for (time, hz) in [
            (vec![0.0, f64::INFINITY], 100.0),
            (vec![0.0, f64::NAN], 100.0),
            (vec![f64::NEG_INFINITY, 0.0], 100.0),
            (vec![1.0, 0.0], 100.0),
            (vec![0.0, 1.0], 1e-310),
            (vec![0.0, 1e9], 1e4),
        ] {
            assert!(refused(&time, hz), "{time:?} {hz}");
        }
    }

    #[test]
    fn the_low_pass_reaches_63_percent_after_one_time_constant() {
        let tau = 1.0 / (2.0 * std::f64::consts::PI * 3.0);
        let rate = 100.0 / tau;
        let mut step = vec![1.0; 101];
        step[0] = 0.0;
        let y = low_pass(&step, rate, 3.0).unwrap();
        assert!((y[100] - (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    }

    #[test]
    fn quantised_currents_are_steps_of_the_ecu() {
        let steps: Vec<i64> = (0..256).collect();
        let current = steps_to_current(&steps).unwrap();
        assert_eq!(quantise_current(&current), current);
        assert_eq!(quantise_current(&[9.0, -1.0]), [1.75, 0.0]);
    }

    #[test]
    fn dither_leaves_the_mean_of_a_held_command_and_a_closed_valve_alone() {
        let (time, current) = dither(&[0.0, 0.02, 0.04], &[0.8, 0.8, 0.0], 0.05, 100.0).unwrap();
        let mut mean = 0.0;
        for k in 0..time.len() - 1 {
            mean += (time[k + 1] - time[k]) * current[k];
        }
        assert!((mean / 0.04 - 0.8).abs() < 1e-12);
        assert_eq!(current.last(), Some(&0.0));
    }
}
