//! Steady lowering against the end of long simulations, difference quotients and the bounds of the parameters.

mod common;

use common::space::{cases, inside, trucks, values_near_the_thesis};
use common::{column, state, thesis_values, truck_with, Lowering, TICK};
use hydro_core::effects::Instance;
use hydro_core::error::Error;
use hydro_core::mast::{LiftName, STATES};
use hydro_core::parameters::Scale;
use hydro_core::run::Solver;
use hydro_core::steady::{settle, Along, Known, Point, Settled};
use hydro_core::truck::{Truck, Value};
use proptest::prelude::*;

const LIFTS: [LiftName; 2] = LiftName::BOTH;

fn loaded(current: f64, bend: f64, load: f64, celsius: f64) -> Point {
    Point { current, bend, known: Known::Load(load), oil_temperature_degc: celsius }
}

fn at(truck: &Truck, lift: LiftName, point: Point) -> Settled {
    settle(truck, lift, &[point], &[]).unwrap().remove(0)
}

/// A truck with a mast so tall that friction's bristle bends fully before the lift is down.
fn tall(changes: &[(&str, f64)]) -> Truck {
    let strokes = LIFTS.map(|lift| (format!("{}.cylinder.stroke_upper", lift.as_str()), 20.0));
    let all: Vec<(&str, f64)> = changes.iter().copied().chain(strokes.iter().map(|(n, v)| (n.as_str(), *v))).collect();
    truck_with(&all)
}

/// Velocity and pressure after a lowering from 19 m: the current held high or low first, then at `current`.
fn simulated(truck: &Truck, lift: LiftName, before: f64, current: f64, load: f64, celsius: f64) -> (f64, f64) {
    let mut command = vec![before; 100];
    let speed = at(truck, lift, loaded(current, 1.0, load, celsius)).values[0].abs().max(1e-3);
    // Ten bristle lengths of a metre or two, within the mast.
    let length = ((14.0 / speed).min(400.0) / TICK) as usize;
    command.extend(vec![current; length]);
    let lowering = Lowering { lift, load_kg: load, oil_temperature_degc: celsius, command: &command };
    let rest = lowering.run(truck, Solver::Adaptive { tolerance: 1e-6 }).unwrap();
    let mut start = rest.states[..STATES].to_vec();
    start[state::POSITION] = 19.5;
    let run = lowering.run_from(truck, Solver::Adaptive { tolerance: 1e-9 }, Some(&start)).unwrap();
    (*column(&run, state::VELOCITY).last().unwrap(), *column(&run, state::PRESSURE).last().unwrap())
}

#[test]
fn a_long_lowering_at_constant_current_ends_in_the_steady_state() {
    let truck = tall(&[]);
    for (lift, load, celsius, current) in [
        (LiftName::Free, 0.0, 20.0, 0.7),
        (LiftName::Free, 1500.0, 60.0, 1.1),
        (LiftName::Main, 0.0, 60.0, 0.8),
        (LiftName::Main, 800.0, 20.0, 1.1),
    ] {
        // From shut the current rises, from wide open it falls.
        for (before, bend) in [(0.0, 1.0), (1.5, -1.0)] {
            let (v, p) = simulated(&truck, lift, before, current, load, celsius);
            let steady = at(&truck, lift, loaded(current, bend, load, celsius)).values;
            assert!((steady[0] / v - 1.0).abs() < 2e-4, "{lift:?} {load} {celsius} {bend}: {} not {v}", steady[0]);
            assert!((steady[1] / p - 1.0).abs() < 1e-4, "{lift:?} {load} {celsius} {bend}: {} not {p}", steady[1]);
        }
    }
}

#[test]
fn with_effects_too_a_long_lowering_ends_in_the_steady_state() {
    let effects =
        [("free.leakage.coefficient", 5e-12), ("free.friction_temperature.rate", 0.02), ("mast_coupling.factor", 0.0)];
    let without = at(&tall(&[]), LiftName::Free, loaded(0.7, 1.0, 800.0, 50.0)).values;
    for count in [2, 3] {
        let truck = tall(&effects[..count]);
        let steady = at(&truck, LiftName::Free, loaded(0.7, 1.0, 800.0, 50.0)).values;
        let (v, p) = simulated(&tall(&effects[..2]), LiftName::Free, 0.0, 0.7, 800.0, 50.0);
        assert!((steady[0] / v - 1.0).abs() < 2e-4 && (steady[1] / p - 1.0).abs() < 1e-4, "{steady:?} not {v} {p}");
        assert!(steady[0] < without[0] - 1e-3 && steady[1] > without[1]);
    }
}

#[test]
fn under_every_effect_of_the_catalogue_there_is_a_steady_lowering() {
    for instance in Instance::all() {
        let parameters = instance.kind.spec().parameters.iter().enumerate();
        let changes: Vec<(String, f64)> = parameters
            .map(|(k, p)| (format!("{}.{}", instance.name(), p.name), common::space::plausible(&instance, k)))
            .collect();
        let truck = truck_with(&changes.iter().map(|(name, value)| (name.as_str(), *value)).collect::<Vec<_>>());
        for lift in LIFTS {
            for (current, load, celsius) in [(0.7, 800.0, 50.0), (0.6, 0.0, 10.0)] {
                let by_load = settle(&truck, lift, &[loaded(current, 1.0, load, celsius)], &[]);
                let by_load = by_load.unwrap_or_else(|error| panic!("{}: {error}", instance.name())).remove(0).values;
                assert!(by_load[0] < -1e-3 && by_load[1] > 1e5, "{}: {by_load:?}", instance.name());
            }
        }
    }
}

#[test]
fn the_steady_pressure_under_a_load_gives_the_same_velocity() {
    let truck = truck_with(&[("main.leakage.coefficient", 1e-12)]);
    for lift in LIFTS {
        for bend in [-1.0, 0.2] {
            let by_load = at(&truck, lift, loaded(0.9, bend, 700.0, 35.0)).values;
            let known = Known::Pressure { pressure: by_load[1], rate: 0.0 };
            let by_pressure = at(&truck, lift, Point { known, ..loaded(0.9, bend, 0.0, 35.0) }).values;
            assert!((by_pressure[0] / by_load[0] - 1.0).abs() < 1e-11, "{by_pressure:?} {by_load:?}");
        }
    }
}

#[test]
fn a_cylinder_that_is_being_relieved_gives_oil_and_sinks_more_slowly() {
    // dp_A/dt = E/V·(−q_A − A·v).
    let truck = truck_with(&[]);
    let known = |rate| Point { known: Known::Pressure { pressure: 6e6, rate }, ..loaded(0.9, 1.0, 0.0, 35.0) };
    let [still, falling, rising] = [0.0, -3e5, 3e5].map(|rate| at(&truck, LiftName::Free, known(rate)).values[0]);
    assert!(falling > still && still > rising && (falling + rising - 2.0 * still).abs() < 1e-12);
    let leaky = truck_with(&[("free.leakage.coefficient", 0.0)]);
    assert!((at(&leaky, LiftName::Free, known(-3e5)).values[0] / falling - 1.0).abs() < 1e-11);
}

#[test]
fn a_shut_valve_lets_the_lift_creep_and_a_held_load_stands_still() {
    let creep = at(&truck_with(&[]), LiftName::Free, loaded(0.0, 1.0, 800.0, 40.0)).values;
    assert!(creep[0] < 0.0 && creep[0] > -1e-4, "{creep:?}");
    let stuck = truck_with(&[("free.friction.F_pr", 2e4)]);
    let stuck = settle(&stuck, LiftName::Free, &[loaded(1.0, 1.0, 0.0, 40.0)], &[Along::Current]).unwrap();
    assert_eq!(stuck[0], Settled { values: [0.0, 1e5], derivatives: [vec![0.0], vec![0.0]] });
}

#[test]
fn a_point_out_of_range_is_refused_with_its_value() {
    let good = loaded(0.9, 1.0, 700.0, 35.0);
    let bad = [
        ("current", Point { current: f64::NAN, ..good }),
        ("bend", Point { bend: 1.5, ..good }),
        ("load", Point { known: Known::Load(-1.0), ..good }),
        ("pressure", Point { known: Known::Pressure { pressure: -1.0, rate: 0.0 }, ..good }),
        ("pressure_rate", Point { known: Known::Pressure { pressure: 1e6, rate: f64::INFINITY }, ..good }),
        ("oil_temperature", Point { oil_temperature_degc: 500.0, ..good }),
    ];
    for (what, point) in bad {
        match settle(&truck_with(&[]), LiftName::Free, &[good, point], &[]) {
            Err(Error::Argument { name, .. }) => assert_eq!(name, what),
            other => panic!("{what}: {other:?}"),
        }
    }
}

fn changed(values: &std::collections::BTreeMap<String, Value>, name: &str, change: f64) -> Truck {
    let mut values = values.clone();
    match name.rsplit_once('.').map(|(table, knot)| (table, knot.parse::<usize>())) {
        Some((table, Ok(knot))) => {
            let Some(Value::Table(table)) = values.get_mut(table) else { unreachable!() };
            table[knot] += change;
        }
        _ => {
            let Some(Value::Number(value)) = values.get_mut(name) else { unreachable!() };
            *value += change;
        }
    }
    Truck::from_values(values).unwrap()
}

#[test]
fn derivatives_are_difference_quotients() {
    let mut values = thesis_values();
    for (name, value) in [("free.leakage.coefficient", 2e-12), ("free.friction_temperature.rate", 0.01)] {
        values.insert(name.into(), Value::Number(value));
    }
    for with_effects in [false, true] {
        if !with_effects {
            values.retain(|name, _| !name.contains("leakage") && !name.contains("friction_temperature"));
        }
        let truck = Truck::from_values(values.clone()).unwrap();
        let names = truck.names();
        let along: Vec<Along> = (0..names.len()).map(Along::Parameter).collect();
        for known in [Known::Load(700.0), Known::Pressure { pressure: 7e6, rate: -2e5 }] {
            // In the middle of a segment of the table.
            let point = Point { known, ..loaded(0.93, 0.8, 0.0, 41.0) };
            let found = settle(&truck, LiftName::Free, &[point], &along).unwrap().remove(0);
            for (k, name) in names.iter().enumerate() {
                let size = truck.values()[k].abs();
                let h = 1e-5 * if size > 0.0 { size } else { 1.0 };
                if name.contains("stroke") || name.contains(".0") || size == 0.0 {
                    continue;
                }
                let [below, above] =
                    [-h, h].map(|change| at(&changed(&values, name, change), LiftName::Free, point).values);
                for j in 0..2 {
                    let quotient = (above[j] - below[j]) / (2.0 * h);
                    let (scale, got) = ([0.3, 7e6][j] / size, found.derivatives[j][k]);
                    assert!((quotient - got).abs() < 1e-6 * quotient.abs() + 1e-8 * scale, "{name}: {got}, {quotient}");
                }
            }
        }
    }
}

#[test]
fn derivatives_along_current_load_pressure_and_temperature_are_difference_quotients() {
    let truck = truck_with(&[]);
    let along = [Along::Current, Along::Known, Along::OilTemperature];
    for known in [Known::Load(700.0), Known::Pressure { pressure: 7e6, rate: 0.0 }] {
        let point = Point { known, ..loaded(0.93, -1.0, 0.0, 41.0) };
        let found = settle(&truck, LiftName::Main, &[point], &along).unwrap().remove(0);
        let moved = |k: usize, h: f64| match (k, point.known) {
            (0, _) => Point { current: point.current + h, ..point },
            (1, Known::Load(load)) => Point { known: Known::Load(load + h), ..point },
            (1, Known::Pressure { pressure, rate }) => {
                Point { known: Known::Pressure { pressure: pressure + h, rate }, ..point }
            }
            _ => Point { oil_temperature_degc: point.oil_temperature_degc + h, ..point },
        };
        let steps = [1e-4, if matches!(known, Known::Load(_)) { 0.1 } else { 1e3 }, 1e-2];
        for (k, h) in steps.into_iter().enumerate() {
            for j in 0..2 {
                let [below, above] = [-h, h].map(|h| at(&truck, LiftName::Main, moved(k, h)).values[j]);
                let (quotient, got) = ((above - below) / (2.0 * h), found.derivatives[j][k]);
                let scale = [0.3, 7e6][j] / h;
                assert!((quotient - got).abs() < 1e-5 * quotient.abs() + 1e-12 * scale, "{k} {j}: {got}, {quotient}");
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(300))]
    #[test]
    fn anywhere_within_the_bounds_it_is_finite_and_lowers(
        truck in trucks(), main in any::<bool>(), current in -0.1..2.5f64, bend in -1.0..=1.0f64,
        load in 0.0..2e4f64, celsius in -50.0..150.0f64, pressure in inside(1e3, 1e9, Scale::Log),
    ) {
        let lift = LIFTS[usize::from(main)];
        for known in [Known::Load(load), Known::Pressure { pressure, rate: 0.0 }] {
            let point = Point { current, bend, known, oil_temperature_degc: celsius };
            let found = settle(&truck, lift, &[point], &[]).unwrap();
            let [v, p] = found[0].values;
            prop_assert!(v.is_finite() && v <= 0.0 && p.is_finite() && p > 0.0, "{:?}", found);
        }
    }

    #[test]
    fn near_the_thesis_its_derivatives_are_finite_and_more_current_is_faster(
        values in values_near_the_thesis(2.0), main in any::<bool>(), current in 0.0..1.3f64, bend in -1.0..=1.0f64,
        load in 0.0..2e3f64, celsius in 0.0..80.0f64,
    ) {
        let truck = Truck::from_values(values).unwrap();
        let lift = LIFTS[usize::from(main)];
        let along: Vec<Along> = (0..truck.names().len()).map(Along::Parameter).chain([Along::Current]).collect();
        let found = settle(&truck, lift, &[loaded(current, bend, load, celsius)], &along).unwrap().remove(0);
        prop_assert!(found.derivatives.iter().flatten().all(|d| d.is_finite()));
        prop_assert!(found.derivatives[0][along.len() - 1] <= 0.0);
        let more = at(&truck, lift, loaded(current + 0.05, bend, load, celsius));
        prop_assert!(more.values[0] <= found.values[0] + 1e-9);
    }
}
