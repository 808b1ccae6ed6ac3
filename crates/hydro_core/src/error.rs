//! Errors with facts: what, where, value, bound, and what to do.

use thiserror::Error;

/// Why a call was refused or a run ended early. Every variant has a stable [`Error::code`].
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Error {
    #[error("parameter {name} is unknown; did you mean {nearest}?")]
    UnknownParameter { name: String, nearest: String },
    #[error("parameter {name} is missing; give it a value in {unit} between {lower} and {upper}")]
    MissingParameter { name: String, unit: String, lower: f64, upper: f64 },
    #[error("parameter {name} is {value} {unit}, outside its bounds [{lower}, {upper}] ({reason}); correct the value or its unit")]
    OutOfBounds { name: String, value: f64, lower: f64, upper: f64, unit: String, reason: String },
    #[error("table {name} has {length} knots; give from 2 to {most}, as many as its partner has")]
    TableLength { name: String, length: usize, most: usize },
    #[error("table {name} must rise from knot to knot, a current by a microampere or more, but knot {knot} is {value} {unit} after {previous}; sort or correct the table")]
    TableNotRising { name: String, knot: usize, value: f64, previous: f64, unit: String },
    #[error("effect {effect} joins both lifts, but only one is simulated; simulate both, or leave the effect out")]
    EffectNeedsBothLifts { effect: String },
    #[error("argument {name} is {value}; it must be {requirement}")]
    Argument { name: String, value: String, requirement: String },
    #[error("argument {name} has shape {got}, but {expected} was expected; pass arrays of matching length")]
    Shape { name: String, got: String, expected: String },
    #[error("the step size fell to {step_s:.3e} s at t = {time_s} s, where {worst_state} resists; loosen the tolerance ({tolerance:e}) or check the parameters of that part")]
    StepTooSmall { time_s: f64, step_s: f64, worst_state: String, tolerance: f64 },
    #[error("the run took more than {limit} steps up to t = {time_s} s; loosen the tolerance ({tolerance:e}) or shorten the run")]
    TooManySteps { time_s: f64, limit: usize, tolerance: f64 },
    #[error("{worst_state} ceased to be finite at t = {time_s} s; use more substeps or the adaptive solver, or check the parameters of that part")]
    NotFinite { time_s: f64, worst_state: String },
    #[error("the {lift} lift has no steady lowering near the thesis's at {current_a} A (point {point}), where {worst_state} does not settle; check the parameters of the effects that act on it")]
    NoSteadyState { lift: String, point: usize, current_a: f64, worst_state: String },
    #[error("interrupted at t = {time_s} s")]
    Interrupted { time_s: f64 },
}

/// One fact of an error, for a caller that reads data instead of sentences.
#[derive(Debug, Clone, PartialEq)]
pub enum Fact {
    Text(String),
    Number(f64),
    Count(usize),
}

/// The argument `name` has a `value` that it cannot have; `requirement` goes on after "it must be".
///
/// # Errors
/// Always: [`Error::Argument`].
pub fn refuse<T>(name: &str, value: impl ToString, requirement: &str) -> Result<T, Error> {
    Err(Error::argument(name, value, requirement))
}

impl Error {
    /// See [`refuse`].
    pub fn argument(name: &str, value: impl ToString, requirement: &str) -> Self {
        Error::Argument { name: name.into(), value: value.to_string(), requirement: requirement.into() }
    }

    /// A stable word for the kind of error.
    pub fn code(&self) -> &'static str {
        match self {
            Error::UnknownParameter { .. } => "parameter-unknown",
            Error::MissingParameter { .. } => "parameter-missing",
            Error::OutOfBounds { .. } => "parameter-out-of-bounds",
            Error::TableLength { .. } => "table-length",
            Error::TableNotRising { .. } => "table-not-rising",
            Error::EffectNeedsBothLifts { .. } => "effect-needs-both-lifts",
            Error::Argument { .. } => "argument-invalid",
            Error::Shape { .. } => "argument-shape",
            Error::StepTooSmall { .. } => "step-too-small",
            Error::TooManySteps { .. } => "too-many-steps",
            Error::NotFinite { .. } => "not-finite",
            Error::NoSteadyState { .. } => "no-steady-state",
            Error::Interrupted { .. } => "interrupted",
        }
    }

    /// The facts by name, in the order of the sentence.
    pub fn facts(&self) -> Vec<(&'static str, Fact)> {
        use Fact::{Count, Number, Text};
        let text = |s: &String| Text(s.clone());
        match self {
            Error::UnknownParameter { name, nearest } => vec![("name", text(name)), ("nearest", text(nearest))],
            Error::MissingParameter { name, unit, lower, upper } => {
                vec![("name", text(name)), ("unit", text(unit)), ("lower", Number(*lower)), ("upper", Number(*upper))]
            }
            Error::OutOfBounds { name, value, lower, upper, unit, reason } => vec![
                ("name", text(name)),
                ("value", Number(*value)),
                ("lower", Number(*lower)),
                ("upper", Number(*upper)),
                ("unit", text(unit)),
                ("reason", text(reason)),
            ],
            Error::TableLength { name, length, most } => {
                vec![("name", text(name)), ("value", Count(*length)), ("upper", Count(*most))]
            }
            Error::TableNotRising { name, knot, value, previous, unit } => vec![
                ("name", text(name)),
                ("knot", Count(*knot)),
                ("value", Number(*value)),
                ("lower", Number(*previous)),
                ("unit", text(unit)),
            ],
            Error::EffectNeedsBothLifts { effect } => vec![("name", text(effect))],
            Error::Argument { name, value, requirement } => {
                vec![("name", text(name)), ("value", text(value)), ("requirement", text(requirement))]
            }
            Error::Shape { name, got, expected } => {
                vec![("name", text(name)), ("value", text(got)), ("expected", text(expected))]
            }
            Error::StepTooSmall { time_s, step_s, worst_state, tolerance } => vec![
                ("time_s", Number(*time_s)),
                ("step_s", Number(*step_s)),
                ("worst_state", text(worst_state)),
                ("tolerance", Number(*tolerance)),
            ],
            Error::TooManySteps { time_s, limit, tolerance } => {
                vec![("time_s", Number(*time_s)), ("limit", Count(*limit)), ("tolerance", Number(*tolerance))]
            }
            Error::NotFinite { time_s, worst_state } => {
                vec![("time_s", Number(*time_s)), ("worst_state", text(worst_state))]
            }
            Error::NoSteadyState { lift, point, current_a, worst_state } => vec![
                ("lift", text(lift)),
                ("row", Count(*point)),
                ("value", Number(*current_a)),
                ("worst_state", text(worst_state)),
            ],
            Error::Interrupted { time_s } => vec![("time_s", Number(*time_s))],
        }
    }
}
