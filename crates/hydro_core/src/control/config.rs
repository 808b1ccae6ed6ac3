//! The controller's integers: everything that a tick reads and never changes.

use super::fixed::{Gain, Word, SPEED_SHIFT};
use super::table::Table;

/// Longest delay of the reference model [ticks].
pub const MOST_DELAY: usize = 16;
/// Ticks that are remembered, of the reference and of the correction.
pub const PAST: usize = 32;
/// Scale of a shaper's delay: fractions of a tick.
pub const SHAPER_SHIFT: u32 = 16;
/// Longest delay of a shaper [ticks / 2^[`SHAPER_SHIFT`]]: the tick beyond it is remembered as well.
pub const MOST_SHAPED: i64 = (PAST as i64 - 2) << SHAPER_SHIFT;
/// Bits of a pressure filter's states below a step of the sensor.
pub const PRESSURE_GUARD: u32 = 16;
/// Share of the pressure's mean that a tick renews: 2^−this, a time constant of 0.64 s at 50 Hz.
pub const MEAN_SHIFT: u32 = 5;
/// A reference below this is none [speed], 1/16 mm/s: the last bits of the low-pass would hold the valve open for
/// another second.
pub const LEAST_REFERENCE: i64 = 1 << (SPEED_SHIFT - 4);
/// Scale of the integrator, below that of a speed: products of the error and the gain are added to it exactly.
pub const INTEGRAL_SHIFT: u32 = 24;
/// Scale of the feed-forward's trim.
pub const TRIM_SHIFT: u32 = 30;
/// Scale of the product of two speeds that moves it [mm²/s²].
pub const LEARNING_SHIFT: u32 = 6;
/// Bits that the oil temperature has below a step of the sensor where it is scaled by.
pub const TEMPERATURE_GUARD: u32 = 16;
/// Largest trim of the feed-forward, a quarter.
pub const MOST_TRIM: i64 = 1 << (TRIM_SHIFT - 2);
/// Largest difference of the encoder in a tick that counts as one [counts]: 6.3 m/s of the sensor.
pub const MOST_COUNTS: i64 = 64;
/// Largest pressure that counts [steps]: 600 bar.
pub const MOST_PRESSURE: i64 = 10_000;
/// Largest change of the pressure in a tick that counts [steps]: 60 bar.
pub const MOST_PRESSURE_CHANGE: i64 = 1_000;
/// Largest state of the resonator [steps]; it is clamped there, so that a proof of its range needs no norm.
pub const MOST_RESONANCE: i64 = 16_000;

/// Feedback of what swings in the cylinder's pressure: a resonator whose frequency, gain and phase follow the mean
/// pressure, which is the load's.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct PressureConfig {
    /// Over the mean pressure [steps / 2^[`PRESSURE_GUARD`]]: what a tick makes of the resonator's state, ρ cos θ and ρ sin θ, as factors.
    pub cosine: Table,
    pub sine: Table,
    /// Over the mean pressure: speed per state, mantissas of the shift below.
    pub real: Table,
    pub imaginary: Table,
    pub shift: u32,
    /// Largest correction [speed].
    pub limit: i32,
}

impl PressureConfig {
    /// Whether nothing is fed back.
    #[inline(always)]
    pub fn is_quiet(&self) -> bool {
        [&self.cosine, &self.sine, &self.real, &self.imaginary].into_iter().all(Table::is_zero)
    }
}

/// A reference shaped to what swings: two impulses half a period apart, of which the second answers the swing that the
/// first one leaves (Singer & Seering 1990), over the mean pressure, which tells the load.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ShaperConfig {
    /// Over the mean pressure [steps / 2^[`PRESSURE_GUARD`]]: half a period [ticks / 2^[`SHAPER_SHIFT`]].
    pub delay: Table,
    /// Over the mean pressure: the first impulse, a factor.
    pub share: Table,
}

/// One lift's controller.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct LiftConfig {
    /// Largest reference [speed].
    pub most: i32,
    /// Pole of the low-pass ahead of the shaper, a factor.
    pub early_pole: i32,
    pub shaper: ShaperConfig,
    /// How much of the corrections that have not shown yet the predictor takes off the error, a factor.
    pub prediction: i32,
    /// The integral part sees a speed above `overspeed_from` [speed] by this more.
    pub overspeed: Gain,
    pub overspeed_from: i32,
    /// Speed of the forks per encoder count and tick [speed].
    pub count_speed: i32,
    /// Pole of the derivative filter (A.17), a factor.
    pub pole: i32,
    /// Of the reference model [ticks].
    pub delay: u32,
    /// (4.12): P, I·T_s and D/T_s.
    pub proportional: Gain,
    pub integral: Gain,
    pub derivative: Gain,
    /// (4.7) [speed].
    pub u_min: i32,
    pub u_max: i32,
    /// Share of the integrator that a tick moves into the feed-forward's trim, per square of the reference.
    pub adaptation: Gain,
    /// (4.8): the factor at 0 °C, and its slope over 2^−[`TEMPERATURE_GUARD`] temperature steps.
    pub scale_base: i32,
    pub scale_slope: Gain,
    /// From speed to current.
    pub table: Table,
    /// (4.9): the shift at 0 °C [current], and its slope over 2^−[`TEMPERATURE_GUARD`] temperature steps.
    pub shift_base: i32,
    pub shift_slope: Gain,
    /// Of the valve [current].
    pub i_min: i32,
    pub i_max: i32,
    pub pressure: PressureConfig,
}

/// Both lifts' controllers, the reference they share, and the transition between them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Config {
    pub word: Word,
    /// Largest request [speed].
    pub request_most: i32,
    /// Largest change of the ramp in a tick [speed].
    pub ramp_up: i32,
    pub ramp_down: i32,
    /// Pole of the low-pass on the ramp, a factor.
    pub ramp_pole: i32,
    /// Oil temperatures outside this range count as its ends [steps].
    pub temperature_least: i32,
    pub temperature_most: i32,
    /// Over the forks' height [counts]: each lift's share of the reference (4.10), (4.11), a factor.
    pub ratio: [Table; 2],
    pub lifts: [LiftConfig; 2],
}

impl Config {
    /// Every integer in a fixed order: what the hash is taken of.
    fn integers(&self) -> Vec<i64> {
        let mut all = vec![i64::from(self.word.bits())];
        let reference = [self.request_most, self.ramp_up, self.ramp_down, self.ramp_pole];
        all.extend(reference.iter().chain(&[self.temperature_least, self.temperature_most]).map(|&x| i64::from(x)));
        let table = |all: &mut Vec<i64>, table: &Table| {
            all.extend([i64::from(table.first), i64::from(table.spacing), i64::from(table.widen)]);
            all.push(table.knots.len() as i64);
            all.extend(table.knots.iter().map(|&y| i64::from(y)));
        };
        self.ratio.iter().for_each(|ratio| table(&mut all, ratio));
        for lift in &self.lifts {
            for gain in [
                lift.proportional,
                lift.integral,
                lift.derivative,
                lift.adaptation,
                lift.scale_slope,
                lift.shift_slope,
                lift.overspeed,
            ] {
                all.extend([i64::from(gain.mantissa), i64::from(gain.shift)]);
            }
            let limits = [lift.u_min, lift.u_max, lift.i_min, lift.i_max, lift.pressure.limit];
            all.extend(
                [lift.count_speed, lift.pole, lift.scale_base, lift.shift_base]
                    .iter()
                    .chain(&limits)
                    .map(|&x| i64::from(x)),
            );
            let beyond = [lift.most, lift.early_pole, lift.prediction, lift.overspeed_from];
            all.extend(beyond.iter().map(|&x| i64::from(x)));
            all.extend([i64::from(lift.delay), i64::from(lift.pressure.shift)]);
            [&lift.shaper.delay, &lift.shaper.share].into_iter().for_each(|t| table(&mut all, t));
            let p = &lift.pressure;
            [&lift.table, &p.cosine, &p.sine, &p.real, &p.imaginary].into_iter().for_each(|t| table(&mut all, t));
        }
        all
    }

    /// FNV-1a (Fowler, Noll & Vo) over all integers: a controller's file, its C and its run show the same.
    pub fn hash(&self) -> u64 {
        let bytes = self.integers().into_iter().flat_map(i64::to_le_bytes);
        bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
    }
}
