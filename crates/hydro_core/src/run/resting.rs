//! A lift that rests: no command moves it all along, and nothing else does.
//!
//! Its oil seeps through shut valves (`A_leak` of (3.15) and the compensator's), so that it creeps by micrometres in a
//! recording, as evenly as nothing else in the mast. What its pressure tells is the load. One step a tick follows that to
//! far less than any sensor shows; what moves is stepped as finely as ever.

use super::sensitivity::Case;
use super::{commands_of, Lifts};
use crate::truck::Truck;

/// Substeps of a tick for these lifts of a recording, where `usual` are what moving ones take.
pub(super) fn substeps(truck: &Truck, which: Lifts, case: &Case, usual: usize) -> usize {
    let Lifts::One(lift) = which else { return usual };
    let acts = truck.effects().any(|effect| effect.lift.is_none_or(|own| own == lift));
    let still = |command: &[f64; 2]| commands_of(&[lift], *command) == [0.0];
    match !acts && case.inputs.command.iter().all(still) && case.command_slope.iter().all(still) {
        true => 1,
        false => usual,
    }
}
