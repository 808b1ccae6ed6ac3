//! A run: a truck under recorded or generated inputs, read at given times.

mod adaptive;
pub mod added;
pub(crate) mod blocks;
pub mod closed_loop;
mod controllers;
mod differentiable;
pub mod drive;
mod late;
pub mod lowering;
pub mod responses;
pub mod sensing;
pub mod sensitivity;
mod side_by_side;
pub mod ticks;
pub mod variants;

use crate::effects::StateSpec;
use crate::error::{refuse, Error};
use crate::mast::{resting, Extended, Lift, LiftName, Mast, Physics, Thesis, LIFT_STATES, STATES};
use crate::scalar::Scalar;
use crate::solver::statistics::Statistics;
use crate::solver::vectors::widest;
use crate::truck::Truck;
pub use differentiable::jacobian_by_duals;
use differentiable::{Columns, Differentiable};
use drive::Replay;
use late::Late;
use ticks::{Oil, Ticks, Warmer};

/// Inputs of a run, each held from its time until the next.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Strictly increasing [s].
    pub time: &'a [f64],
    /// Free and main command [A] at each time.
    pub command: &'a [[f64; 2]],
    /// Oil temperature [°C] at each time.
    pub oil_temperature_degc: &'a [f64],
    pub load_kg: f64,
}

/// Which integrator, and how finely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solver {
    /// [`crate::solver::radau::Radau`] with this tolerance.
    Adaptive { tolerance: f64 },
    /// [`crate::solver::fixed::Fixed`] with this many substeps per tick of the command.
    Fixed { substeps: usize },
}

impl Solver {
    pub const DEFAULT_TOLERANCE: f64 = 1e-4;
    pub const DEFAULT_SUBSTEPS: usize = 8;
}

/// Which lifts are simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lifts {
    Both,
    One(LiftName),
}

/// States at the wanted times, row by row, and the work they took.
#[derive(Debug, Clone)]
pub struct Run {
    pub state_names: Vec<String>,
    /// (times, states), row-major.
    pub states: Vec<f64>,
    pub statistics: Statistics,
}

/// Asked now and then; true stops the run with [`Error::Interrupted`].
pub type Interrupt<'a> = &'a dyn Fn() -> bool;

/// Simulates `truck` and gives its states at the times `wanted`.
///
/// The state vector is that of [`Mast`]: lift after lift as in [`LIFT_STATES`], then the effects'.
/// `start` replaces the usual start (at rest, [`LiftName::start_position`]).
///
/// # Errors
/// Arguments that do not fit, or a run that the integrator has to give up.
pub fn simulate(
    truck: &Truck,
    lifts: Lifts,
    inputs: &Inputs,
    wanted: &[f64],
    solver: Solver,
    start: Option<&[f64]>,
    interrupt: Interrupt,
) -> Result<Run, Error> {
    check(inputs, wanted, solver)?;
    match lifts {
        Lifts::Both => with_lifts(truck, LiftName::BOTH, inputs, wanted, solver, start, interrupt),
        Lifts::One(lift) => with_lifts(truck, [lift], inputs, wanted, solver, start, interrupt),
    }
}

fn with_lifts<const L: usize>(
    truck: &Truck,
    which: [LiftName; L],
    inputs: &Inputs,
    wanted: &[f64],
    solver: Solver,
    start: Option<&[f64]>,
    interrupt: Interrupt,
) -> Result<Run, Error> {
    let (lifts, effects) = truck.build(which, inputs.load_kg, |_, v| v)?;
    macro_rules! mast {
        ($lifts:expr, $physics:expr) => {
            Mast {
                lifts: $lifts,
                physics: $physics,
                command: [Scalar::zero(); L],
                oil_temperature_degc: Scalar::zero(),
            }
        };
    }
    let own: Vec<_> = effects.iter().map(|(i, ..)| (i.name(), i.kind.spec().states)).collect();
    let names = state_names(&which, &own);
    let given = start.is_some();
    let mut start = start_state(&lifts, &which, &names, start)?;
    if !given && !effects.is_empty() {
        let mut mast = mast!(lifts.clone(), Extended::new(&effects, &lifts));
        mast.set_inputs(commands_of(&which, inputs.command[0]), Warmer::none().at(&inputs.into(), 0));
        mast.start_effects(&mut start);
    }
    match solver {
        Solver::Adaptive { tolerance } => {
            let (dual_lifts, dual_effects) =
                truck.build(which, Columns::constant(inputs.load_kg), |_, v| Columns::constant(v))?;
            // The states of an effect at its quiet value would have a say in the steps.
            let loud = effects.iter().map(|(i, _, values)| {
                let quiet = i.kind.spec().quiet;
                values[..i.kind.amplitudes()].iter().any(|&value| value != quiet)
            });
            let loud: Vec<bool> = loud.collect();
            let kept = kept_states::<L>(&loud, &own);
            let scale = scales::<L>(effects.iter().flat_map(|(i, ..)| i.kind.spec().states));
            let of = |all: &[f64]| kept.iter().map(|&k| all[k]).collect::<Vec<_>>();
            let (scale, from) = (of(&scale), of(&start));
            let names_kept = kept.iter().map(|&k| names[k].clone()).collect();
            macro_rules! run {
                ($plain:expr, $dual:expr) => {{
                    let (plain, dual) = ($plain, $dual);
                    let late = plain.delays::<L>().map(|delays| {
                        let of = |lift| which.iter().position(|&one| one == lift).map_or(0.0, |k| delays[k]);
                        Late::new(inputs, LiftName::BOTH.map(of))
                    });
                    let late = late.as_ref().map(Late::inputs);
                    let inputs = late.as_ref().unwrap_or(inputs);
                    let (plain, dual) = (mast!(lifts, plain), mast!(dual_lifts, dual));
                    let mut mast = Differentiable::new(plain, dual, scale, names_kept);
                    adaptive::run(&mut mast, &which, inputs, wanted, tolerance, &from, interrupt)?
                }};
            }
            let run = if loud.contains(&true) {
                let (effects, dual_effects) = (only(effects, &loud), only(dual_effects, &loud));
                run!(Extended::new(&effects, &lifts), Extended::new(&dual_effects, &dual_lifts))
            } else {
                run!(Thesis, Thesis)
            };
            let mut states = start.repeat(wanted.len());
            for (row, moved) in states.chunks_exact_mut(start.len()).zip(run.states.chunks_exact(from.len())) {
                for (&k, &x) in kept.iter().zip(moved) {
                    row[k] = x;
                }
            }
            Ok(Run { state_names: names, states, ..run })
        }
        Solver::Fixed { substeps } => {
            let mut states = Vec::with_capacity(wanted.len() * start.len());
            macro_rules! run {
                ($physics:expr) => {{
                    let physics = $physics;
                    let ticks = Ticks {
                        mast: mast!(lifts, physics),
                        drive: &mut Replay::new(which, inputs),
                        clock: inputs.into(),
                        oil: Oil::Warmer(Warmer::none()),
                        start: &start,
                        wanted,
                        substeps,
                        record: &mut |_, x: &[f64]| states.extend_from_slice(x),
                        carry_on: false,
                        interrupt,
                    };
                    widest(ticks).map_err(|stopped| stopped.error(&names))?
                }};
            }
            let statistics = if effects.is_empty() { run!(Thesis) } else { run!(Extended::new(&effects, &lifts)) };
            Ok(Run { state_names: names, states, statistics })
        }
    }
}

/// Those of `all` that are `wanted`.
fn only<T>(all: Vec<T>, wanted: &[bool]) -> Vec<T> {
    all.into_iter().zip(wanted).filter_map(|(one, &wanted)| wanted.then_some(one)).collect()
}

/// Places of the lifts' states and of those of loud effects.
fn kept_states<const L: usize>(loud: &[bool], own: &[(String, &[StateSpec])]) -> Vec<usize> {
    let own = own.iter().zip(loud).flat_map(|((_, states), &loud)| states.iter().map(move |_| loud));
    let all = std::iter::repeat_n(true, L * STATES).chain(own);
    all.enumerate().filter_map(|(k, kept)| kept.then_some(k)).collect()
}

fn check(inputs: &Inputs, wanted: &[f64], solver: Solver) -> Result<(), Error> {
    let n = inputs.time.len();
    let shape = |name: &str, got: usize| Error::Shape {
        name: name.into(),
        got: got.to_string(),
        expected: format!("{n}, one per command time"),
    };
    if n == 0 {
        return refuse("command_time", "empty", "at least one time");
    }
    if inputs.command.len() != n {
        return Err(shape("command", inputs.command.len()));
    }
    if inputs.oil_temperature_degc.len() != n {
        return Err(shape("oil_temperature", inputs.oil_temperature_degc.len()));
    }
    increasing("command_time", inputs.time)?;
    increasing("time", wanted)?;
    if let Some(&first) = wanted.first().filter(|&&first| first < inputs.time[0]) {
        return refuse("time", first, &format!("at or after the first command time, {} s", inputs.time[0]));
    }
    if let Some(&value) = inputs.command.iter().flatten().find(|u| !(-0.1..=5.0).contains(*u)) {
        return refuse("command", value, "a current between -0.1 and 5 A");
    }
    if let Some(&value) = inputs.oil_temperature_degc.iter().find(|t| !(-50.0..=150.0).contains(*t)) {
        return refuse("oil_temperature", value, "between -50 and 150 degC");
    }
    if !(0.0..=2e4).contains(&inputs.load_kg) {
        return refuse("load", inputs.load_kg, "between 0 and 20000 kg");
    }
    match solver {
        Solver::Adaptive { tolerance } if !(1e-12..=1e-1).contains(&tolerance) => {
            refuse("tolerance", tolerance, "between 1e-12 and 0.1")
        }
        Solver::Fixed { substeps } if !(1..=1000).contains(&substeps) => {
            refuse("substeps", substeps, "between 1 and 1000")
        }
        _ => Ok(()),
    }
}

fn increasing(name: &str, time: &[f64]) -> Result<(), Error> {
    let requirement = "finite and strictly increasing";
    if let Some(&value) = time.iter().find(|t| !t.is_finite()) {
        return refuse(name, value, requirement);
    }
    match time.windows(2).find(|pair| pair[1] <= pair[0]) {
        Some(pair) => refuse(name, pair[1], requirement),
        None => Ok(()),
    }
}

fn state_names(which: &[LiftName], effects: &[(String, &[StateSpec])]) -> Vec<String> {
    let lifts = which.iter().flat_map(|lift| LIFT_STATES.iter().map(move |s| format!("{}.{}", lift.as_str(), s.name)));
    let own = effects.iter().flat_map(|(name, states)| states.iter().map(move |s| format!("{name}.{}", s.name)));
    lifts.chain(own).collect()
}

/// What an error calls the states of a run whose effects' states have no names at hand.
fn commanded_names(which: &[LiftName], dim: usize) -> Vec<String> {
    let mut names = state_names(which, &[]);
    names.extend((names.len()..dim).map(|k| format!("effect state {k}")));
    names
}

fn scales<const L: usize>(own: impl Iterator<Item = &'static StateSpec>) -> Vec<f64> {
    (0..L).flat_map(|_| LIFT_STATES.iter()).chain(own).map(|s| s.scale).collect()
}

fn start_state<const L: usize>(
    lifts: &[Lift<f64>; L],
    which: &[LiftName; L],
    names: &[String],
    start: Option<&[f64]>,
) -> Result<Vec<f64>, Error> {
    if let Some(start) = start {
        if start.len() != names.len() {
            return Err(Error::Shape {
                name: "start".into(),
                got: start.len().to_string(),
                expected: format!("{}, one per state", names.len()),
            });
        }
        return match start.iter().position(|x| !x.is_finite()) {
            None => Ok(start.to_vec()),
            Some(k) => refuse(&format!("start, {}", names[k]), start[k], "finite"),
        };
    }
    Ok(resting(lifts, which.map(LiftName::start_position), names.len()))
}

fn commands_of<const L: usize>(which: &[LiftName; L], both: [f64; 2]) -> [f64; L] {
    which.map(|lift| both[usize::from(lift == LiftName::Main)])
}
