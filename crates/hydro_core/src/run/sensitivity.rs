//! Outputs of a run and their exact derivatives along parameters and the run's own unknowns.
//!
//! The fixed-step path over dual numbers. The derivatives are those of its equations, solved exactly;
//! the numbers carry what Newton's iteration leaves, less than a micrometre a second. That little
//! depends on the parameters too, and shows in difference quotients of what hardly matters.
//! Lifts that no effect joins are run one by one, each along its own parameters only.

use rayon::prelude::*;

use super::ticks::{held, Ticks, Warmer};
use super::{check, commanded_names, Inputs, Interrupt, Solver};
use crate::dual::Dual;
use crate::error::Error;
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis, UnknownInput, STATES};
use crate::outputs::{Readings, OUTPUTS};
use crate::scalar::Scalar;
use crate::solver::vectors::widest;
use crate::truck::{Owner, Truck};

/// What a derivative is taken along.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Direction {
    /// The k-th of [`Truck::values`].
    Parameter(usize),
    /// The load [kg].
    Load,
    /// An offset of the oil temperature [K].
    OilTemperature,
    /// How much more the oil warms up during the run than recorded [K].
    OilWarming,
    /// The cylinder position [m] at which a lift starts.
    Start(LiftName),
    /// An unknown input.
    Input(Input),
}

/// A hat over time at a port of a lift, quiet but for its derivative: highest at `centre` [s], none from
/// `width` [s] on. In the port's unit; of a factor, its share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input {
    pub lift: LiftName,
    /// Its place in [`crate::ports::PORTS`].
    pub port: usize,
    pub centre: f64,
    pub width: f64,
}

/// One recording to be simulated.
#[derive(Debug, Clone, Copy)]
pub struct Case<'a> {
    pub inputs: Inputs<'a>,
    /// Times at which the outputs are wanted [s].
    pub wanted: &'a [f64],
    /// Added to the oil temperature [K].
    pub warmer: f64,
    /// How much more the oil warms up during the run than recorded [K]: evenly, none in the middle.
    pub warming: f64,
    /// Cylinder positions at the start, free and main [m].
    pub start: [f64; 2],
}

/// Outputs and derivatives, row by row.
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// (times, outputs).
    pub outputs: Vec<f64>,
    /// (times, outputs, directions).
    pub derivatives: Vec<f64>,
}

/// Directions carried at once: wide enough for the vectors, small enough for the cache.
const WIDE: usize = 16;
const NARROW: usize = 8;

/// Simulates `case` and differentiates it along `directions`.
///
/// # Errors
/// As [`super::simulate`].
pub fn differentiate(
    truck: &Truck,
    case: &Case,
    substeps: usize,
    directions: &[Direction],
    interrupt: Interrupt,
) -> Result<Sensitivity, Error> {
    check(&case.inputs, case.wanted, Solver::Fixed { substeps })?;
    let (rows, columns) = (case.wanted.len(), directions.len());
    let mut sum = Sensitivity {
        outputs: vec![0.0; rows * OUTPUTS.len()],
        derivatives: vec![0.0; rows * OUTPUTS.len() * columns],
    };
    let task = Task { truck, case, substeps, directions, interrupt };
    if truck.joined() {
        task.lifts(LiftName::BOTH, &mut sum)?;
    } else {
        for lift in LiftName::BOTH {
            task.lifts([lift], &mut sum)?;
        }
    }
    Ok(sum)
}

/// [`differentiate`] for each case, on all cores; the results do not depend on their number.
///
/// # Errors
/// The first error in the order of the cases, with its place.
pub fn differentiate_all(
    truck: &Truck,
    cases: &[Case],
    substeps: usize,
    directions: &[Direction],
    interrupt: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Sensitivity>, (usize, Error)> {
    let runs: Vec<_> =
        cases.par_iter().map(|case| differentiate(truck, case, substeps, directions, &|| interrupt())).collect();
    runs.into_iter().enumerate().map(|(k, run)| run.map_err(|error| (k, error))).collect()
}

struct Task<'a> {
    truck: &'a Truck,
    case: &'a Case<'a>,
    substeps: usize,
    directions: &'a [Direction],
    interrupt: Interrupt<'a>,
}

impl Task<'_> {
    /// Adds the share of the lifts `which` to outputs and derivatives.
    fn lifts<const L: usize>(&self, which: [LiftName; L], sum: &mut Sensitivity) -> Result<(), Error> {
        let owners = self.truck.owners();
        let concerns = |direction: &Direction| match direction {
            Direction::Parameter(k) => match owners[*k] {
                Owner::Lift(lift) => which.contains(&lift),
                Owner::Mast => L == 2,
            },
            Direction::Load | Direction::OilTemperature | Direction::OilWarming => true,
            Direction::Start(lift) | Direction::Input(Input { lift, .. }) => which.contains(lift),
        };
        let along: Vec<usize> = (0..self.directions.len()).filter(|&d| concerns(&self.directions[d])).collect();
        let mut rest = along.as_slice();
        let mut first = true;
        while first || !rest.is_empty() {
            let taken = rest.len().min(if rest.len() > NARROW { WIDE } else { NARROW });
            let (part, others) = rest.split_at(taken);
            match taken {
                0 => self.part::<0, L>(which, part, first, sum)?,
                1..=NARROW => self.part::<NARROW, L>(which, part, first, sum)?,
                _ => self.part::<WIDE, L>(which, part, first, sum)?,
            }
            (rest, first) = (others, false);
        }
        Ok(())
    }

    /// One run along the directions `part`; `values` says whether it also adds the outputs.
    fn part<const P: usize, const L: usize>(
        &self,
        which: [LiftName; L],
        part: &[usize],
        values: bool,
        sum: &mut Sensitivity,
    ) -> Result<(), Error> {
        let number = |direction: Direction, value: f64| -> Dual<f64, P> {
            match part.iter().position(|&d| self.directions[d] == direction) {
                Some(p) => Dual::variable(value, p),
                None => Dual::constant(value),
            }
        };
        let load = number(Direction::Load, self.case.inputs.load_kg);
        let (lifts, effects) = self.truck.build(which, load, |k, v| number(Direction::Parameter(k), v))?;
        let inputs: Vec<UnknownInput<Dual<f64, P>>> = part
            .iter()
            .enumerate()
            .filter_map(|(p, &d)| match self.directions[d] {
                Direction::Input(input) => Some(UnknownInput {
                    place: which.iter().position(|&lift| lift == input.lift)?,
                    port: input.port,
                    height: Dual::variable(0.0, p),
                    centre: input.centre,
                    width: input.width,
                }),
                _ => None,
            })
            .collect();
        if effects.is_empty() && inputs.is_empty() {
            self.run(which, lifts, Thesis, number, part, values, sum)
        } else {
            let physics = Extended::new(&effects, &lifts).with_inputs(inputs);
            self.run(which, lifts, physics, number, part, values, sum)
        }
    }

    #[allow(clippy::too_many_arguments)] // one run's parts, passed on once
    fn run<X: Physics<Dual<f64, P>>, const P: usize, const L: usize>(
        &self,
        which: [LiftName; L],
        lifts: [Lift<Dual<f64, P>>; L],
        physics: X,
        number: impl Fn(Direction, f64) -> Dual<f64, P>,
        part: &[usize],
        values: bool,
        sum: &mut Sensitivity,
    ) -> Result<(), Error> {
        let zero = Dual::zero();
        let mut start = vec![zero; L * STATES + physics.states()];
        for (k, &lift) in which.iter().enumerate() {
            let stop = lifts[k].stop;
            let x = number(Direction::Start(lift), self.case.start[usize::from(lift == LiftName::Main)]);
            lifts[k].at_rest(x.clamp_to(stop.lower, stop.upper)).write(&mut start[k * STATES..(k + 1) * STATES]);
        }
        let warmer = Warmer {
            by: number(Direction::OilTemperature, self.case.warmer),
            warming: number(Direction::OilWarming, self.case.warming),
        };
        let mut mast = Mast { lifts, physics, command: [zero; L], oil_temperature_degc: zero };
        let (command, temperature) = held(&which, &self.case.inputs, warmer, 0);
        mast.set_inputs(command, temperature);
        mast.start_effects(&mut start);
        let columns = self.directions.len();
        let Sensitivity { outputs, derivatives } = sum;
        let readings = Readings::new(&which, self.truck.effects());
        let record = |row: usize, x: &[Dual<f64, P>]| {
            for j in 0..OUTPUTS.len() {
                let at = row * OUTPUTS.len() + j;
                for (place, factor) in readings.of(j) {
                    let value = x[place];
                    if values {
                        outputs[at] += factor * value.re;
                    }
                    for (p, &d) in part.iter().enumerate() {
                        derivatives[at * columns + d] += factor * value.eps[p];
                    }
                }
            }
        };
        let ticks = Ticks {
            mast,
            which: &which,
            inputs: &self.case.inputs,
            warmer,
            start: &start,
            wanted: self.case.wanted,
            substeps: self.substeps,
            record,
            interrupt: self.interrupt,
        };
        widest(ticks).map(|_| ()).map_err(|stopped| stopped.error(&commanded_names(&which, start.len())))
    }
}
