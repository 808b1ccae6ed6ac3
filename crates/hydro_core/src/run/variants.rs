//! Variants of a truck under the same commands, as many at a time as the processor has registers for.

use rayon::prelude::*;

use super::blocks::{alike, scattered, valve_steps};
use super::sensitivity::Case;
use super::side_by_side::{Block, Found, Lane};
use super::ticks::substep_s;
use super::{check, Inputs, Lifts, Solver};
use crate::error::{refuse, Error};
use crate::lanes::{with_registers, Precision};
use crate::mast::LiftName;
use crate::outputs::OUTPUTS;
use crate::solver::fixed::ValveSteps;
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
            return refuse("values", k, "a variant within the bounds of the truck's parameters");
        }
        steps.push(Some(course.valve_steps(variant)));
    }
    let width = Precision::Double.widest();
    let groups = alike(&steps, width.lanes());
    let run = |places: &Vec<usize>| {
        let oils: Vec<Vec<f64>> = places.iter().map(|&k| course.oil(&variants[k])).collect();
        let start = LiftName::BOTH.map(LiftName::start_position);
        let Course { truck, lifts, wanted, substeps, .. } = course;
        let lanes = places.iter().zip(&oils).map(|(&k, oil)| {
            let inputs = course.inputs(&variants[k], oil);
            let case = Case { inputs, wanted, warmer: 0.0, warming: 0.0, start, command_slope: &[] };
            Lane { values: &variants[k].values, case }
        });
        let lanes = lanes.collect();
        with_registers(width, Block { truck, which: lifts, lanes, substeps, interrupt })
    };
    let found: Vec<Result<Vec<Found>, Error>> = groups.par_iter().map(run).collect();
    let ended = found.into_iter().map(|found| Ok(found?.into_iter().map(|one| course.shown(one)).collect())).collect();
    let mut outputs = vec![Vec::new(); variants.len()];
    scattered(&groups, ended, &mut outputs)?;
    Ok(outputs)
}

impl Course<'_> {
    /// The oil's temperature at each command [°C].
    fn oil(&self, variant: &Variant) -> Vec<f64> {
        vec![variant.oil_temperature_degc; self.time.len()]
    }

    fn inputs<'a>(&'a self, variant: &Variant, oil: &'a [f64]) -> Inputs<'a> {
        Inputs { time: self.time, command: self.command, oil_temperature_degc: oil, load_kg: variant.load_kg }
    }

    fn check(&self, variant: &Variant) -> Result<(), Error> {
        let oil = self.oil(variant);
        check(&self.inputs(variant, &oil), self.wanted, Solver::Fixed { substeps: self.substeps })?;
        let Lifts::One(lift) = self.lifts else { return Ok(()) };
        match self.truck.joined_beyond(lift, &variant.values) {
            Some(effect) => Err(Error::EffectNeedsBothLifts { effect: effect.name() }),
            None => Ok(()),
        }
    }

    /// What belongs to a lift that is not simulated is not a number, nor is anything after the block's end.
    fn shown(&self, found: Found) -> Vec<f64> {
        let mut outputs = found.outputs;
        outputs.resize(self.wanted.len() * OUTPUTS.len(), f64::NAN);
        let Lifts::One(lift) = self.lifts else { return outputs };
        for (k, output) in OUTPUTS.iter().enumerate() {
            if output.of.iter().any(|&(other, ..)| other != lift) {
                outputs.iter_mut().skip(k).step_by(OUTPUTS.len()).for_each(|value| *value = f64::NAN);
            }
        }
        outputs
    }

    fn valve_steps(&self, variant: &Variant) -> ValveSteps {
        let h = substep_s(self.time, self.substeps);
        valve_steps(self.lifts, h, |lift| self.truck.lifts([lift], 0.0, |k, _| variant.values[k]))
    }
}
