//! A controller's settings in the units of the ECU, and the integers they become.

use num_complex::Complex;

use super::config::{
    Config, LiftConfig, PressureConfig, ShaperConfig, INTEGRAL_SHIFT, LEARNING_SHIFT, MOST_DELAY, MOST_SHAPED,
    PRESSURE_GUARD, SHAPER_SHIFT, TEMPERATURE_GUARD, TRIM_SHIFT,
};
use super::fixed::{
    two_to, Gain, Word, CURRENT_SHIFT, FACTOR_SHIFT, MOST_CURRENT, MOST_FACTOR, MOST_SHIFT, SPEED_SHIFT,
};
use super::table::{Table, MOST_KNOTS};
use crate::error::{refuse, Error};
use crate::sensors::{ENCODER_COUNT, PRESSURE_STEP, TEMPERATURE_STEP};

/// Time between two ticks [s].
pub const TICK_S: f64 = 0.02;
/// Temperature of 0 °C in the thesis's kelvin.
const KELVIN: f64 = 273.0;
/// Where the shift (4.9) counts from [°C], Figure A.19.
const SHIFT_FROM_DEGC: f64 = 20.0;

/// Name, unit, bounds and meaning of a setting.
#[derive(Debug, Clone, Copy)]
pub struct SettingSpec {
    pub name: &'static str,
    pub unit: &'static str,
    pub lower: f64,
    pub upper: f64,
    pub meaning: &'static str,
}

macro_rules! settings {
    ($(#[$doc:meta])* $type:ident, $specs:ident: $($field:ident: $unit:literal, $lower:expr, $upper:expr, $meaning:literal;)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $type {
            $(#[doc = concat!($meaning, " [", $unit, "].")] pub $field: f64,)*
        }

        /// One row per setting, in the order of the fields.
        pub const $specs: &[SettingSpec] = &[
            $(SettingSpec { name: stringify!($field), unit: $unit, lower: $lower, upper: $upper, meaning: $meaning },)*
        ];

        impl $type {
            /// From values in the order of the table, each within its bounds.
            ///
            /// # Errors
            /// [`Error::OutOfBounds`], named under `prefix`; a wrong number of values.
            pub fn from_values(prefix: &str, values: &[f64]) -> Result<Self, Error> {
                if values.len() != $specs.len() {
                    return Err(Error::Shape {
                        name: prefix.into(),
                        got: values.len().to_string(),
                        expected: format!("{}, one per setting", $specs.len()),
                    });
                }
                for (spec, &value) in $specs.iter().zip(values) {
                    spec.check(prefix, value)?;
                }
                let [$($field,)*] = *values else { unreachable!("the lengths are equal") };
                Ok($type { $($field,)* })
            }
        }
    };
}

impl SettingSpec {
    fn check(&self, prefix: &str, value: f64) -> Result<(), Error> {
        if value >= self.lower && value <= self.upper {
            return Ok(());
        }
        Err(Error::OutOfBounds {
            name: format!("{prefix}.{}", self.name),
            value,
            lower: self.lower,
            upper: self.upper,
            unit: self.unit.into(),
            reason: "the range that the controller's integers are laid out for".into(),
        })
    }
}

settings! {
    /// One lift's numbers.
    LiftSettings, LIFT_SETTINGS:
    proportional: "1", -4.0, 4.0, "P of (4.12)";
    integral: "1/s", 0.0, 20.0, "I of (4.12)";
    derivative: "s", -0.5, 0.5, "D of (4.12)";
    a: "1/K", -0.02, 0.02, "slope of (4.8)";
    b: "1", -3.0, 7.0, "constant of (4.8), for T in kelvin";
    c: "mA/K", -10.0, 10.0, "slope of (4.9)";
    d: "mA", -500.0, 500.0, "constant of (4.9), for T in degC less 20";
    forks_per_count: "1", 0.5, 4.0, "travel of the forks over that of the encoder";
    filter_rate: "1/s", 1.0, 100.0, "corner of the derivative filter (A.17)";
    delay: "tick", 0.0, 15.0, "delay of the reference model";
    u_min: "mm/s", 0.0, 4095.0, "least speed ordered of the table (4.7)";
    u_max: "mm/s", 0.0, 4095.0, "greatest speed ordered of the table (4.7)";
    i_min: "mA", 0.0, 1750.0, "least current while lowering";
    i_max: "mA", 0.0, 1750.0, "greatest current";
    adaptation_s: "s", 0.0, 1000.0, "time in which the feed-forward learns at full speed; 0 if it does not";
    swing_limit: "mm/s", 0.0, 500.0, "greatest correction by the pressure's swing";
    early_corner: "Hz", 0.1, 25.0, "corner of the low-pass on the ramp ahead of the shaper; without one ramp_corner counts";
    prediction: "1", 0.0, 1.0, "share of the corrections of the last delay that the predictor takes off the error";
    overspeed: "1", 0.0, 20.0, "what is above overspeed_from counts this more in the integral part";
    overspeed_from: "mm/s", 0.0, 4095.0, "speed from which on the integral part sees more";
}

settings! {
    /// What both lifts share.
    SharedSettings, SHARED_SETTINGS:
    request_most: "mm/s", 1.0, 4095.0, "greatest speed that can be asked for";
    ramp_up: "mm/s2", 1.0, 100000.0, "slope of the rising reference";
    ramp_down: "mm/s2", 1.0, 100000.0, "slope of the falling reference";
    ramp_corner: "Hz", 0.1, 25.0, "corner of the low-pass on the ramp";
    temperature_least: "degC", -40.0, 150.0, "colder oil counts as this";
    temperature_most: "degC", -40.0, 150.0, "warmer oil counts as this";
}

/// A curve over evenly spaced knots, of which the distance is a power of two of the sensor's steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub first: i32,
    pub spacing: u32,
    pub values: Vec<f64>,
}

/// Feedback of the pressure's swing, at mean pressures from 0 on.
#[derive(Debug, Clone, PartialEq)]
pub struct SwingSettings {
    /// The base-2 logarithm of the knots' distance [steps of the pressure sensor].
    pub spacing: u32,
    /// At each knot: what swings [Hz], its damping, correction [mm/s per bar] and by how much it leads [degrees].
    pub frequency: Vec<f64>,
    pub damping: Vec<f64>,
    pub gain: Vec<f64>,
    pub lead: Vec<f64>,
}

/// A reference shaped to what swings, at mean pressures from 0 on.
#[derive(Debug, Clone, PartialEq)]
pub struct ShaperSettings {
    /// The base-2 logarithm of the knots' distance [steps of the pressure sensor].
    pub spacing: u32,
    /// At each knot: the second impulse's delay, half a period [s], and the first one's share.
    pub delay: Vec<f64>,
    pub share: Vec<f64>,
}

/// A lift's numbers and curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Lift {
    pub numbers: LiftSettings,
    /// Current [mA] over speed, knots 2^`spacing` mm/s apart.
    pub table: Curve,
    /// Share of the reference over the forks' height, knots in counts.
    pub ratio: Curve,
    /// None: what swings is left alone.
    pub swing: Option<SwingSettings>,
    /// None: the reference is not shaped.
    pub shaper: Option<ShaperSettings>,
}

/// A controller in the units of the ECU.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    pub shared: SharedSettings,
    pub lifts: [Lift; 2],
}

/// The base-2 logarithm of the most that knots may stand apart, in steps of the sensor or units of the setting.
const MOST_SPACING: u32 = 14;
const APART: &str = "a spacing of at most 14: knots are 2^spacing apart";
/// How far from zero a curve's first knot may stand, in the same steps.
const MOST_FIRST: u32 = 1 << 20;

/// The integer nearest to `value`, which comes of the setting `name` that is `told`.
fn gain(name: &str, told: f64, value: f64, word: Word, most_shift: u32) -> Result<Gain, Error> {
    match Gain::nearest(value, word, most_shift) {
        Some(gain) => Ok(gain),
        None => refuse(name, told, &format!("a gain that {} bits hold", word.bits())),
    }
}

/// Each of the values of `name` within its bounds.
fn within(name: &str, values: &[f64], lower: f64, upper: f64, unit: &str) -> Result<(), Error> {
    match values.iter().find(|value| !(lower..=upper).contains(*value)) {
        Some(value) => refuse(name, value, format!("from {lower} to {upper} {unit}").trim_end()),
        None => Ok(()),
    }
}

/// A scale, and the largest integer of it.
#[derive(Debug, Clone, Copy)]
struct Scale(f64, i64);

const FACTORS: Scale = Scale((1u64 << FACTOR_SHIFT) as f64, MOST_FACTOR);
const CURRENTS: Scale = Scale((1u64 << CURRENT_SHIFT) as f64, MOST_CURRENT);

/// A table of values over knots that begin at `first` and are 2^spacing apart, as fine as the word allows.
fn table(
    name: &str,
    (first, spacing): (i32, u32),
    values: &[f64],
    Scale(scale, most): Scale,
    word: Word,
) -> Result<Table, Error> {
    if !(2..=MOST_KNOTS).contains(&values.len()) {
        return Err(Error::TableLength { name: name.into(), length: values.len(), most: MOST_KNOTS });
    }
    let whole = |value: f64| (value * scale).round();
    let held = |value: f64| whole(value).abs() <= most as f64;
    if let Some(&value) = values.iter().find(|value| !held(**value)) {
        return refuse(name, value, &format!("within {} of zero", most as f64 / scale));
    }
    let largest = values.iter().fold(0.0, |most: f64, &value| most.max(whole(value).abs()));
    let widen = (0..32).find(|&widen| (largest / two_to(widen)).round() <= word.most() as f64).unwrap_or(32);
    // What a knot stands for has 32 bits, too: the largest may not be rounded up to 2^31.
    let most = (i64::from(i32::MAX) >> widen) as f64;
    let knots = values.iter().map(|&value| (whole(value) / two_to(widen)).round().clamp(-most, most) as i32).collect();
    Ok(Table { first, spacing, widen, knots })
}

/// A curve of which x has a scale of `shift`.
fn curve(name: &str, curve: &Curve, shift: u32, scale: Scale, word: Word) -> Result<Table, Error> {
    if curve.spacing > MOST_SPACING {
        return refuse(name, curve.spacing, APART);
    }
    match i32::try_from(i64::from(curve.first) << shift) {
        Ok(first) if curve.first.unsigned_abs() <= MOST_FIRST => {
            table(name, (first, curve.spacing + shift), &curve.values, scale, word)
        }
        _ => {
            let most = MOST_FIRST.min(i32::MAX as u32 >> shift);
            refuse(name, curve.first, &format!("a first knot from -{most} to {most}"))
        }
    }
}

impl Settings {
    /// The integers of a word length: each the nearest to its setting.
    ///
    /// # Errors
    /// A setting that the word cannot hold, or tables of unfit length.
    pub fn config(&self, word: Word) -> Result<Config, Error> {
        let shared = &self.shared;
        let (speed, factor) = (two_to(SPEED_SHIFT), two_to(FACTOR_SHIFT));
        if shared.temperature_least >= shared.temperature_most {
            return refuse("temperature_most", shared.temperature_most, "above temperature_least");
        }
        let [free, main] = &self.lifts;
        let ratio = |name: &str, lift: &Lift| {
            let name = format!("{name}.ratio");
            within(&name, &lift.ratio.values, 0.0, 1.0, "")?;
            curve(&name, &lift.ratio, 0, FACTORS, word)
        };
        let pole = libm::exp(-2.0 * std::f64::consts::PI * shared.ramp_corner * TICK_S);
        Ok(Config {
            word,
            request_most: (shared.request_most * speed).round() as i32,
            ramp_up: (shared.ramp_up * TICK_S * speed).round().max(1.0) as i32,
            ramp_down: (shared.ramp_down * TICK_S * speed).round().max(1.0) as i32,
            ramp_pole: (pole * factor).round() as i32,
            temperature_least: (shared.temperature_least / TEMPERATURE_STEP).round() as i32,
            temperature_most: (shared.temperature_most / TEMPERATURE_STEP).round() as i32,
            ratio: [ratio("free", free)?, ratio("main", main)?],
            lifts: [free.config("free", shared, word)?, main.config("main", shared, word)?],
        })
    }
}

impl Lift {
    fn config(&self, name: &str, shared: &SharedSettings, word: Word) -> Result<LiftConfig, Error> {
        let s = &self.numbers;
        let full = |setting: &str| format!("{name}.{setting}");
        let (speed, factor, current) = (two_to(SPEED_SHIFT), two_to(FACTOR_SHIFT), two_to(CURRENT_SHIFT));
        let step = TEMPERATURE_STEP / two_to(TEMPERATURE_GUARD);
        let own = |setting: &str, told: f64, scale: f64| gain(&full(setting), told, told * scale, word, MOST_SHIFT);
        let per_count = ENCODER_COUNT * 1e3 * s.forks_per_count / TICK_S;
        if s.u_min > s.u_max || s.i_min > s.i_max {
            return refuse(&full("u_max, i_max"), format!("{}, {}", s.u_max, s.i_max), "at least u_min, i_min");
        }
        if !self.table.values.windows(2).all(|pair| pair[0] <= pair[1]) {
            return refuse(&full("table"), "falling", "a current that does not fall with the speed");
        }
        // dk = μ I r, I falls by μ I r²: at the full speed of (4.7) with the time constant asked for.
        let learning = match s.adaptation_s > 0.0 {
            true => TICK_S / s.adaptation_s / (s.u_max * s.u_max) * two_to(TRIM_SHIFT - LEARNING_SHIFT),
            false => 0.0,
        };
        let Some(adaptation) = Gain::nearest(learning, word, MOST_SHIFT) else {
            let requirement = format!(
                "a longer time, or 0: at u_max = {} mm/s {} bits do not hold what it gives",
                s.u_max,
                word.bits()
            );
            return refuse(&full("adaptation_s"), s.adaptation_s, &requirement);
        };
        let early_corner = if self.shaper.is_some() { s.early_corner } else { shared.ramp_corner };
        let early_pole = libm::exp(-2.0 * std::f64::consts::PI * early_corner * TICK_S);
        Ok(LiftConfig {
            most: (shared.request_most * speed).round() as i32,
            early_pole: (early_pole * factor).round() as i32,
            shaper: self.shaper_config(&full("shaper"), word)?,
            prediction: (s.prediction * factor).round() as i32,
            overspeed: own("overspeed", s.overspeed, 1.0)?,
            overspeed_from: (s.overspeed_from * speed).round() as i32,
            count_speed: (per_count * speed).round() as i32,
            pole: (libm::exp(-s.filter_rate * TICK_S) * factor).round() as i32,
            delay: (s.delay.round() as u32).min(MOST_DELAY as u32 - 1),
            proportional: own("proportional", s.proportional, 1.0)?,
            integral: gain(&full("integral"), s.integral, s.integral * TICK_S, word, INTEGRAL_SHIFT)?,
            derivative: gain(&full("derivative"), s.derivative, s.derivative / TICK_S, word, MOST_SHIFT)?,
            u_min: (s.u_min * speed).round() as i32,
            u_max: (s.u_max * speed).round() as i32,
            adaptation,
            scale_base: ((s.a * KELVIN + s.b) * factor).round() as i32,
            scale_slope: own("a", s.a, step * factor)?,
            table: curve(&full("table"), &self.table, SPEED_SHIFT, CURRENTS, word)?,
            shift_base: ((s.d - s.c * SHIFT_FROM_DEGC) * current).round() as i32,
            shift_slope: own("c", s.c, step * current)?,
            i_min: (s.i_min * current).round() as i32,
            i_max: (s.i_max * current).round() as i32,
            pressure: self.swing_config(&full("swing"), word)?,
        })
    }

    fn shaper_config(&self, name: &str, word: Word) -> Result<ShaperConfig, Error> {
        let Some(shaper) = &self.shaper else {
            return Ok(ShaperConfig { delay: Table::constant(0, 0), share: Table::constant(1, FACTOR_SHIFT) });
        };
        if shaper.delay.len() != shaper.share.len() {
            return refuse(name, "of unequal lengths", "a delay and a share at each knot");
        }
        if shaper.spacing > MOST_SPACING {
            return refuse(name, shaper.spacing, APART);
        }
        let scale = two_to(SHAPER_SHIFT) / TICK_S;
        let longest = MOST_SHAPED as f64 / scale;
        within(&format!("{name}.delay_s"), &shaper.delay, 0.0, longest, "s")?;
        within(&format!("{name}.share"), &shaper.share, 0.0, 1.0, "")?;
        let over = (0, shaper.spacing + PRESSURE_GUARD);
        let delay = table(name, over, &shaper.delay, Scale(scale, MOST_SHAPED), word)?;
        Ok(ShaperConfig { delay, share: table(name, over, &shaper.share, FACTORS, word)? })
    }

    fn swing_config(&self, name: &str, word: Word) -> Result<PressureConfig, Error> {
        let none = || Table::constant(0, 0);
        let Some(swing) = &self.swing else {
            let (cosine, sine, real, imaginary) = (none(), none(), none(), none());
            return Ok(PressureConfig { cosine, sine, real, imaginary, shift: 0, limit: 0 });
        };
        let n = swing.frequency.len();
        if [&swing.damping, &swing.gain, &swing.lead].iter().any(|values| values.len() != n) {
            return refuse(name, "of unequal lengths", "a frequency, damping, gain and lead at each knot");
        }
        if swing.spacing > MOST_SPACING {
            return refuse(name, swing.spacing, APART);
        }
        within(&format!("{name}.frequency_hz"), &swing.frequency, 0.2, 10.0, "Hz")?;
        within(&format!("{name}.damping"), &swing.damping, 0.02, 0.95, "")?;
        within(&format!("{name}.gain_mm_s_per_bar"), &swing.gain, 0.0, 50.0, "mm/s per bar")?;
        within(&format!("{name}.lead_deg"), &swing.lead, -360.0, 360.0, "degrees")?;
        let designed: Vec<(Complex<f64>, Complex<f64>)> = (0..n).map(|k| swing.resonator(k)).collect();
        // Speed per state: from mm/s per step of the sensor to the scales of both.
        let scale = two_to(SPEED_SHIFT) / two_to(PRESSURE_GUARD);
        let largest = designed.iter().flat_map(|(_, g)| [g.re.abs(), g.im.abs()]).fold(0.0, f64::max) * scale;
        let shift = gain(name, largest, largest, Word::Bits32, 31)?.shift;
        let output = Scale(scale * two_to(shift), Word::Bits32.most());
        type Knot = (Complex<f64>, Complex<f64>);
        let each = |scale: Scale, f: &dyn Fn(&Knot) -> f64| {
            let values: Vec<f64> = designed.iter().map(f).collect();
            table(name, (0, swing.spacing + PRESSURE_GUARD), &values, scale, word)
        };
        Ok(PressureConfig {
            cosine: each(FACTORS, &|(turn, _)| turn.re)?,
            sine: each(FACTORS, &|(turn, _)| turn.im)?,
            real: each(output, &|(_, g)| g.re)?,
            imaginary: each(output, &|(_, g)| -g.im)?,
            shift,
            limit: (self.numbers.swing_limit * two_to(SPEED_SHIFT)).round() as i32,
        })
    }
}

/// r e^{jφ}, through functions that round alike on every machine.
fn polar(r: f64, phi: f64) -> Complex<f64> {
    Complex::new(r * libm::cos(phi), r * libm::sin(phi))
}

impl SwingSettings {
    /// What turns the resonator's state in a tick, and what its output is read with, at knot `k`.
    ///
    /// z ← ρ e^{jϑ} z + p − p₋₁, w = Re(γ z): the matched poles of 2ζωs/(s² + 2ζωs + ω²), with γ such that a swing of
    /// the frequency ω is answered by the gain and the lead asked for.
    fn resonator(&self, k: usize) -> (Complex<f64>, Complex<f64>) {
        let omega = 2.0 * std::f64::consts::PI * self.frequency[k] * TICK_S;
        let damping = self.damping[k];
        let pole = polar(libm::exp(-damping * omega), omega * (1.0 - damping * damping).sqrt());
        // Of a real input e^{jωk}, whose real part it is, both γ/(1 − pole e^{−jω}) and the mirror image's answer.
        let tick = polar(1.0, -omega);
        let difference = Complex::new(1.0, 0.0) - tick;
        let with = 0.5 * difference / (Complex::new(1.0, 0.0) - pole * tick);
        let against = 0.5 * difference / (Complex::new(1.0, 0.0) - pole.conj() * tick);
        let per_step = self.gain[k] * PRESSURE_STEP / 1e5;
        let wanted = polar(per_step, self.lead[k].to_radians());
        // γ·with + γ̄·against = wanted: two real equations for γ = x + jy.
        let (x, y) = (with + against, Complex::new(0.0, 1.0) * (with - against));
        let determinant = x.re * y.im - x.im * y.re;
        let re = (wanted.re * y.im - wanted.im * y.re) / determinant;
        let im = (x.re * wanted.im - x.im * wanted.re) / determinant;
        (pole, Complex::new(re, im))
    }
}
