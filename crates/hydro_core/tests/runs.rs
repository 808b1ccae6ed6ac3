//! Whole runs: nothing ceases to be a number, both solvers agree, the load stays up and comes to rest.

mod common;

use std::cell::Cell;

use common::space::{cases, differences, trucks, values_near_the_thesis, within};
use common::{column, state, truck_with, Lowering, TICK};
use hydro_core::error::Error;
use hydro_core::mast::{LiftName, STATES};
use hydro_core::parameters::Scale;
use hydro_core::run::{simulate, Inputs, Lifts, Run, Solver};
use hydro_core::truck::Truck;
use proptest::prelude::*;

const FIXED: Solver = Solver::Fixed { substeps: 8 };
const ADAPTIVE: Solver = Solver::Adaptive { tolerance: Solver::DEFAULT_TOLERANCE };

/// Both lifts; an adaptive run is interrupted after `most` steps.
fn run_both(
    truck: &Truck,
    load_kg: f64,
    oil_temperature_degc: f64,
    command: &[[f64; 2]],
    solver: Solver,
    most: usize,
) -> Result<Run, Error> {
    let time: Vec<f64> = (0..command.len()).map(|k| k as f64 * TICK).collect();
    let inputs =
        Inputs { time: &time, command, oil_temperature_degc: &vec![oil_temperature_degc; time.len()], load_kg };
    let steps = Cell::new(0);
    simulate(truck, Lifts::Both, &inputs, &time, solver, None, &|| {
        steps.set(steps.get() + 1);
        steps.get() > most
    })
}

/// Up to four levels for each lift, 0.16 s each.
fn commands() -> BoxedStrategy<Vec<[f64; 2]>> {
    proptest::collection::vec([0.0..1.75f64, 0.0..1.75f64], 1..5)
        .prop_map(|levels| levels.iter().flat_map(|&level| vec![level; 8]).collect())
        .boxed()
}

fn loads() -> BoxedStrategy<f64> {
    within(0.0, 2e4, Scale::Linear)
}

fn celsius() -> BoxedStrategy<f64> {
    within(-50.0, 150.0, Scale::Linear)
}

proptest! {
    #![proptest_config(cases(100))]

    #[test]
    fn no_truck_within_its_bounds_makes_the_fixed_path_leave_the_numbers(
        truck in trucks(), load in loads(), temperature in celsius(), command in commands(),
    ) {
        let run = run_both(&truck, load, temperature, &command, FIXED, usize::MAX);
        let facts = || format!("{load} kg, {temperature} degC, {:?}\n{}", command, differences(&truck, &truck_with(&[])));
        match run {
            Ok(run) => prop_assert!(run.states.iter().all(|x| x.is_finite()), "{}", facts()),
            Err(error) => prop_assert!(false, "{error}; {}", facts()),
        }
    }
}

proptest! {
    #![proptest_config(cases(80))]

    #[test]
    fn no_truck_within_its_bounds_makes_the_adaptive_integrator_leave_the_numbers_or_panic(
        truck in trucks(), load in loads(), temperature in celsius(), command in commands(),
    ) {
        // Some of these trucks chatter; then the integrator says so or is told to stop.
        match run_both(&truck, load, temperature, &command, ADAPTIVE, 1_000) {
            Ok(run) => prop_assert!(run.states.iter().all(|x| x.is_finite())),
            Err(Error::StepTooSmall { .. } | Error::TooManySteps { .. } | Error::Interrupted { .. }) => {}
            Err(error) => prop_assert!(false, "{error}\n{}", differences(&truck, &truck_with(&[]))),
        }
    }
}

/// Largest difference of the velocities of two runs of both lifts [m/s].
fn apart(a: &Run, b: &Run) -> f64 {
    let n = a.state_names.len();
    let rows = a.states.chunks_exact(n).zip(b.states.chunks_exact(n));
    rows.flat_map(|(a, b)| [4, STATES + 4].map(|k| (a[k] - b[k]).abs())).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn near_the_thesis_truck_both_solvers_agree(
        values in values_near_the_thesis(1.3),
        load in 0.0..1500.0f64,
        temperature in 10.0..70.0f64,
        levels in proptest::collection::vec([0.0..1.1f64, 0.0..1.1f64], 1..5),
    ) {
        let truck = Truck::from_values(values).unwrap();
        let command: Vec<[f64; 2]> = levels.iter().flat_map(|&level| vec![level; 25]).collect();
        let adaptive = run_both(&truck, load, temperature, &command, Solver::Adaptive { tolerance: 1e-6 }, 20_000);
        let fixed = run_both(&truck, load, temperature, &command, FIXED, usize::MAX);
        let apart = apart(&adaptive.unwrap(), &fixed.unwrap());
        prop_assert!(apart < 1e-3, "{apart:e} m/s");
    }
}

#[test]
fn a_closed_valve_holds_the_load() {
    // No more can leak than the least opening lets through, turbulent, at the whole pressure.
    for solver in [ADAPTIVE, FIXED] {
        for lift in LiftName::BOTH {
            for load_kg in [0.0, 800.0, 1500.0] {
                for oil_temperature_degc in [-20.0, 20.0, 60.0, 100.0] {
                    let lowering = Lowering { lift, load_kg, oil_temperature_degc, command: &[0.0; 500] };
                    let run = lowering.run(&truck_with(&[]), solver).unwrap();
                    let (x, p) = (column(&run, state::POSITION), column(&run, state::PRESSURE));
                    let area = if lift == LiftName::Free { 0.0023758 } else { 0.0025133 };
                    let leak = 0.67 * 1e-9 * (2.0 * p[0] / 860.0).sqrt() / area;
                    let sunk = x[0] - x[499];
                    // The springing mast moves by less than a tenth of a millimetre more.
                    let most = leak * 499.0 * TICK + 1e-4;
                    let place = format!("{} {load_kg} kg, {oil_temperature_degc} degC, {solver:?}", lift.as_str());
                    assert!(sunk > -1e-4 && sunk < most, "{place}: sank {sunk:e} m of {most:e}");
                    assert!(sunk < 1e-3, "{place}: more than a millimetre in ten seconds, {sunk:e} m");
                }
            }
        }
    }
}

/// A lift over a short stroke, lowered onto its stop within a second and a half.
fn short() -> Truck {
    truck_with(&[("free.cylinder.stroke_lower", 0.85), ("main.cylinder.stroke_lower", 1.8)])
}

#[test]
fn a_lift_lowered_onto_its_stop_comes_to_rest_exactly_there_and_never_goes_below() {
    for solver in [ADAPTIVE, FIXED, Solver::Adaptive { tolerance: 1e-8 }] {
        for (lift, stop) in [(LiftName::Free, 0.85), (LiftName::Main, 1.8)] {
            for load_kg in [0.0, 1500.0] {
                let command = [vec![0.9; 150], vec![0.0; 50]].concat();
                let lowering = Lowering { lift, load_kg, oil_temperature_degc: 40.0, command: &command };
                let run = lowering.run(&short(), solver).unwrap();
                let (x, v) = (column(&run, state::POSITION), column(&run, state::VELOCITY));
                let place = format!("{} {load_kg} kg, {solver:?}", lift.as_str());
                // The adaptive integrator sees the stop to a tenth of a nanometre.
                assert!(x.iter().all(|&x| x >= stop - 1e-9), "{place}");
                assert!(x[10] > stop && v[40] < -0.05, "{place}: no lowering before");
                for k in 140..200 {
                    assert!(x[k] == stop && v[k] == 0.0, "{place}: {} m, {} m/s at sample {k}", x[k], v[k]);
                }
            }
        }
    }
}

#[test]
fn a_lift_on_its_stop_rises_again_when_the_pressure_does_and_comes_back() {
    for solver in [ADAPTIVE, FIXED] {
        let command = [0.0; 150];
        let lowering = Lowering { lift: LiftName::Free, load_kg: 800.0, oil_temperature_degc: 40.0, command: &command };
        let landed = Lowering { command: &[0.9; 150], ..lowering }.run(&short(), solver).unwrap();
        let mut start = landed.states[149 * STATES..].to_vec();
        assert_eq!((start[state::POSITION], start[state::VELOCITY]), (0.85, 0.0));
        // Pressed up with one and a half times its weight, with the valve closed again.
        start[..3].fill(0.0);
        start[state::PRESSURE] = 1.5 * 8.963e6;
        let run = lowering.run_from(&short(), solver, Some(&start)).unwrap();
        let (x, v) = (column(&run, state::POSITION), column(&run, state::VELOCITY));
        let highest = x.iter().copied().fold(0.0, f64::max);
        assert!(highest > 0.85 + 1e-3, "{solver:?}: {highest}");
        assert!(x.iter().all(|&x| x >= 0.85 - 1e-9), "{solver:?}");
        assert!(v.iter().any(|&v| v < -1e-3), "{solver:?}: it swings");
    }
}

#[test]
fn the_upper_stop_holds_a_lift_that_is_pressed_against_it() {
    for solver in [ADAPTIVE, FIXED] {
        let command = [vec![0.0; 50], vec![0.8; 100]].concat();
        let lowering = Lowering { lift: LiftName::Free, load_kg: 0.0, oil_temperature_degc: 40.0, command: &command };
        let mut start = vec![0.0; STATES];
        (start[state::POSITION], start[state::PRESSURE], start[7], start[8]) = (1.1, 8e6, 4e6, 1e-9);
        let run = lowering.run_from(&truck_with(&[]), solver, Some(&start)).unwrap();
        let (x, v) = (column(&run, state::POSITION), column(&run, state::VELOCITY));
        assert!((0..50).all(|k| x[k] == 1.1 && v[k] == 0.0), "{solver:?}");
        assert!(x[149] < 1.05, "{solver:?}: it leaves the stop once the pressure has fallen, {}", x[149]);
    }
}

#[test]
fn what_is_asked_of_a_run_does_not_change_it() {
    let command = [vec![0.0; 5], vec![0.7; 45], vec![0.3; 50]].concat();
    let time: Vec<f64> = (0..100).map(|k| k as f64 * TICK).collect();
    let both: Vec<[f64; 2]> = command.iter().map(|&u| [u, 0.0]).collect();
    let inputs = Inputs { time: &time, command: &both, oil_temperature_degc: &[40.0; 100], load_kg: 800.0 };
    for solver in [ADAPTIVE, FIXED] {
        let at = |wanted: &[f64]| {
            let truck = truck_with(&[]);
            simulate(&truck, Lifts::One(LiftName::Free), &inputs, wanted, solver, None, &|| false).unwrap()
        };
        let (often, seldom) = (at(&time), at(&[0.1, 0.5, time[99]]));
        assert_eq!(often.statistics, seldom.statistics, "{solver:?}");
        for (row, k) in [5, 25, 99].into_iter().enumerate() {
            let bits = |run: &Run, row: usize| -> Vec<u64> {
                run.states[row * STATES..(row + 1) * STATES].iter().map(|x| x.to_bits()).collect()
            };
            assert_eq!(bits(&seldom, row), bits(&often, k), "{solver:?} at {} s", time[k]);
        }
    }
}

#[test]
fn lifts_that_nothing_joins_move_as_if_alone() {
    let command: Vec<[f64; 2]> = (0..100).map(|k| if k < 5 { [0.0; 2] } else { [0.6, 0.8] }).collect();
    let truck = truck_with(&[]);
    let both = run_both(&truck, 800.0, 40.0, &command, FIXED, usize::MAX).unwrap();
    for (place, lift) in LiftName::BOTH.into_iter().enumerate() {
        let own: Vec<f64> = command.iter().map(|u| u[place]).collect();
        let lowering = Lowering { lift, load_kg: 800.0, oil_temperature_degc: 40.0, command: &own };
        let alone = lowering.run(&truck, FIXED).unwrap();
        for (row, pair) in both.states.chunks_exact(2 * STATES).enumerate() {
            let single = &alone.states[row * STATES..(row + 1) * STATES];
            assert_eq!(&pair[place * STATES..(place + 1) * STATES], single, "{} at row {row}", lift.as_str());
        }
    }
}

/// What a lift does whose neighbour has landed and is opened: nothing, however their masses are joined.
#[test]
fn a_lift_that_has_landed_takes_no_other_with_it() {
    let tyres = [
        ("chassis_compliance.compliance", 1e-6),
        ("chassis_compliance.frequency", 2.0),
        ("chassis_compliance.damping_ratio", 0.1),
    ];
    for changes in [&[("mast_coupling.factor", 1.0)][..], &tyres[..]] {
        let truck = truck_with(changes);
        let time: Vec<f64> = (0..100).map(|k| k as f64 * TICK).collect();
        let shut = vec![[0.0, 0.0]; time.len()];
        let opened = vec![[0.5, 0.0]; time.len()];
        let oil = vec![40.0; time.len()];
        for solver in [FIXED, ADAPTIVE] {
            let run = |command: &[[f64; 2]], start: Option<&[f64]>| {
                let inputs = Inputs { time: &time, command, oil_temperature_degc: &oil, load_kg: 1500.0 };
                simulate(&truck, Lifts::Both, &inputs, &time, solver, start, &|| false).unwrap()
            };
            let n = run(&shut, None).state_names.len();
            let mut landed = run(&shut, None).states[..n].to_vec();
            landed[state::POSITION] = 0.0;
            let found = run(&opened, Some(&landed));
            let main = |k: usize, what: usize| found.states[k * n + STATES + what];
            // The free lift's cylinder empties onto its stop, and nothing else happens.
            let last = time.len() - 1;
            assert!(found.states[last * n + state::PRESSURE] < 0.5 * landed[state::PRESSURE]);
            assert_eq!(found.states[last * n + state::POSITION], 0.0);
            for k in 0..=last {
                assert!(
                    main(k, state::VELOCITY).abs() < 1e-3,
                    "{changes:?} {solver:?} {k}: {}",
                    main(k, state::VELOCITY)
                );
            }
            assert!((main(last, state::POSITION) - main(0, state::POSITION)).abs() < 1e-3);
        }
    }
}

#[test]
fn rates_that_are_no_numbers_are_told_at_once() {
    let truck = truck_with(&[]);
    let (time, command, oil) = ([0.0, 1.0], [[0.0; 2]; 2], [40.0; 2]);
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &oil, load_kg: 0.0 };
    let lifts = Lifts::One(LiftName::Free);
    let mut start =
        simulate(&truck, lifts, &inputs, &time, ADAPTIVE, None, &|| false).unwrap().states[..STATES].to_vec();
    start[state::POSITION + 2] = 1e306;
    let refused = simulate(&truck, lifts, &inputs, &time, ADAPTIVE, Some(&start), &|| false).unwrap_err();
    assert_eq!(refused.code(), "not-finite");
}
