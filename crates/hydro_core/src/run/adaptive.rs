//! A run with the adaptive integrator: it stops at every jump of an input.

use super::differentiable::{Columns, Differentiable};
use super::{commands_of, Inputs, Interrupt, Run};
use crate::error::Error;
use crate::mast::{LiftName, Physics};
use crate::solver::radau::{Radau, System};

/// Longest run in accepted steps: some hours of lowering at the tightest tolerance.
const STEP_LIMIT: usize = 20_000_000;

/// Runs `mast` through its inputs from `start`.
pub(super) fn run<X: Physics<f64>, Y: Physics<Columns>, const L: usize>(
    mast: &mut Differentiable<X, Y, L>,
    which: &[LiftName; L],
    inputs: &Inputs,
    wanted: &[f64],
    tolerance: f64,
    start: &[f64],
    interrupt: Interrupt,
) -> Result<Run, Error> {
    let n = mast.dim();
    let mut states = vec![0.0; wanted.len() * n];
    let held = |mast: &mut Differentiable<X, Y, L>, k: usize| {
        mast.set_inputs(commands_of(which, inputs.command[k]), inputs.oil_temperature_degc[k]);
    };
    held(mast, 0);
    let mut radau = Radau::new(mast, inputs.time[0], start, tolerance, STEP_LIMIT);
    let mut next = 0;
    if wanted.first() == Some(&inputs.time[0]) {
        states[..n].copy_from_slice(start);
        next = 1;
    }
    let Some(&end) = wanted.last() else {
        return Ok(Run { state_names: mast.names().to_vec(), states, statistics: radau.statistics });
    };
    let mut k = 0;
    while radau.t < end {
        // The inputs stay until the next time at which one of them differs.
        let same = |j: &usize| {
            inputs.command[*j] == inputs.command[k] && inputs.oil_temperature_degc[*j] == inputs.oil_temperature_degc[k]
        };
        let jump = (k + 1..inputs.time.len()).find(|j| !same(j));
        let until = jump.map_or(end, |j| inputs.time[j].min(end));
        radau.advance(mast, until, |step| {
            while next < wanted.len() && wanted[next] <= step.to {
                step.at(wanted[next], &mut states[next * n..(next + 1) * n]);
                next += 1;
            }
            if interrupt() {
                return Err(Error::Interrupted { time_s: step.to });
            }
            Ok(())
        })?;
        if let Some(j) = jump.filter(|_| radau.t < end) {
            k = j;
            held(mast, k);
            radau.inputs_changed(mast);
            radau.statistics.stops += 1;
        }
    }
    Ok(Run { state_names: mast.names().to_vec(), states, statistics: radau.statistics })
}
