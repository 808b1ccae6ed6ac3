//! What a run shows and what a recording holds: the tables of both, and outputs from states.

use crate::mast::{LiftName, LiftState, STATES};

/// An output of the model.
#[derive(Debug, Clone, Copy)]
pub struct OutputSpec {
    pub name: &'static str,
    pub unit: &'static str,
    pub meaning: &'static str,
}

/// The model's outputs, as a perfect sensor would read them.
pub const OUTPUTS: &[OutputSpec] = &[
    OutputSpec {
        name: "position_free_m",
        unit: "m",
        meaning: "forks relative to the second stage, twice the free lift's cylinder",
    },
    OutputSpec {
        name: "position_main_m",
        unit: "m",
        meaning: "first stage relative to the base, the main lift's cylinder",
    },
    OutputSpec {
        name: "velocity_free_m_s",
        unit: "m/s",
        meaning: "time derivative of position_free_m, upward positive",
    },
    OutputSpec {
        name: "velocity_main_m_s",
        unit: "m/s",
        meaning: "time derivative of position_main_m, upward positive",
    },
    OutputSpec { name: "pressure_free_pa", unit: "Pa", meaning: "cylinder pressure p_A of the free lift" },
    OutputSpec { name: "pressure_main_pa", unit: "Pa", meaning: "cylinder pressure p_A of the main lift" },
    OutputSpec { name: "fork_height_m", unit: "m", meaning: "forks over the ground, 2 x_ML + x_FL" },
];

/// The outputs, in the order of [`OUTPUTS`], of a state vector that starts with the lifts `which`;
/// what belongs to a lift that is not simulated is not a number.
pub fn outputs(which: &[LiftName], x: &[f64]) -> [f64; 7] {
    let lift = |name: LiftName| {
        which.iter().position(|&w| w == name).map(|k| LiftState::from_slice(&x[k * STATES..(k + 1) * STATES]))
    };
    let (free, main) = (lift(LiftName::Free), lift(LiftName::Main));
    let of = |s: &Option<LiftState<f64>>, f: fn(&LiftState<f64>) -> f64| s.as_ref().map_or(f64::NAN, f);
    let (x_fl, x_ml) = (of(&free, |s| 2.0 * s.x), of(&main, |s| s.x));
    [
        x_fl,
        x_ml,
        of(&free, |s| 2.0 * s.v),
        of(&main, |s| s.v),
        of(&free, |s| s.p_a),
        of(&main, |s| s.p_a),
        2.0 * x_ml + x_fl,
    ]
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
