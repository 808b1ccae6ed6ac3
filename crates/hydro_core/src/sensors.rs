//! What a truck's sensors make of the true signals.

use std::f64::consts::PI;

use crate::random::Random;

/// Travel per count of the incremental encoder [m]: a wheel of 80 mm with 128 slits
/// (Fri & Fahlén 2017, section 3.1.4).
pub const ENCODER_COUNT: f64 = PI * 0.08 / 128.0;
/// Standard deviation of the pressure sensors' noise [Pa].
pub const PRESSURE_NOISE: f64 = 0.3e5;
/// Resolution of the pressure sensors [Pa].
pub const PRESSURE_STEP: f64 = 0.06e5;
/// Standard deviation of the temperature sensor's noise [°C].
pub const TEMPERATURE_NOISE: f64 = 0.1;
/// Resolution of the temperature sensor [°C].
pub const TEMPERATURE_STEP: f64 = 0.5;
/// Standard deviation of the external height sensor's noise [m].
pub const HEIGHT_NOISE: f64 = 0.5e-3;

/// The encoder's reading: whole counts, rounded down.
pub fn encoder(position: &[f64]) -> Vec<f64> {
    position.iter().map(|x| (x / ENCODER_COUNT).floor() * ENCODER_COUNT).collect()
}

/// Gaussian noise of standard deviation `noise`, then rounding to multiples of `step` (zero: none).
pub fn noisy(signal: &[f64], noise: f64, step: f64, seed: u64, stream: u64) -> Vec<f64> {
    let mut random = Random::new(seed, stream);
    signal
        .iter()
        .map(|x| {
            let read = x + noise * random.normal();
            if step > 0.0 {
                (read / step).round() * step
            } else {
                read
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_encoder_counts_in_steps_of_1_963_mm_and_never_reads_high() {
        assert!((ENCODER_COUNT - 1.963e-3).abs() < 5e-7);
        for k in 0..1000 {
            let x = 0.0017 * k as f64;
            let read = encoder(&[x])[0];
            assert!(read <= x + 1e-12 && x - read < ENCODER_COUNT + 1e-12);
        }
    }

    #[test]
    fn a_noisy_reading_lies_on_its_steps_and_depends_on_seed_and_stream_alone() {
        let signal = [1e7; 50];
        let read = noisy(&signal, PRESSURE_NOISE, PRESSURE_STEP, 1, 2);
        assert!(read.iter().all(|p| (p / PRESSURE_STEP - (p / PRESSURE_STEP).round()).abs() < 1e-6));
        assert_eq!(read, noisy(&signal, PRESSURE_NOISE, PRESSURE_STEP, 1, 2));
        assert_ne!(read, noisy(&signal, PRESSURE_NOISE, PRESSURE_STEP, 1, 3));
    }
}
