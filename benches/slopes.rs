//! What slopes cost: `cargo bench --bench slopes`.
//!
//! A lowering of the free lift of twenty seconds, four substeps a tick, differentiated along ever more of its
//! parameters, as multiples of the same run without slopes. Difference quotients would take one run more for each.
//! Both are timed in turn, and the least of many times counts. With an effect as a diagnosis has it, and without.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use std::time::Instant;

use hydro_core::mast::LiftName;
use hydro_core::run::sensitivity::{differentiate, Case, Direction};
use hydro_core::run::Inputs;
use hydro_core::truck::{Owner, Truck};

const SUBSTEPS: usize = 4;
const TICK: f64 = 0.02;
const TICKS: usize = 1000;
const TURNS: usize = 30;

/// Seconds of one run along each number of directions, the least of all turns.
fn seconds(truck: &Truck, counts: &[usize]) -> Vec<f64> {
    let time: Vec<f64> = (0..TICKS).map(|k| k as f64 * TICK).collect();
    let command: Vec<[f64; 2]> = (0..TICKS).map(|k| [[0.0, 0.7, 0.55, 0.95, 0.5][k / 40 % 5], 0.0]).collect();
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &[45.0; TICKS], load_kg: 800.0 };
    let start = LiftName::BOTH.map(LiftName::start_position);
    let case = Case { inputs, wanted: &time, warmer: 0.0, warming: 0.0, start, command_slope: &[] };
    let owners = truck.owners().into_iter().enumerate();
    let own = owners.filter(|(_, owner)| *owner == Owner::Lift(LiftName::Free));
    let along: Vec<Direction> = own.map(|(k, _)| Direction::Parameter(k)).collect();
    let mut least = vec![f64::INFINITY; counts.len()];
    for _ in 0..TURNS {
        for (least, &count) in least.iter_mut().zip(counts) {
            let start = Instant::now();
            differentiate(truck, &case, SUBSTEPS, &along[..count], &|| false).expect("it is an ordinary lowering");
            *least = least.min(start.elapsed().as_secs_f64());
        }
    }
    least
}

fn main() {
    let counts = [0, 8, 16, 24, 32];
    println!("directions   thesis, runs   with a leak, runs   by difference quotients, runs");
    let effect = [("free.leakage.coefficient", 1e-12)];
    let [thesis, leak] = [&[][..], &effect[..]].map(|effects| seconds(&common::truck_with(effects), &counts));
    for (k, count) in counts.iter().enumerate() {
        let [thesis, leak] = [&thesis, &leak].map(|seconds| seconds[k] / seconds[0]);
        println!("{count:10}   {thesis:12.2}   {leak:17.2}   {:28}", count + 1);
    }
}
