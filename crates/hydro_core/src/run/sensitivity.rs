//! Outputs of a run and their exact derivatives along parameters and the run's own unknowns.
//!
//! The fixed-step path over dual numbers. The derivatives are those of its equations, solved exactly;
//! the numbers carry what Newton's iteration leaves, less than a micrometre a second. That little
//! depends on the parameters too, and shows in difference quotients of what hardly matters.
//! Derivatives are kept in single precision, which leaves them off by some ten-thousandths ([`crate::slopes`]).
//! Lifts that no effect joins run by themselves, each along its own parameters only.

use rayon::prelude::*;

use super::drive::{Drive, Replay};
use super::ticks::{Oil, Ticks, Warmer};
use super::{check, commanded_names, commands_of, side_by_side, Inputs, Lifts, Solver};
use crate::dual::Dual;
use crate::error::Error;
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis, UnknownInput};
use crate::outputs::{Readings, OUTPUTS};
use crate::scalar::Scalar;
use crate::slopes::Slopes;
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
    /// A multiple of the case's `command_slope`, added to the commands.
    Command,
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
    /// How much more the oil warms up during the run than recorded [K], evenly: all of it is there at the end.
    pub warming: f64,
    /// Cylinder positions at the start, free and main [m].
    pub start: [f64; 2],
    /// What [`Direction::Command`] adds to each command, per one; empty: nothing.
    pub command_slope: &'a [[f64; 2]],
}

/// Outputs and derivatives, row by row.
#[derive(Debug, Clone)]
pub struct Sensitivity {
    /// (times, outputs).
    pub outputs: Vec<f64>,
    /// (times, outputs, directions).
    pub derivatives: Vec<f64>,
}

/// Directions carried at once. A lift has 36, with its start, what both lifts share and what each recording has of its
/// own: they and a few more fit into one run, which else would work out the values twice.
const WIDE: usize = 40;
/// Fewer where few are left: of a lift that stands still its start and what both lifts share, or one curve.
const NARROW: usize = 16;
/// One register of AVX2.
const FEW: usize = 8;
/// What holds [`WIDE`] in registers of sixteen: the last is half empty.
const WIDE_BY_SIXTEENS: usize = WIDE.next_multiple_of(16);

/// A number and its derivatives, each as often as its direction's size says ([`Task::sizes`]).
type Number<E, const P: usize> = Dual<f64, P, E>;

/// Simulates `case` and differentiates it along `directions`.
///
/// # Errors
/// As [`super::simulate`].
pub fn differentiate(
    truck: &Truck,
    case: &Case,
    substeps: usize,
    directions: &[Direction],
    interrupt: &(dyn Fn() -> bool + Sync),
) -> Result<Sensitivity, Error> {
    let task = Task::new(truck, case, substeps, directions, interrupt)?;
    let jobs = task.jobs();
    task.sum(&jobs, jobs.iter().map(|job| task.share(job)))
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
    let known = match directions.is_empty() {
        true => side_by_side::outputs(truck, together(truck), cases, substeps, interrupt),
        false => vec![None; cases.len()],
    };
    let one = |(case, known)| {
        if let Some(outputs) = known {
            return Ok(Sensitivity { outputs, derivatives: Vec::new() });
        }
        let task = Task::new(truck, case, substeps, directions, interrupt)?;
        let jobs = task.jobs();
        let shares: Vec<_> = jobs.par_iter().map(|job| task.share(job)).collect();
        task.sum(&jobs, shares)
    };
    let runs: Vec<_> = cases.par_iter().zip(known).map(one).collect();
    runs.into_iter().enumerate().map(|(k, run)| run.map_err(|error| (k, error))).collect()
}

/// Which lifts run together: those that no effect joins run by themselves.
fn together(truck: &Truck) -> &'static [Lifts] {
    match truck.joined() {
        true => &[Lifts::Both],
        false => &[Lifts::One(LiftName::Free), Lifts::One(LiftName::Main)],
    }
}

struct Task<'a> {
    truck: &'a Truck,
    case: &'a Case<'a>,
    substeps: usize,
    directions: &'a [Direction],
    /// By which power of two each direction's derivatives are multiplied while they are narrow: about its parameter's
    /// size, whatever its unit.
    sizes: Vec<f64>,
    interrupt: &'a (dyn Fn() -> bool + Sync),
}

/// One run: of which lifts, along which directions.
struct Job {
    which: Lifts,
    along: Vec<usize>,
    /// Whether it also gives the outputs.
    values: bool,
}

/// What one run adds.
struct Share {
    /// (times, outputs); empty if another run gives them.
    outputs: Vec<f64>,
    /// (times, outputs, directions of the job).
    derivatives: Vec<f64>,
}

impl Share {
    /// Adds it to the whole of `columns` directions.
    fn add_to(&self, sum: &mut Sensitivity, along: &[usize], columns: usize) {
        for (all, own) in sum.outputs.iter_mut().zip(&self.outputs) {
            *all += own;
        }
        if !along.is_empty() {
            let rows = sum.derivatives.chunks_exact_mut(columns);
            for (all, own) in rows.zip(self.derivatives.chunks_exact(along.len())) {
                for (&d, own) in along.iter().zip(own) {
                    all[d] += own;
                }
            }
        }
    }
}

impl<'a> Task<'a> {
    fn new(
        truck: &'a Truck,
        case: &'a Case<'a>,
        substeps: usize,
        directions: &'a [Direction],
        interrupt: &'a (dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        check(&case.inputs, case.wanted, Solver::Fixed { substeps })?;
        let (got, ticks) = (case.command_slope.len(), case.inputs.command.len());
        if got != 0 && got != ticks {
            return Err(Error::Shape {
                name: "command_slope".into(),
                got: got.to_string(),
                expected: ticks.to_string(),
            });
        }
        let limits = truck.limits();
        let size = |direction: &Direction| match direction {
            Direction::Parameter(k) => limits.size(*k),
            _ => 1.0,
        };
        let sizes = directions.iter().map(size).collect();
        Ok(Task { truck, case, substeps, directions, sizes, interrupt })
    }

    /// What the runs come to together, added up in the order of the jobs.
    fn sum(&self, jobs: &[Job], shares: impl IntoIterator<Item = Result<Share, Error>>) -> Result<Sensitivity, Error> {
        let (rows, columns) = (self.case.wanted.len() * OUTPUTS.len(), self.directions.len());
        let mut sum = Sensitivity { outputs: vec![0.0; rows], derivatives: vec![0.0; rows * columns] };
        for (job, share) in jobs.iter().zip(shares) {
            share?.add_to(&mut sum, &job.along, columns);
        }
        Ok(sum)
    }

    /// All runs, each along its own directions only.
    fn jobs(&self) -> Vec<Job> {
        together(self.truck).iter().flat_map(|&which| self.jobs_of(which)).collect()
    }

    fn jobs_of(&self, which: Lifts) -> Vec<Job> {
        let owners = self.truck.owners();
        let has = |lift: LiftName| which == Lifts::Both || which == Lifts::One(lift);
        let concerns = |direction: &Direction| match direction {
            Direction::Parameter(k) => match owners[*k] {
                Owner::Lift(lift) => has(lift),
                Owner::Mast => which == Lifts::Both,
            },
            Direction::Load | Direction::OilTemperature | Direction::OilWarming | Direction::Command => true,
            Direction::Start(lift) | Direction::Input(Input { lift, .. }) => has(*lift),
        };
        let along: Vec<usize> = (0..self.directions.len()).filter(|&d| concerns(&self.directions[d])).collect();
        if along.is_empty() {
            return vec![Job { which, along, values: true }];
        }
        let parts = along.chunks(WIDE).enumerate();
        parts.map(|(k, part)| Job { which, along: part.to_vec(), values: k == 0 }).collect()
    }

    fn share(&self, job: &Job) -> Result<Share, Error> {
        match job.which {
            Lifts::Both => self.of_lifts(LiftName::BOTH, job),
            Lifts::One(lift) => self.of_lifts([lift], job),
        }
    }

    fn of_lifts<const L: usize>(&self, which: [LiftName; L], job: &Job) -> Result<Share, Error> {
        let n = job.along.len();
        if n == 0 {
            return self.part::<[f32; 0], 0, L>(which, job);
        }
        #[cfg(target_arch = "x86_64")]
        {
            use crate::slopes::registers::{Eights, Sixteens};
            use crate::solver::vectors::{has_avx2, has_avx512};
            if has_avx512() {
                return match n <= NARROW {
                    true => self.part::<Sixteens<1>, NARROW, L>(which, job),
                    false => self.part::<Sixteens<3>, WIDE_BY_SIXTEENS, L>(which, job),
                };
            }
            if has_avx2() {
                return if n <= FEW {
                    self.part::<Eights<1>, FEW, L>(which, job)
                } else if n <= NARROW {
                    self.part::<Eights<2>, NARROW, L>(which, job)
                } else {
                    self.part::<Eights<5>, WIDE, L>(which, job)
                };
            }
        }
        // An old processor with neither has one kind of number for all.
        match n <= NARROW && !cfg!(target_arch = "x86_64") {
            true => self.part::<[f32; NARROW], NARROW, L>(which, job),
            false => self.part::<[f32; WIDE], WIDE, L>(which, job),
        }
    }

    fn part<E: Slopes<f64, P>, const P: usize, const L: usize>(
        &self,
        which: [LiftName; L],
        job: &Job,
    ) -> Result<Share, Error> {
        let part = &job.along;
        let number = |direction: Direction, value: f64| -> Number<E, P> {
            match part.iter().position(|&d| self.directions[d] == direction) {
                Some(p) => Dual::seeded(value, p, self.sizes[part[p]]),
                None => Dual::constant(value),
            }
        };
        let load = number(Direction::Load, self.case.inputs.load_kg);
        let (lifts, effects) = self.truck.build(which, load, |k, v| number(Direction::Parameter(k), v))?;
        let inputs: Vec<UnknownInput<Number<E, P>>> = part
            .iter()
            .enumerate()
            .filter_map(|(p, &d)| match self.directions[d] {
                Direction::Input(input) => Some(UnknownInput {
                    place: which.iter().position(|&lift| lift == input.lift)?,
                    port: input.port,
                    height: Dual::seeded(0.0, p, self.sizes[d]),
                    centre: input.centre,
                    width: input.width,
                }),
                _ => None,
            })
            .collect();
        // Both lifts run together where an effect joins them.
        if const { L == 1 } && effects.is_empty() && inputs.is_empty() {
            self.run(which, lifts, Thesis, number, job)
        } else {
            let physics = Extended::new(&effects, &lifts).with_inputs(inputs);
            self.run(which, lifts, physics, number, job)
        }
    }

    fn run<E: Slopes<f64, P>, X: Physics<Number<E, P>>, const P: usize, const L: usize>(
        &self,
        which: [LiftName; L],
        lifts: [Lift<Number<E, P>>; L],
        physics: X,
        number: impl Fn(Direction, f64) -> Number<E, P>,
        job: &Job,
    ) -> Result<Share, Error> {
        let from =
            which.map(|lift| number(Direction::Start(lift), self.case.start[usize::from(lift == LiftName::Main)]));
        let warmer = Warmer {
            by: number(Direction::OilTemperature, self.case.warmer),
            warming: Some(number(Direction::OilWarming, self.case.warming)),
        };
        let mut drive = Shaken {
            replay: Replay::new(which, &self.case.inputs),
            which,
            by: number(Direction::Command, 0.0),
            slope: self.case.command_slope,
        };
        let oil = warmer.at(&(&self.case.inputs).into(), 0);
        let (mast, start) = Mast::at_rest(lifts, physics, from, drive.command(0), oil);
        let (rows, columns) = (self.case.wanted.len() * OUTPUTS.len(), job.along.len());
        let mut outputs = vec![0.0; if job.values { rows } else { 0 }];
        let mut derivatives = vec![0.0; rows * columns];
        let readings = Readings::new(&which, self.truck.effects());
        let mut record = |row: usize, x: &[Number<E, P>]| {
            for j in 0..OUTPUTS.len() {
                let at = row * OUTPUTS.len() + j;
                for (place, factor) in readings.of(j) {
                    let value = x[place];
                    if job.values {
                        outputs[at] += factor * value.re;
                    }
                    for (p, own) in derivatives[at * columns..(at + 1) * columns].iter_mut().enumerate() {
                        *own += factor * value.eps.get(p);
                    }
                }
            }
        };
        let ticks = Ticks {
            mast,
            drive: &mut drive,
            clock: (&self.case.inputs).into(),
            oil: Oil::Warmer(warmer),
            start: &start,
            wanted: self.case.wanted,
            substeps: self.substeps,
            record: &mut record,
            carry_on: false,
            interrupt: self.interrupt,
        };
        widest(ticks).map_err(|stopped| stopped.error(&commanded_names(&which, start.len())))?;
        for row in derivatives.chunks_exact_mut(columns.max(1)) {
            for (derivative, &d) in row.iter_mut().zip(&job.along) {
                *derivative /= self.sizes[d];
            }
        }
        Ok(Share { outputs, derivatives })
    }
}

/// Recorded commands, and what shakes them.
struct Shaken<'a, S, const L: usize> {
    replay: Replay<'a, L>,
    which: [LiftName; L],
    /// How often the slope is added.
    by: S,
    slope: &'a [[f64; 2]],
}

impl<S: Scalar, const L: usize> Drive<S, L> for Shaken<'_, S, L> {
    fn known_ahead(&self) -> bool {
        Drive::<S, L>::known_ahead(&self.replay)
    }
    fn tick(&mut self, _k: usize, _x: &[S], _oil_temperature_degc: S) {}
    fn command(&self, k: usize) -> [S; L] {
        let recorded: [S; L] = self.replay.command(k);
        let Some(&slope) = self.slope.get(k) else { return recorded };
        let slope = commands_of(&self.which, slope);
        std::array::from_fn(|lift| recorded[lift] + self.by.scaled(slope[lift]))
    }
}
