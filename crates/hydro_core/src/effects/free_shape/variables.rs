//! What a free shape may be a function of.

use crate::mast::LiftName;
use crate::outputs::{Quantity, OUTPUTS};

/// What a shape may be a function of.
#[derive(Debug, Clone, Copy)]
pub struct VariableSpec {
    pub name: &'static str,
    pub unit: &'static str,
    /// A range narrower than this counts as this wide.
    pub finest: f64,
    /// What of a lift it is, as outputs have it; of a speed, but for the sign.
    pub shown: Option<Quantity>,
    /// It is the other lift's.
    pub of_other: bool,
    pub meaning: &'static str,
}

impl VariableSpec {
    /// Which output shows the variable of an effect on `lift`, and how much of it one unit of the output is.
    pub fn output(&self, lift: LiftName) -> Option<(&'static str, f64)> {
        let shown = self.shown?;
        let lift = LiftName::BOTH[usize::from((lift == LiftName::Main) != self.of_other)];
        OUTPUTS.iter().find_map(|output| match output.of {
            &[(of, quantity, factor)] if of == lift && quantity == shown => Some((output.name, 1.0 / factor)),
            _ => None,
        })
    }
}

macro_rules! variables {
    ($($name:literal, $unit:literal, $finest:literal, $shown:expr, $of_other:literal, $meaning:literal;)*) => {
        /// The variables, in the order in which `variable` counts them.
        pub const VARIABLES: &[VariableSpec] = &[$(VariableSpec {
            name: $name,
            unit: $unit,
            finest: $finest,
            shown: $shown,
            of_other: $of_other,
            meaning: $meaning,
        },)*];
    };
}

use Quantity::{Position, Pressure, Velocity};

variables! {
    "position", "m", 0.02, Some(Position), false, "position of the cylinder";
    "velocity", "m/s", 0.02, Some(Velocity), false, "velocity of the cylinder, upward positive";
    "speed", "m/s", 0.02, Some(Velocity), false, "amount of the cylinder's velocity";
    "pressure", "Pa", 2e5, Some(Pressure), false, "pressure in the cylinder";
    "oil_temperature", "degC", 1.0, None, false, "oil temperature in the tank";
    "load", "kg", 10.0, None, false, "load on the forks";
    "command", "A", 0.02, None, false, "command of the proportional valve";
    "other_velocity", "m/s", 0.02, Some(Velocity), true, "velocity of the other lift's cylinder, upward positive";
    "time_at_rest", "s", 0.1, None, false, "time since the cylinder last moved by half a centimetre, at most 10 s";
    "time_since_command", "s", 0.1, None, false, "time since the command last moved by a hundredth of an ampere, at most 10 s";
    "other_command", "A", 0.02, None, true, "command of the other lift's proportional valve";
}

/// Where [`VARIABLES`] lists a variable; one that it lacks does not compile.
pub(super) const fn variable(name: &str) -> usize {
    let mut k = 0;
    while !crate::mast::same(VARIABLES[k].name.as_bytes(), name.as_bytes()) {
        k += 1;
    }
    k
}
