//! What recordings of one truck save side by side: `RAYON_NUM_THREADS=1 cargo bench --bench recordings`.
//!
//! Lowerings of the free lift of twenty seconds, four substeps a tick, without slopes, each with its own load and of its
//! own length: all in one call as a share of one by one, on one core. Both are timed in turn, and the least of many times
//! counts. With an effect as a diagnosis has it, and without.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use std::time::Instant;

use hydro_core::mast::LiftName;
use hydro_core::run::sensitivity::{differentiate, differentiate_all, Case};
use hydro_core::run::Inputs;
use hydro_core::truck::Truck;

const SUBSTEPS: usize = 4;
const TICK: f64 = 0.02;
const TICKS: usize = 1000;
const TURNS: usize = 20;

/// Side by side as a share of one by one.
fn share(truck: &Truck, count: usize) -> f64 {
    let time: Vec<f64> = (0..TICKS).map(|k| k as f64 * TICK).collect();
    let command: Vec<[f64; 2]> = (0..TICKS).map(|k| [[0.0, 0.7, 0.55, 0.95, 0.5][k / 40 % 5], 0.0]).collect();
    let start = LiftName::BOTH.map(LiftName::start_position);
    let case = |k: usize| {
        let (ticks, load_kg) = (TICKS - 10 * k, 100.0 * k as f64);
        let (time, command) = (&time[..ticks], &command[..ticks]);
        let inputs = Inputs { time, command, oil_temperature_degc: &[45.0; TICKS][..ticks], load_kg };
        Case { inputs, wanted: time, warmer: 0.0, warming: 0.0, start, command_slope: &[] }
    };
    let cases: Vec<Case> = (0..count).map(case).collect();
    let mut least = [f64::INFINITY; 2];
    for _ in 0..TURNS {
        let began = Instant::now();
        for case in &cases {
            differentiate(truck, case, SUBSTEPS, &[], &|| false).expect("it is an ordinary lowering");
        }
        least[0] = least[0].min(began.elapsed().as_secs_f64());
        let began = Instant::now();
        differentiate_all(truck, &cases, SUBSTEPS, &[], &|| false).expect("they are ordinary lowerings");
        least[1] = least[1].min(began.elapsed().as_secs_f64());
    }
    least[1] / least[0]
}

fn main() {
    println!("recordings   thesis, share   with a leak, share");
    let trucks = [&[][..], &[("free.leakage.coefficient", 1e-12)][..]].map(common::truck_with);
    for count in [1, 2, 4, 8, 16] {
        println!("{count:10}   {:13.2}   {:18.2}", share(&trucks[0], count), share(&trucks[1], count));
    }
}
