//! What varies from member to member, and what a member is then made of.

use super::controllers::within_bounds;
use super::distribution::Distribution;
use super::draw;
use crate::error::{refuse, Error};
use crate::random::Random;
use crate::run::blocks::valve_steps;
use crate::run::sensing::Sensors;
use crate::run::Lifts;
use crate::scalar::Scalar;
use crate::sensors::{ENCODER_COUNT, PRESSURE_NOISE, TEMPERATURE_NOISE};
use crate::solver::fixed::ValveSteps;
use crate::truck::{Limits, Truck};

/// One thing that varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// The k-th of [`Truck::values`].
    Parameter(usize),
    /// The k-th of the controller's numbers.
    Controller(usize),
    Condition(Condition),
    /// The speed asked for in the k-th stretch of the profile [m/s].
    Level(usize),
}

macro_rules! conditions {
    ($($condition:ident $name:literal, $unit:literal, $lower:expr, $upper:expr, $meaning:literal;)*) => {
        /// What a member's run can be given besides the truck and its controller.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Condition {
            $($condition,)*
        }
        /// The conditions with name, unit, bounds and meaning.
        pub const CONDITIONS: &[(Condition, &str, &str, f64, f64, &str)] =
            &[$((Condition::$condition, $name, $unit, $lower, $upper, $meaning),)*];
    };
}

conditions! {
    Load "load_kg", "kg", 0.0, 2e4, "mass on the forks";
    OilTemperature "oil_temperature_degc", "degC", -50.0, 150.0, "oil temperature in the tank";
    StartFree "start_free_m", "m", 0.0, 20.0, "cylinder position at which the free lift starts";
    StartMain "start_main_m", "m", 0.0, 20.0, "cylinder position at which the main lift starts";
    Reference "reference_factor", "1", 0.0, 10.0, "factor on every speed asked for";
    Delay "delay_ticks", "1", 0.0, 100.0, "ticks from reading the sensors to the current in the valve's coil, whole";
    PressureNoise "pressure_noise_pa", "Pa", 0.0, 1e7, "standard deviation of the pressure sensors' noise";
    TemperatureNoise "temperature_noise_k", "K", 0.0, 50.0, "standard deviation of the temperature sensor's noise";
    EncoderFactor "encoder_factor", "1", 0.0, 10.0, "counts that the encoders give for each true one";
    PressureOffset "pressure_offset_pa", "Pa", -1e8, 1e8, "added by the pressure sensors";
    TemperatureOffset "temperature_offset_k", "K", -150.0, 150.0, "added by the temperature sensor";
}

/// Ticks from reading the sensors to the current in the coil, on either lift. With 2 ticks (free lift) or 1 (main lift)
/// the thesis's truck answers by half after its 160 ms (Fri & Fahlén 2017, section 4.5.2); this is later by 40 and 60 ms.
const DELAY_TICKS: f64 = 4.0;

/// Each condition where none is given.
pub const DEFAULTS: [f64; CONDITIONS.len()] =
    [0.0, 40.0, 0.98, 1.96, 1.0, DELAY_TICKS, PRESSURE_NOISE, TEMPERATURE_NOISE, 1.0, 0.0, 0.0];

/// Speeds asked for in turn: from a time [s] on, a lowering speed of the forks [m/s].
pub type Profile = Vec<(f64, f64)>;

/// What members have in common, and what varies.
#[derive(Debug, Clone)]
pub struct Makeup {
    pub truck: Truck,
    pub lifts: Lifts,
    pub conditions: [f64; CONDITIONS.len()],
    pub profile: Profile,
    /// The controller's numbers where none varies.
    pub controller: Vec<f64>,
    pub columns: Vec<Column>,
    pub distributions: Vec<Distribution>,
    pub seed: u64,
    values: Vec<f64>,
    limits: Limits,
}

/// A member, drawn.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// In the place of [`Truck::values`].
    pub values: Vec<f64>,
    pub conditions: [f64; CONDITIONS.len()],
    pub controller: Vec<f64>,
    /// The speed asked for [mm/s], tick by tick.
    pub request: Vec<i32>,
    pub stream: u64,
}

impl Makeup {
    #[allow(clippy::too_many_arguments)] // the parts of a sweep's specification
    pub fn new(
        truck: Truck,
        lifts: Lifts,
        conditions: [f64; CONDITIONS.len()],
        profile: Profile,
        controller: Vec<f64>,
        columns: Vec<(Column, Distribution)>,
        seed: u64,
    ) -> Result<Self, Error> {
        let finite = profile.iter().all(|(from_s, level)| from_s.is_finite() && level.is_finite());
        if profile.is_empty() || !finite || profile.windows(2).any(|pair| pair[1].0 <= pair[0].0) {
            return refuse("profile", format!("{profile:?}"), "one or more times that rise, each with a speed");
        }
        for (value, (_, name, unit, lower, upper, _)) in conditions.iter().zip(CONDITIONS) {
            if !(lower..=upper).contains(&value) {
                return refuse(&format!("conditions, {name}"), value, &format!("between {lower} and {upper} {unit}"));
            }
        }
        let (columns, distributions) = columns.into_iter().unzip();
        let (values, limits) = (truck.values(), truck.limits());
        Ok(Makeup { truck, lifts, conditions, profile, controller, columns, distributions, seed, values, limits })
    }

    /// The columns' values at uniform numbers.
    pub fn at(&self, uniform: &[f64]) -> Vec<f64> {
        self.distributions.iter().zip(uniform).map(|(distribution, &u)| distribution.quantile(u)).collect()
    }

    /// A member by the values of its columns; none where one of them is out of bounds.
    pub fn member(&self, columns: &[f64], stream: u64, ticks: usize, tick_s: f64) -> Option<Drawn> {
        let mut values = self.values.clone();
        let mut conditions = self.conditions;
        let mut controller = self.controller.clone();
        let mut profile = self.profile.clone();
        for (column, &value) in self.columns.iter().zip(columns) {
            match *column {
                Column::Parameter(k) => values[k] = value,
                Column::Controller(k) => controller[k] = value,
                Column::Condition(condition) => conditions[condition as usize] = value,
                Column::Level(k) => profile[k].1 = value,
            }
        }
        let fit = conditions
            .iter()
            .zip(CONDITIONS)
            .all(|(value, (_, _, _, lower, upper, _))| value >= lower && value <= upper);
        if !fit || !self.limits.hold(&values) || !within_bounds(&controller) {
            return None;
        }
        if let Lifts::One(lift) = self.lifts {
            if self.truck.joined_beyond(lift, &values).is_some() {
                return None;
            }
        }
        let factor = conditions[Condition::Reference as usize];
        let mut request = vec![0; ticks];
        for &(from_s, speed) in &profile {
            let from = ((from_s / tick_s).round().max(0.0) as usize).min(ticks);
            request[from..].fill((1e3 * factor * speed).round() as i32);
        }
        Some(Drawn { values, conditions, controller, request, stream })
    }

    /// How the valves are stepped in a substep of `h` [s], as numbers of a kind have it.
    pub fn valve_steps<S: Scalar>(&self, drawn: &Drawn, h: f64) -> ValveSteps {
        let value = |k: usize, _: f64| S::constant(drawn.values[k]);
        valve_steps(self.lifts, h, |lift| self.truck.lifts([lift], S::zero(), value))
    }
}

impl Drawn {
    pub fn condition(&self, condition: Condition) -> f64 {
        self.conditions[condition as usize]
    }

    /// Its sensors, with the encoders' zeros anywhere within a count.
    pub fn sensors(&self, seed: u64) -> Sensors {
        let mut random = Random::new(seed, draw::of_zeros(self.stream));
        let zeros = [0, 1].map(|_| ENCODER_COUNT * random.uniform());
        Sensors::noisy(
            self.condition(Condition::PressureNoise),
            self.condition(Condition::TemperatureNoise),
            zeros,
            seed,
            draw::of_sensors(self.stream),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_stand_in_the_order_of_their_numbers_and_their_defaults_are_within_bounds() {
        for (k, (condition, name, _, lower, upper, _)) in CONDITIONS.iter().enumerate() {
            assert_eq!(*condition as usize, k);
            assert!(DEFAULTS[k] >= *lower && DEFAULTS[k] <= *upper, "{name}");
        }
    }
}
