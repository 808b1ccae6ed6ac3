//! A valve that answers by a curve: as slow as its bounds allow, and as a search starts from it.

mod common;

use common::{thesis_values, TICK};
use hydro_core::mast::LiftName;
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::sensitivity::{differentiate, Case, Direction};
use hydro_core::run::{simulate, Inputs, Lifts, Solver};
use hydro_core::truck::{Truck, Value};

fn truck(times: [f64; 7]) -> Truck {
    let mut values = thesis_values();
    for (k, time) in times.into_iter().enumerate() {
        values.insert(format!("main.free_response.time_{k}"), Value::Number(time));
    }
    values.insert("main.free_response.range".into(), Value::Number(0.8));
    Truck::from_values(values).unwrap()
}

/// Opened, half shut, opened wide, shut, opened, shut.
const LEVELS: [f64; 7] = [0.0, 0.7, 0.5, 1.1, 0.0, 0.6, 0.0];
const ROWS: usize = 25 * LEVELS.len();
const MAIN: Lifts = Lifts::One(LiftName::Main);

fn inputs<T>(with: impl FnOnce(&Inputs, &[f64]) -> T) -> T {
    let time: Vec<f64> = (0..ROWS).map(|k| k as f64 * TICK).collect();
    let command: Vec<[f64; 2]> = (0..ROWS).map(|k| [LEVELS[k / 25]; 2]).collect();
    with(&Inputs { time: &time, command: &command, oil_temperature_degc: &[40.0; ROWS], load_kg: 700.0 }, &time)
}

/// Fall, rise, teeth and level at the bounds, and a little of each.
fn curves() -> impl Iterator<Item = [f64; 7]> {
    let shapes: [[f64; 7]; 5] = [
        std::array::from_fn(|k| k as f64 / 6.0),
        std::array::from_fn(|k| 1.0 - k as f64 / 6.0),
        std::array::from_fn(|k| (k % 2) as f64),
        std::array::from_fn(|k| ((k + 1) % 2) as f64),
        [1.0; 7],
    ];
    [1.0, 0.05, 1e-3, 1e-5].into_iter().flat_map(move |size| shapes.map(|shape| shape.map(|c| size * c)))
}

#[test]
fn however_the_valve_answers_four_substeps_a_tick_follow_the_adaptive_integrator() {
    inputs(|inputs, time| {
        for times in curves() {
            let truck = truck(times);
            let solvers = [Solver::Fixed { substeps: 4 }, Solver::Adaptive { tolerance: 1e-5 }];
            let [a, b] = solvers.map(|solver| simulate(&truck, MAIN, inputs, time, solver, None, &|| false).unwrap());
            let width = a.state_names.len();
            for (state, close) in [("main.velocity", 0.01), ("main.cylinder_pressure", 2e5)] {
                let place = a.state_names.iter().position(|name| name == state).unwrap();
                let squares: f64 =
                    a.states.iter().zip(&b.states).skip(place).step_by(width).map(|(a, b)| (a - b).powi(2)).sum();
                let apart = (squares / ROWS as f64).sqrt();
                assert!(apart < close, "{times:?}: {state} is {apart:e} apart");
            }
        }
    });
}

#[test]
fn from_nothing_the_derivative_tells_of_each_time_by_itself() {
    inputs(|&inputs, time| {
        let case = Case {
            inputs,
            wanted: time,
            warmer: 0.0,
            warming: 0.0,
            command_slope: &[],
            start: LiftName::BOTH.map(LiftName::start_position),
        };
        let run = |truck: &Truck, along: &[Direction]| differentiate(truck, &case, 4, along, &|| false).unwrap();
        let none = truck([0.0; 7]);
        let names = none.names();
        let place = |k: usize| names.iter().position(|n| *n == format!("main.free_response.time_{k}")).unwrap();
        let along: Vec<Direction> = (0..7).map(place).map(Direction::Parameter).collect();
        let exact = run(&none, &along);
        for k in 0..7 {
            let step = 1e-6;
            let moved = run(&truck(std::array::from_fn(|j| if j == k { step } else { 0.0 })), &[]);
            let (mut most, mut off) = (0.0f64, 0.0f64);
            // The main lift's velocity.
            for (row, (a, b)) in
                exact.outputs.chunks_exact(OUTPUTS.len()).zip(moved.outputs.chunks_exact(OUTPUTS.len())).enumerate()
            {
                let slope = exact.derivatives[(row * OUTPUTS.len() + 3) * 7 + k];
                most = most.max(slope.abs());
                off = off.max((slope - (b[3] - a[3]) / step).abs());
            }
            // Of the widest distances there are few steps.
            assert!(most > 1e-4 && off < 0.02 * most, "{k}: {off:e} of {most:e}");
        }
    });
}
