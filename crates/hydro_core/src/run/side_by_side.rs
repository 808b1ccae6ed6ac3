//! Runs side by side in lanes: of several trucks, or of several recordings of one.
//!
//! A register's worth of runs takes hardly longer than one, and each is to the bit what it is alone. They must be on one
//! clock, of which each may be the beginning; who ends earlier goes on under his last command, and nobody looks.

use rayon::prelude::*;

use super::drive::Drive;
use super::sensitivity::Case;
use super::ticks::{substep_s, Clock, Oil, Stopped, Ticks, Warmer};
use super::{check, commands_of, Interrupt, Lifts, Solver};
use crate::error::Error;
use crate::lanes::{with_registers, LaneScalar, LaneWork, Precision, Width};
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis};
use crate::outputs::{Readings, OUTPUTS};
use crate::scalar::Scalar;
use crate::solver::vectors::widest;
use crate::truck::Truck;

/// Fewer run as fast by themselves.
const LEAST: usize = 2;

/// (times, outputs) of each case whose run stays finite and that runs beside others; of the others nothing. `runs`:
/// which lifts run together.
pub(super) fn outputs(
    truck: &Truck,
    runs: &[Lifts],
    cases: &[Case],
    substeps: usize,
    interrupt: &(dyn Fn() -> bool + Sync),
) -> Vec<Option<Vec<f64>>> {
    let mut found = vec![None; cases.len()];
    let width = Precision::Double.widest();
    if width == Width::One {
        return found;
    }
    let (values, blocks) = (truck.values(), blocks(cases, substeps, width.lanes()));
    let tasks: Vec<(usize, Lifts)> =
        (0..blocks.len()).flat_map(|k| runs.iter().map(move |&which| (k, which))).collect();
    let run = |&(k, which): &(usize, Lifts)| {
        let lanes = blocks[k].iter().map(|&place| Lane { values: &values, case: cases[place] }).collect();
        with_registers(width, Block { truck, which, lanes, substeps, interrupt })
    };
    let shares: Vec<Result<Vec<Found>, Error>> = tasks.par_iter().map(run).collect();
    for (places, shares) in blocks.iter().zip(shares.chunks_exact(runs.len())) {
        for (lane, &place) in places.iter().enumerate() {
            let own = shares.iter().map(|share| Some(&share.as_ref().ok()?[lane]).filter(|found| found.finite));
            found[place] = own.collect::<Option<Vec<_>>>().map(|own| sum(&own));
        }
    }
    found
}

/// What the lifts come to together.
fn sum(shares: &[&Found]) -> Vec<f64> {
    let mut all = vec![0.0; shares[0].outputs.len()];
    for share in shares {
        for (all, own) in all.iter_mut().zip(&share.outputs) {
            *all += own;
        }
    }
    all
}

/// Places of cases that run side by side, the longest first; in none those that have nobody to run beside, or that
/// no run takes.
fn blocks(cases: &[Case], substeps: usize, lanes: usize) -> Vec<Vec<usize>> {
    let taken = |case: &Case| check(&case.inputs, case.wanted, Solver::Fixed { substeps }).is_ok();
    let mut order: Vec<usize> = (0..cases.len()).filter(|&k| taken(&cases[k]) && !cases[k].wanted.is_empty()).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(cases[k].inputs.time.len()));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in order {
        match groups.iter_mut().find(|group| begins(&cases[group[0]], &cases[k], substeps)) {
            Some(group) => group.push(k),
            None => groups.push(vec![k]),
        }
    }
    let even = |group: &Vec<usize>| {
        let size = group.len().div_ceil(group.len().div_ceil(lanes));
        group.chunks(size).filter(|block| block.len() >= LEAST).map(<[usize]>::to_vec).collect::<Vec<_>>()
    };
    groups.iter().flat_map(even).collect()
}

/// Whether a case's clock and times are the beginning of another's, with substeps as long.
fn begins(whole: &Case, case: &Case, substeps: usize) -> bool {
    let (time, wanted) = (case.inputs.time, case.wanted);
    let ends = time.len() == whole.inputs.time.len() || wanted.last() <= time.last();
    ends && whole.inputs.time.starts_with(time)
        && whole.wanted.starts_with(wanted)
        && substep_s(time, substeps) == substep_s(whole.inputs.time, substeps)
}

/// One run of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lane<'a> {
    /// In the place of [`Truck::values`].
    pub values: &'a [f64],
    pub case: Case<'a>,
}

/// What came of it.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// (times, outputs), as far as the block ran; of a lift that is not simulated nothing.
    pub outputs: Vec<f64>,
    /// Whether every state stayed finite.
    pub finite: bool,
}

/// At most as many runs as a register has lanes, the longest first; a lane without one repeats the last. Their valves
/// are stepped alike ([`super::blocks`]).
pub(super) struct Block<'a> {
    pub truck: &'a Truck,
    pub which: Lifts,
    pub lanes: Vec<Lane<'a>>,
    pub substeps: usize,
    pub interrupt: Interrupt<'a>,
}

impl Block<'_> {
    /// A number of each run, in lanes.
    fn each<S: LaneScalar<N>, const N: usize>(&self, f: impl Fn(&Lane) -> f64) -> S {
        S::from_lanes(std::array::from_fn(|lane| f(&self.lanes[lane.min(self.lanes.len() - 1)])))
    }

    fn of_lifts<S: LaneScalar<N>, const N: usize, const L: usize>(
        self,
        which: [LiftName; L],
    ) -> Result<Vec<Found>, Error> {
        let load = self.each(|lane| lane.case.inputs.load_kg);
        let (lifts, effects) = self.truck.build(which, load, |k, _| self.each(|lane| lane.values[k]))?;
        if effects.is_empty() {
            self.through::<S, _, N, L>(which, lifts, Thesis)
        } else {
            let physics = Extended::new(&effects, &lifts);
            self.through::<S, _, N, L>(which, lifts, physics)
        }
    }

    fn through<S: LaneScalar<N>, X: Physics<S>, const N: usize, const L: usize>(
        self,
        which: [LiftName; L],
        lifts: [Lift<S>; L],
        physics: X,
    ) -> Result<Vec<Found>, Error> {
        let longest = self.lanes[0].case;
        let held = |case: &Case, k: usize| k.min(case.inputs.time.len() - 1);
        let oil = |k: usize| {
            self.each(|Lane { case, .. }| {
                let warmer = Warmer { by: case.warmer, warming: Some(case.warming) };
                warmer.at(&(&case.inputs).into(), held(case, k))
            })
        };
        let command = |k: usize, place: usize| {
            self.each(|Lane { case, .. }| commands_of(&which, case.inputs.command[held(case, k)])[place])
        };
        let ticks = 0..longest.inputs.time.len();
        let oil: Vec<S> = ticks.clone().map(oil).collect();
        let commands = ticks.map(|k| std::array::from_fn(|place| command(k, place))).collect();
        let mut drive = Recorded { commands };
        let from = which.map(|lift| self.each(|lane| lane.case.start[usize::from(lift == LiftName::Main)]));
        let (mast, start) = Mast::at_rest(lifts, physics, from, drive.commands[0], oil[0]);
        let readings = Readings::new(&which, self.truck.effects());
        let rows = |lane: &Lane| lane.case.wanted.len();
        let none = |lane| Found { outputs: Vec::with_capacity(rows(lane) * OUTPUTS.len()), finite: true };
        let mut found: Vec<Found> = self.lanes.iter().map(none).collect();
        let mut record = |row: usize, x: &[S]| {
            let states: Vec<[f64; N]> = x.iter().map(|state| state.lanes()).collect();
            for (lane, found) in found.iter_mut().enumerate().filter(|(lane, _)| row < rows(&self.lanes[*lane])) {
                found.finite &= states.iter().all(|state| state[lane].is_finite());
                // As a sum of `f64` begins: no bit of the first term is lost.
                let read = |j| readings.of(j).fold(-0.0, |sum, (place, factor)| sum + factor * states[place][lane]);
                found.outputs.extend((0..OUTPUTS.len()).map(read));
            }
        };
        let run = Ticks {
            mast,
            drive: &mut drive,
            clock: Clock { time: longest.inputs.time, oil_temperature_degc: longest.inputs.oil_temperature_degc },
            oil: Oil::Each(&oil),
            start: &start,
            wanted: longest.wanted,
            substeps: self.substeps,
            record: &mut record,
            carry_on: true,
            interrupt: self.interrupt,
        };
        match widest(run) {
            Err(Stopped::Interrupted { time_s }) => return Err(Error::Interrupted { time_s }),
            Err(Stopped::NotFinite { .. }) => found.iter_mut().for_each(|found| found.finite = false),
            Ok(_) => {}
        }
        Ok(found)
    }
}

impl<const N: usize> LaneWork<N> for Block<'_> {
    type Output = Result<Vec<Found>, Error>;
    fn run<S: LaneScalar<N>>(self) -> Self::Output {
        match self.which {
            Lifts::Both => self.of_lifts::<S, N, 2>(LiftName::BOTH),
            Lifts::One(lift) => self.of_lifts::<S, N, 1>([lift]),
        }
    }
}

/// Recorded commands, each lane's own.
struct Recorded<S, const L: usize> {
    /// Of every tick.
    commands: Vec<[S; L]>,
}

impl<S: Scalar, const L: usize> Drive<S, L> for Recorded<S, L> {
    fn known_ahead(&self) -> bool {
        true
    }
    fn tick(&mut self, _k: usize, _x: &[S], _oil_temperature_degc: S) {}
    fn command(&self, k: usize) -> [S; L] {
        self.commands[k]
    }
}
