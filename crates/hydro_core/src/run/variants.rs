//! Variants of a truck under the same commands, as many at a time as the processor has registers for.

use rayon::prelude::*;

use super::blocks::{alike, scattered, valve_steps};
use super::drive::Replay;
use super::ticks::{substep_s, Oil, Stopped, Ticks, Warmer};
use super::{check, commands_of, Inputs, Interrupt, Lifts, Solver};
use crate::error::Error;
use crate::lanes::{with_registers, LaneScalar, LaneWork, Precision};
use crate::mast::{Extended, Lift, LiftName, Mast, Physics, Thesis};
use crate::outputs::{Readings, OUTPUTS};
use crate::solver::fixed::ValveSteps;
use crate::solver::vectors::widest;
use crate::truck::Truck;

/// What a variant has of its own.
#[derive(Debug, Clone)]
pub struct Variant {
    /// In the place of [`Truck::values`].
    pub values: Vec<f64>,
    pub load_kg: f64,
    /// Throughout the run.
    pub oil_temperature_degc: f64,
}

/// What all variants go through.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a> {
    pub truck: &'a Truck,
    pub lifts: Lifts,
    /// Strictly increasing [s].
    pub time: &'a [f64],
    /// Free and main command [A] at each time.
    pub command: &'a [[f64; 2]],
    /// Times at which the outputs are wanted [s].
    pub wanted: &'a [f64],
    pub substeps: usize,
}

/// The outputs (times, [`OUTPUTS`]) of every variant, from rest, on all cores: each to the bit what
/// [`super::simulate`] gives with as many fixed substeps. From where a variant runs away they are not numbers.
///
/// # Errors
/// As [`super::simulate`] of the arguments, with a variant's place; an interrupt.
pub fn simulate_variants(
    course: Course,
    variants: &[Variant],
    interrupt: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Vec<f64>>, Error> {
    let (limits, size) = (course.truck.limits(), course.truck.values().len());
    let mut steps = Vec::with_capacity(variants.len());
    for (k, variant) in variants.iter().enumerate() {
        course.check(variant)?;
        if variant.values.len() != size || !limits.hold(&variant.values) {
            return Err(Error::Argument {
                name: "values".into(),
                value: k.to_string(),
                requirement: "a variant within the bounds of the truck's parameters".into(),
            });
        }
        steps.push(Some(course.valve_steps(variant)));
    }
    let width = Precision::Double.widest();
    let groups = alike(&steps, width.lanes());
    let run = |places: &Vec<usize>| {
        let variants = places.iter().map(|&k| &variants[k]).collect();
        with_registers(width, Group { course, variants, interrupt })
    };
    let found: Vec<Result<Vec<Vec<f64>>, Error>> = groups.par_iter().map(run).collect();
    let mut outputs = vec![Vec::new(); variants.len()];
    scattered(&groups, found, &mut outputs)?;
    Ok(outputs)
}

impl Course<'_> {
    fn check(&self, variant: &Variant) -> Result<(), Error> {
        let oil = vec![variant.oil_temperature_degc; self.time.len()];
        let (time, command, load_kg) = (self.time, self.command, variant.load_kg);
        let inputs = Inputs { time, command, oil_temperature_degc: &oil, load_kg };
        check(&inputs, self.wanted, Solver::Fixed { substeps: self.substeps })?;
        let Lifts::One(lift) = self.lifts else { return Ok(()) };
        match self.truck.joined_beyond(lift, &variant.values) {
            Some(effect) => Err(Error::EffectNeedsBothLifts { effect: effect.name() }),
            None => Ok(()),
        }
    }

    fn valve_steps(&self, variant: &Variant) -> ValveSteps {
        let h = substep_s(self.time, self.substeps);
        valve_steps(self.lifts, h, |lift| self.truck.lifts([lift], 0.0, |k, _| variant.values[k]))
    }
}

/// At most as many variants as lanes; a lane without one repeats the last.
struct Group<'a> {
    course: Course<'a>,
    variants: Vec<&'a Variant>,
    interrupt: Interrupt<'a>,
}

impl Group<'_> {
    /// A number of each variant, in lanes.
    fn each<S: LaneScalar<N>, const N: usize>(&self, f: impl Fn(&Variant) -> f64) -> S {
        S::from_lanes(std::array::from_fn(|lane| f(self.variants[lane.min(self.variants.len() - 1)])))
    }

    fn of_lifts<S: LaneScalar<N>, const N: usize, const L: usize>(
        self,
        which: [LiftName; L],
    ) -> Result<Vec<Vec<f64>>, Error> {
        let load = self.each(|one| one.load_kg);
        let (lifts, effects) = self.course.truck.build(which, load, |k, _| self.each(|one| one.values[k]))?;
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
    ) -> Result<Vec<Vec<f64>>, Error> {
        let Course { truck, time, command, wanted, substeps, .. } = self.course;
        let (count, oil) = (self.variants.len(), vec![0.0; time.len()]);
        let inputs = Inputs { time, command, oil_temperature_degc: &oil, load_kg: 0.0 };
        let warmer = Warmer { by: self.each(|one| one.oil_temperature_degc), warming: None };
        let from = which.map(|lift| S::constant(lift.start_position()));
        let (first, oil) = (commands_of(&which, command[0]).map(S::constant), warmer.at(&(&inputs).into(), 0));
        let (mast, start) = Mast::at_rest(lifts, physics, from, first, oil);
        let readings = Readings::new(&which, truck.effects());
        let mut outputs = vec![Vec::with_capacity(wanted.len() * OUTPUTS.len()); count];
        let mut record = |_, x: &[S]| {
            for value in readings.sums(x) {
                for (own, value) in outputs.iter_mut().zip(value.lanes()) {
                    own.push(value);
                }
            }
        };
        let ticks = Ticks {
            mast,
            drive: &mut Replay::new(which, &inputs),
            clock: (&inputs).into(),
            oil: Oil::Warmer(warmer),
            start: &start,
            wanted,
            substeps,
            record: &mut record,
            carry_on: true,
            interrupt: self.interrupt,
        };
        match widest(ticks) {
            Ok(_) | Err(Stopped::NotFinite { .. }) => {}
            Err(Stopped::Interrupted { time_s }) => return Err(Error::Interrupted { time_s }),
        }
        for own in &mut outputs {
            own.resize(wanted.len() * OUTPUTS.len(), f64::NAN);
        }
        Ok(outputs)
    }
}

impl<const N: usize> LaneWork<N> for Group<'_> {
    type Output = Result<Vec<Vec<f64>>, Error>;
    fn run<S: LaneScalar<N>>(self) -> Self::Output {
        match self.course.lifts {
            Lifts::Both => self.of_lifts::<S, N, 2>(LiftName::BOTH),
            Lifts::One(lift) => self.of_lifts::<S, N, 1>([lift]),
        }
    }
}
