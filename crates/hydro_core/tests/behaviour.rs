//! What the thesis saw on its truck (Fri & Fahlén 2017, chapters 4 and 5), in the model with its values.

mod common;

use common::{column, references, replay, state, truck_with, Lowering, Reference, TICK};
use hydro_core::mast::LiftName;
use hydro_core::run::{Run, Solver};

const SOLVER: Solver = Solver::Adaptive { tolerance: 1e-6 };
const LOADS: [f64; 5] = [0.0, 400.0, 800.0, 1200.0, 1500.0];
const TEMPERATURES: [f64; 3] = [20.0, 40.0, 60.0];

/// Downward speed of a cylinder after its command has stepped from zero to `current` [A], at 50 Hz.
fn response(lift: LiftName, current: f64, load_kg: f64, oil_temperature_degc: f64) -> Vec<f64> {
    let mut command = vec![0.0; 25];
    command.resize(25 + 200, current);
    let run =
        Lowering { lift, load_kg, oil_temperature_degc, command: &command }.run(&truck_with(&[]), SOLVER).unwrap();
    assert!(column(&run, state::POSITION).iter().all(|&x| x > 0.1), "the lift has come near its stop");
    column(&run, state::VELOCITY)[25..].iter().map(|v| -v).collect()
}

/// Mean speed over the last half second [m/s].
fn steady(speed: &[f64]) -> f64 {
    speed[speed.len() - 25..].iter().sum::<f64>() / 25.0
}

struct Swing {
    /// How far the first crest goes beyond the steady speed [m/s].
    overshoot: f64,
    /// Time from the first crest to the second [s].
    period: f64,
    /// Rise to the second crest over fall from the first.
    persistence: f64,
}

fn swing(speed: &[f64]) -> Swing {
    // Crests and troughs between the samples, by the parabola through three of them.
    let turns: Vec<(f64, f64)> = (10..speed.len() - 1)
        .filter(|&k| (speed[k] - speed[k - 1]) * (speed[k + 1] - speed[k]) < 0.0)
        .map(|k| {
            let (slope, bend) = (speed[k + 1] - speed[k - 1], speed[k - 1] - 2.0 * speed[k] + speed[k + 1]);
            let shift = -0.5 * slope / bend;
            ((k as f64 + shift) * TICK, speed[k] + 0.25 * slope * shift)
        })
        .collect();
    let [crest, trough, next] = turns[..3] else { unreachable!() };
    Swing {
        overshoot: crest.1 - steady(speed),
        period: next.0 - crest.0,
        persistence: (next.1 - trough.1) / (crest.1 - trough.1),
    }
}

/// Largest over smallest steady speed, less one, over the loads.
fn spread_over_loads(lift: LiftName, current: f64, temperature: f64) -> f64 {
    let speeds = LOADS.map(|load| steady(&response(lift, current, load, temperature)));
    speeds.iter().copied().fold(0.0, f64::max) / speeds.iter().copied().fold(f64::INFINITY, f64::min) - 1.0
}

#[test]
fn the_free_lifts_steady_speed_does_not_depend_on_the_load() {
    for current in [0.5, 0.6, 0.7, 0.8, 0.9] {
        for temperature in TEMPERATURES {
            let spread = spread_over_loads(LiftName::Free, current, temperature);
            assert!(spread < 0.05, "{current} A, {temperature} degC: {spread:.3}");
        }
    }
}

#[test]
fn the_main_lifts_steady_speed_hardly_depends_on_the_load() {
    for current in [0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
        for temperature in TEMPERATURES {
            let spread = spread_over_loads(LiftName::Main, current, temperature);
            assert!(spread < 0.10, "{current} A, {temperature} degC: {spread:.3}");
        }
    }
}

#[test]
fn without_the_compensator_the_speed_depends_on_the_load() {
    // With p_set far above every pressure the compensator stays open: the speed then follows the root of the pressure.
    let truck = truck_with(&[("free.compensator.p_set", 1e7), ("free.compensator.p_reg", 1e4)]);
    let speed = |load_kg: f64| {
        let lowering = Lowering { lift: LiftName::Free, load_kg, oil_temperature_degc: 40.0, command: &[0.6; 150] };
        -column(&lowering.run(&truck, SOLVER).unwrap(), state::VELOCITY)[149]
    };
    assert!(speed(800.0) / speed(0.0) > 1.5);
}

#[test]
fn both_lifts_lower_faster_in_warm_oil() {
    for lift in LiftName::BOTH {
        for current in [0.5, 0.7, 0.9] {
            for load in LOADS {
                let [cold, _, warm] = TEMPERATURES.map(|t| steady(&response(lift, current, load, t)));
                let gain = warm / cold;
                assert!((1.1..1.5).contains(&gain), "{} {current} A, {load} kg: {gain:.3}", lift.as_str());
            }
        }
    }
}

#[test]
fn a_heavier_load_oscillates_more_and_longer() {
    for lift in LiftName::BOTH {
        for current in [0.6, 0.8] {
            for temperature in TEMPERATURES {
                let responses = LOADS.map(|load| swing(&response(lift, current, load, temperature)));
                for (k, pair) in responses.windows(2).enumerate() {
                    let place = format!("{} {current} A, {temperature} degC, {} kg", lift.as_str(), LOADS[k + 1]);
                    assert!(pair[1].overshoot > 1.02 * pair[0].overshoot, "{place}: overshoot");
                    assert!(pair[1].persistence > 1.02 * pair[0].persistence, "{place}: persistence");
                    assert!(pair[1].period > 1.02 * pair[0].period, "{place}: period");
                }
            }
        }
    }
}

#[test]
fn warm_oil_oscillates_more() {
    for lift in LiftName::BOTH {
        for current in [0.6, 0.8] {
            for load in [800.0, 1500.0] {
                let overshoots = TEMPERATURES.map(|t| swing(&response(lift, current, load, t)).overshoot);
                let grows = overshoots.windows(2).all(|pair| pair[1] > 1.05 * pair[0]);
                assert!(grows, "{} {current} A, {load} kg: {overshoots:?}", lift.as_str());
            }
        }
    }
}

#[test]
fn the_oscillations_period_is_about_four_tenths_of_a_second() {
    // Section 4.5.2, at a usual load.
    for current in [0.6, 0.8] {
        for temperature in TEMPERATURES {
            let period = swing(&response(LiftName::Free, current, 800.0, temperature)).period;
            assert!((0.35..0.5).contains(&period), "{current} A, {temperature} degC: {period:.3} s");
        }
    }
}

fn recording(name: &str) -> (Run, Reference) {
    let reference = references().into_iter().find(|r| r.name == name).unwrap();
    (replay(&truck_with(&[]), &reference, SOLVER), reference)
}

#[test]
fn the_forks_come_down_as_fast_as_measured() {
    // Figures 5.8d and 5.9d: some 0.8 m/s on the free lift and 1.2 m/s on the main lift; forks move twice as far.
    for (name, range) in [("free_prms1_1500kg_60c", 0.65..0.85), ("main_prms1_1500kg_60c", 0.95..1.3)] {
        let (run, _) = recording(name);
        let fastest = 2.0 * column(&run, state::VELOCITY).into_iter().fold(0.0, |m: f64, v| m.max(-v));
        assert!(range.contains(&fastest), "{name}: {fastest:.3} m/s");
    }
}

#[test]
fn at_800_kg_the_cylinders_pressure_stays_between_2_and_16_megapascals() {
    for name in ["free_prms1_800kg_40c", "main_prms1_800kg_40c"] {
        let (run, _) = recording(name);
        let p = column(&run, state::PRESSURE);
        let (least, most) = (p.iter().copied().fold(f64::INFINITY, f64::min), p.iter().copied().fold(0.0, f64::max));
        assert!(least > 2e6 && most < 16e6, "{name}: {least:.3e} to {most:.3e} Pa");
    }
}

#[test]
fn a_lift_does_not_rise_while_it_lowers_in_the_mean() {
    for reference in references() {
        let run = replay(&truck_with(&[]), &reference, SOLVER);
        let x = column(&run, state::POSITION);
        let tenth = x.len() / 10;
        assert!(x.windows(tenth).all(|w| w[tenth - 1] <= w[0] + 1e-3), "{}", reference.name);
    }
}
