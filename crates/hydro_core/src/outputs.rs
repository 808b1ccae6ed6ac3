//! What a run shows and what a recording holds: the tables of both, and outputs from states.

use crate::effects::Instance;
use crate::mast::{LiftName, CYLINDER_PRESSURE, POSITION, STATES, VELOCITY};

/// What an output reads off a lift.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    Position,
    Velocity,
    Pressure,
}

/// Places among a lift's states, in the order of [`Quantity`].
pub const LIFT_QUANTITIES: [usize; 3] = [POSITION, VELOCITY, CYLINDER_PRESSURE];

/// An output of the model: a sum over lifts of a quantity times a factor.
#[derive(Debug, Clone, Copy)]
pub struct OutputSpec {
    pub name: &'static str,
    pub unit: &'static str,
    pub meaning: &'static str,
    pub of: &'static [(LiftName, Quantity, f64)],
}

macro_rules! outputs {
    ($($name:literal, $unit:literal, $of:expr, $meaning:literal;)*) => {
        /// The model's outputs, as a perfect sensor would read them.
        pub const OUTPUTS: &[OutputSpec] = &[
            $(OutputSpec { name: $name, unit: $unit, meaning: $meaning, of: $of },)*
        ];
    };
}

use LiftName::{Free, Main};
use Quantity::{Position, Pressure, Velocity};

outputs! {
    "position_free_m", "m", &[(Free, Position, 2.0)], "forks relative to the second stage, twice the free lift's cylinder";
    "position_main_m", "m", &[(Main, Position, 1.0)], "first stage relative to the base, the main lift's cylinder";
    "velocity_free_m_s", "m/s", &[(Free, Velocity, 2.0)], "time derivative of position_free_m, upward positive";
    "velocity_main_m_s", "m/s", &[(Main, Velocity, 1.0)], "time derivative of position_main_m, upward positive";
    "pressure_free_pa", "Pa", &[(Free, Pressure, 1.0)], "cylinder pressure p_A of the free lift";
    "pressure_main_pa", "Pa", &[(Main, Pressure, 1.0)], "cylinder pressure p_A of the main lift";
    "fork_height_m", "m", &[(Main, Position, 2.0), (Free, Position, 2.0)], "forks over the ground, 2 x_ML + x_FL";
}

/// Where the outputs stand in the state vector of some lifts and effects.
#[derive(Debug, Clone)]
pub struct Readings {
    /// For each of [`OUTPUTS`] the states it sums and their factors; no state where a lift is not simulated.
    terms: Vec<Vec<(Option<usize>, f64)>>,
}

impl Readings {
    /// `effects`: those of the truck; what sits on a lift that is not simulated counts for nothing.
    pub fn new(which: &[LiftName], effects: impl Iterator<Item = Instance>) -> Readings {
        let read = |&(lift, quantity, factor): &(LiftName, Quantity, f64)| {
            let place = which.iter().position(|&w| w == lift);
            (place.map(|k| k * STATES + LIFT_QUANTITIES[quantity as usize]), factor)
        };
        let mut terms: Vec<Vec<_>> = OUTPUTS.iter().map(|output| output.of.iter().map(read).collect()).collect();
        let mut own = which.len() * STATES;
        for effect in effects.filter(|effect| effect.lift.is_none_or(|lift| which.contains(&lift))) {
            let spec = effect.kind.spec();
            for &(state, output, factor) in spec.shows {
                let k = OUTPUTS.iter().position(|o| o.name == output).expect("effects show in outputs of the table");
                terms[k].push((Some(own + state), factor));
            }
            own += spec.states.len();
        }
        Readings { terms }
    }

    /// The outputs, in the order of [`OUTPUTS`]; what belongs to a lift that is not simulated is not a number.
    pub fn read(&self, x: &[f64]) -> Vec<f64> {
        let value = |&(place, factor): &(Option<usize>, f64)| place.map_or(f64::NAN, |k| factor * x[k]);
        self.terms.iter().map(|terms| terms.iter().map(value).sum()).collect()
    }

    /// The states that output `k` sums, as far as they are simulated, and their factors.
    pub fn of(&self, k: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.terms[k].iter().filter_map(|&(place, factor)| place.map(|place| (place, factor)))
    }
}

/// A column of a recording, with the range its values lie in and the range its largest value
/// lies in on a working truck: together they tell a wrong unit.
#[derive(Debug, Clone, Copy)]
pub struct ChannelSpec {
    pub name: &'static str,
    pub unit: &'static str,
    pub meaning: &'static str,
    pub lower: f64,
    pub upper: f64,
    /// The largest absolute value of a recording lies in this range, where there is one.
    pub typical: Option<(f64, f64)>,
}

macro_rules! channels {
    ($($name:literal, $unit:literal, $lower:expr, $upper:expr, $typical:expr, $meaning:literal;)*) => {
        /// The columns a recording may have; the first three it must have.
        pub const CHANNELS: &[ChannelSpec] = &[
            $(ChannelSpec { name: $name, unit: $unit, lower: $lower, upper: $upper, typical: $typical, meaning: $meaning },)*
        ];
    };
}

channels! {
    "time_s", "s", -1e9, 1e10, None, "seconds from the start";
    "current_free_a", "A", -0.05, 2.5, None, "commanded current of the free lift's valve, after the low-pass, before dither";
    "current_main_a", "A", -0.05, 2.5, None, "commanded current of the main lift's valve, after the low-pass, before dither";
    "position_free_m", "m", -0.5, 20.0, None, "forks relative to the second stage, by the encoder";
    "position_main_m", "m", -0.5, 20.0, None, "first stage relative to the base, by the encoder";
    "pressure_free_pa", "Pa", -1e6, 1e8, Some((2e4, 1e8)), "cylinder pressure of the free lift";
    "pressure_main_pa", "Pa", -1e6, 1e8, Some((2e4, 1e8)), "cylinder pressure of the main lift";
    "oil_temperature_degc", "degC", -40.0, 130.0, None, "oil temperature in the tank";
    "fork_height_m", "m", -0.5, 40.0, None, "forks over the ground, by an external sensor";
}
