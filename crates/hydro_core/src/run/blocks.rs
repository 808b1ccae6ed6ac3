//! Members side by side in lanes: those whose valves are stepped alike, so that a member's bits are its own.

use crate::error::Error;
use crate::mast::{Lift, LiftName};
use crate::scalar::Scalar;
use crate::solver::fixed::{ValveRates, ValveSteps};

use super::Lifts;

/// How the valves of one member are stepped, by itself: those of the lifts that run, as `built` makes them.
pub(crate) fn valve_steps<S: Scalar>(lifts: Lifts, h: f64, built: impl Fn(LiftName) -> [Lift<S>; 1]) -> ValveSteps {
    let with = |rates: ValveRates, lift: LiftName| rates.with(&built(lift)[0].valve);
    let rates = match lifts {
        Lifts::Both => LiftName::BOTH.into_iter().fold(ValveRates::default(), with),
        Lifts::One(lift) => with(ValveRates::default(), lift),
    };
    ValveSteps::of(rates, h)
}

/// Places of members in blocks of at most `lanes`, each of members that are stepped alike; who has no steps is left
/// out.
pub(crate) fn alike(steps: &[Option<ValveSteps>], lanes: usize) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..steps.len()).filter(|&k| steps[k].is_some()).collect();
    order.sort_by_key(|&k| (steps[k], k));
    let blocks = order.chunk_by(|&a, &b| steps[a] == steps[b]).flat_map(|alike| alike.chunks(lanes));
    blocks.map(<[usize]>::to_vec).collect()
}

/// What the blocks found, each member's at its place in `all`.
pub(crate) fn scattered<T>(
    blocks: &[Vec<usize>],
    found: Vec<Result<Vec<T>, Error>>,
    all: &mut [T],
) -> Result<(), Error> {
    for (places, block) in blocks.iter().zip(found) {
        for (&place, own) in places.iter().zip(block?) {
            all[place] = own;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_has_members_that_are_stepped_alike_and_everyone_has_one_place() {
        let (one, two) = (Some(ValveSteps::Linear(1)), Some(ValveSteps::Linear(2)));
        let steps = [two, one, None, one, two, one, Some(ValveSteps::Implicit(1))];
        let blocks = alike(&steps, 2);
        assert_eq!(blocks, [vec![1, 3], vec![5], vec![0, 4], vec![6]]);
        let found = blocks.iter().map(|places| Ok(places.iter().map(|k| 10 * k).collect())).collect();
        let mut all = vec![7; steps.len()];
        scattered(&blocks, found, &mut all).unwrap();
        assert_eq!(all, [0, 10, 7, 30, 40, 50, 60]);
    }
}
