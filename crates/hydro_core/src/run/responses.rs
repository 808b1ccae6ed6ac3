//! How a run answers unknown inputs: hats over time, side by side, at any number of ports.
//!
//! Between the tops of two hats only the falling one and the rising one act, and the run is linear in them and in
//! what earlier substeps have left ([`Fixed::each_remembered`]). So each such interval is differentiated along these,
//! anew from its start, and the answer to a hat is put together: its rise, its fall, and what is remembered of them
//! carried on from interval to interval. One run along some fifty directions, where every hat at every port would
//! be a direction of its own; the same to rounding.

use std::cell::Cell;

use super::drive::Replay;
use super::sensitivity::Case;
use super::ticks::{Between, Oil, Pausing, Ticks, Warmer};
use super::{check, commanded_names, commands_of, Lifts, Solver};
use crate::dual::Dual;
use crate::error::{refuse, Error};
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis, UnknownInput};
use crate::outputs::{Readings, OUTPUTS};
use crate::scalar::Scalar;
use crate::solver::fixed::{memory, Fixed};
use crate::solver::vectors::widest;
use crate::truck::Truck;

/// Directions carried at once, see [`super::sensitivity`].
const WIDE: usize = 16;
const NARROW: usize = 8;

/// Hats over time, the top of each where its neighbours end.
#[derive(Debug, Clone, PartialEq)]
pub struct Hats {
    /// Rising [s].
    pub centres: Vec<f64>,
    /// From the top to either end [s].
    pub width: f64,
}

impl Hats {
    /// Whether each begins and ends at the tops of its neighbours, as far as rounding lets them.
    pub fn adjoin(&self) -> bool {
        let off = |pair: &[f64]| (pair[1] - pair[0] - self.width).abs();
        self.centres.windows(2).all(|pair| off(pair) <= 1e-9 * self.width)
    }
}

/// What a run has answered along some directions: what is remembered first, then a fall and a rise at each port.
#[derive(Debug, Clone, Default)]
struct Answers {
    /// (times, outputs, directions).
    seen: Vec<f64>,
    /// (intervals, remembered, directions): at the end of each.
    left: Vec<f64>,
    directions: usize,
    memory: usize,
}

/// How a run answers hats at some ports.
#[derive(Debug, Clone)]
pub struct Responses {
    ports: Vec<(LiftName, usize)>,
    hats: usize,
    /// In which interval each of the wanted times lies: before the first top 0.
    intervals: Vec<usize>,
    /// By run: the ports it knows, and what it has answered.
    runs: Vec<(Vec<usize>, Answers)>,
}

impl Responses {
    /// The ports of a lift, each by its place in [`crate::ports::PORTS`], under hats.
    ///
    /// # Errors
    /// As [`super::simulate`]; hats that do not adjoin.
    pub fn new(
        truck: &Truck,
        case: &Case,
        substeps: usize,
        ports: &[(LiftName, usize)],
        hats: &Hats,
        interrupt: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self, Error> {
        check(&case.inputs, case.wanted, Solver::Fixed { substeps })?;
        if !hats.adjoin() {
            return refuse("centres", format!("{:?}", hats.centres), "one width apart");
        }
        let both = [Lifts::Both];
        let each = LiftName::BOTH.map(Lifts::One);
        let groups: &[Lifts] = if truck.joined() { &both } else { &each };
        let mut runs = Vec::new();
        let mut intervals = Vec::new();
        for &which in groups {
            let has = |lift: LiftName| which == Lifts::Both || which == Lifts::One(lift);
            let own: Vec<usize> = (0..ports.len()).filter(|&p| has(ports[p].0)).collect();
            if own.is_empty() {
                continue;
            }
            let asked: Vec<_> = own.iter().map(|&p| ports[p]).collect();
            let run = Run { truck, case, substeps, ports: &asked, hats, interrupt };
            let (answers, times) = match which {
                Lifts::Both => run.of_lifts(LiftName::BOTH)?,
                Lifts::One(lift) => run.of_lifts([lift])?,
            };
            intervals = times;
            runs.push((own, answers));
        }
        Ok(Responses { ports: ports.to_vec(), hats: hats.centres.len(), intervals, runs })
    }

    /// Along how many the runs were differentiated.
    pub fn directions(&self) -> usize {
        self.runs.iter().map(|(_, answers)| answers.directions).sum()
    }

    /// (times, outputs, hats) at one of the ports; None if it is not among them.
    pub fn at(&self, lift: LiftName, port: usize) -> Option<Vec<f64>> {
        let asked = self.ports.iter().position(|&one| one == (lift, port))?;
        let (place, answers) = self.runs.iter().find_map(|(own, answers)| {
            let place = own.iter().position(|&p| p == asked)?;
            Some((place, answers))
        })?;
        Some(self.together(answers, answers.memory + 2 * place))
    }

    /// The answers to all hats, from those to a fall (direction `fall`), to a rise (the next) and to what is
    /// remembered.
    fn together(&self, answers: &Answers, fall: usize) -> Vec<f64> {
        let (hats, memory, outputs) = (self.hats, answers.memory, OUTPUTS.len());
        let mut out = vec![0.0; self.intervals.len() * outputs * hats];
        // What is remembered of each hat at the start of an interval: (remembered, hats).
        let mut before = vec![0.0; memory * hats];
        let mut after = before.clone();
        let mut row = 0;
        for interval in 0..=hats {
            let through = |along: &[f64], before: &[f64], to: &mut [f64]| {
                for (factor, own) in along[..memory].iter().zip(before.chunks_exact(hats)) {
                    for (to, own) in to[..interval].iter_mut().zip(own) {
                        *to += factor * own;
                    }
                }
                if interval > 0 {
                    to[interval - 1] += along[fall];
                }
                if interval < hats {
                    to[interval] += along[fall + 1];
                }
            };
            while row < self.intervals.len() && self.intervals[row] == interval {
                for output in row * outputs..(row + 1) * outputs {
                    let along = &answers.seen[output * answers.directions..(output + 1) * answers.directions];
                    if along.iter().any(|&slope| slope != 0.0) {
                        through(along, &before, &mut out[output * hats..(output + 1) * hats]);
                    }
                }
                row += 1;
            }
            if row == self.intervals.len() {
                break;
            }
            after.fill(0.0);
            for (k, to) in after.chunks_exact_mut(hats).enumerate() {
                let first = (interval * memory + k) * answers.directions;
                through(&answers.left[first..first + answers.directions], &before, to);
            }
            std::mem::swap(&mut before, &mut after);
        }
        out
    }
}

struct Run<'a> {
    truck: &'a Truck,
    case: &'a Case<'a>,
    substeps: usize,
    ports: &'a [(LiftName, usize)],
    hats: &'a Hats,
    interrupt: &'a (dyn Fn() -> bool + Sync),
}

impl Run<'_> {
    /// All answers, and the interval of each of the wanted times.
    fn of_lifts<const L: usize>(&self, which: [LiftName; L]) -> Result<(Answers, Vec<usize>), Error> {
        let memory = memory(L, Physics::<f64>::states(&self.built::<f64, L>(which)?.physics));
        let directions = memory + 2 * self.ports.len();
        let mut all = Answers {
            seen: vec![0.0; self.case.wanted.len() * OUTPUTS.len() * directions],
            left: vec![0.0; self.hats.centres.len() * memory * directions],
            directions,
            memory,
        };
        let mut intervals = vec![0; self.case.wanted.len()];
        // Of those along which no port is pushed the thesis alone needs no port at all.
        let parts = [(0, memory), (memory, directions)];
        for (from, to) in parts {
            for first in (from..to).step_by(WIDE) {
                let part = first..to.min(first + WIDE);
                if part.len() > NARROW {
                    self.part::<WIDE, L>(which, part, &mut all, &mut intervals)?;
                } else {
                    self.part::<NARROW, L>(which, part, &mut all, &mut intervals)?;
                }
            }
        }
        Ok((all, intervals))
    }

    fn built<S: Scalar, const L: usize>(&self, which: [LiftName; L]) -> Result<Built<S, L>, Error> {
        let load = S::constant(self.case.inputs.load_kg);
        let (lifts, effects) = self.truck.build(which, load, |_, v| S::constant(v))?;
        let plain = effects.is_empty();
        let physics = Extended::new(&effects, &lifts);
        Ok(Built { lifts, physics, plain })
    }

    fn part<const P: usize, const L: usize>(
        &self,
        which: [LiftName; L],
        part: std::ops::Range<usize>,
        all: &mut Answers,
        intervals: &mut [usize],
    ) -> Result<(), Error> {
        let Built { lifts, physics, plain } = self.built::<Dual<f64, P>, L>(which)?;
        if const { L == 1 } && plain && part.end <= all.memory {
            return self.run(which, lifts, Thesis, part, all, intervals);
        }
        let inputs = part.clone().filter_map(|d| Some((d - part.start, d.checked_sub(all.memory)?)));
        let inputs = inputs.filter_map(|(p, pushed)| {
            let (lift, port) = self.ports[pushed / 2];
            Some(UnknownInput {
                place: which.iter().position(|&one| one == lift)?,
                port,
                height: Dual::variable(0.0, p),
                centre: f64::INFINITY,
                width: self.hats.width,
            })
        });
        let physics = physics.with_inputs(inputs.collect());
        self.run(which, lifts, physics, part, all, intervals)
    }

    fn run<X: Physics<Dual<f64, P>>, const P: usize, const L: usize>(
        &self,
        which: [LiftName; L],
        lifts: [Lift<Dual<f64, P>>; L],
        physics: X,
        part: std::ops::Range<usize>,
        all: &mut Answers,
        intervals: &mut [usize],
    ) -> Result<(), Error> {
        let clock = (&self.case.inputs).into();
        let warmer = Warmer { by: Dual::constant(self.case.warmer), warming: Some(Dual::constant(self.case.warming)) };
        let of = |both| commands_of(&which, both).map(Dual::constant);
        let command = of(self.case.inputs.command[0]);
        let (mut mast, start) = Mast::at_rest(lifts, physics, of(self.case.start), command, warmer.at(&clock, 0));
        mast.physics.move_inputs([f64::NEG_INFINITY, self.hats.centres.first().copied().unwrap_or(f64::INFINITY)]);
        let readings = Readings::new(&which, self.truck.effects());
        let interval = Cell::new(0);
        let Answers { seen, left, directions, memory } = all;
        let directions = *directions;
        let mut record = |row: usize, x: &[Dual<f64, P>]| {
            intervals[row] = interval.get();
            for j in 0..OUTPUTS.len() {
                let first = (row * OUTPUTS.len() + j) * directions;
                for (place, factor) in readings.of(j) {
                    for (own, eps) in seen[first + part.start..first + part.end].iter_mut().zip(&x[place].eps) {
                        *own += factor * eps;
                    }
                }
            }
        };
        let ticks = Ticks {
            mast,
            drive: &mut Replay::new(which, &self.case.inputs),
            clock,
            oil: Oil::Warmer(warmer),
            start: &start,
            wanted: self.case.wanted,
            substeps: self.substeps,
            record: &mut record,
            carry_on: false,
            interrupt: self.interrupt,
        };
        let between = Renewal {
            centres: &self.hats.centres,
            interval: &interval,
            left,
            directions,
            memory: *memory,
            part: part.clone(),
        };
        widest(Pausing { ticks, between }).map_err(|stopped| stopped.error(&commanded_names(&which, start.len())))?;
        Ok(())
    }
}

/// A truck's lifts and effects, and whether it has none of these.
struct Built<S, const L: usize> {
    lifts: [Lift<S>; L],
    physics: Extended<S>,
    plain: bool,
}

/// At each top what is remembered is kept, and the next interval begins: every remembered number is a variable, and
/// nothing has been pushed yet.
struct Renewal<'a> {
    centres: &'a [f64],
    interval: &'a Cell<usize>,
    left: &'a mut [f64],
    directions: usize,
    memory: usize,
    part: std::ops::Range<usize>,
}

impl<X: Physics<Dual<f64, P>>, const P: usize, const L: usize> Between<Dual<f64, P>, X, L> for Renewal<'_> {
    #[inline(always)]
    fn before(&mut self, middle_s: f64, fixed: &mut Fixed<Dual<f64, P>, X, L>) -> bool {
        let before = self.interval.get();
        while self.centres.get(self.interval.get()).is_some_and(|&top| middle_s >= top) {
            self.renew(fixed);
        }
        self.interval.get() > before
    }
}

impl Renewal<'_> {
    #[inline(never)]
    fn renew<X: Physics<Dual<f64, P>>, const P: usize, const L: usize>(
        &mut self,
        fixed: &mut Fixed<Dual<f64, P>, X, L>,
    ) {
        let interval = self.interval.get();
        let part = self.part.clone();
        fixed.each_remembered(|place, number| {
            let first = (interval * self.memory + place) * self.directions;
            self.left[first + part.start..first + part.end].copy_from_slice(&number.eps[..part.len()]);
            number.eps = std::array::from_fn(|p| if part.start + p == place { 1.0 } else { 0.0 });
        });
        let rising = self.centres.get(interval + 1).copied().unwrap_or(f64::INFINITY);
        fixed.mast.physics.move_inputs([self.centres[interval], rising]);
        self.interval.set(interval + 1);
    }
}
