//! Free shapes: as steep as their bounds allow, and as a search starts from them.

mod common;

use common::{thesis_values, TICK};
use hydro_core::effects::VARIABLES;
use hydro_core::mast::{LiftName, STATES};
use hydro_core::outputs::OUTPUTS;
use hydro_core::ports::PORTS;
use hydro_core::run::sensitivity::{differentiate, Case, Direction, Sensitivity};
use hydro_core::run::{simulate, Inputs, Lifts, Run, Solver};
use hydro_core::truck::{Truck, Value};

/// The thesis's truck with a free shape on one lift.
fn truck(lift: LiftName, port: usize, variable: usize, shape: [f64; 7], range: [f64; 2], lag: f64) -> Truck {
    let mut values = thesis_values();
    let mut set = |name: &str, value: f64| {
        values.insert(format!("{}.free_shape.{name}", lift.as_str()), Value::Number(value));
    };
    for (k, c) in shape.into_iter().enumerate() {
        set(&format!("shape_{k}"), c);
    }
    set("port", port as f64);
    set("variable", variable as f64);
    set("lower", range[0]);
    set("upper", range[1]);
    set("lag", lag);
    set("fades", 0.0);
    Truck::from_values(values).unwrap()
}

/// Where a lowering takes a variable.
fn range(lift: LiftName, variable: &str) -> [f64; 2] {
    match variable {
        "position" => [lift.start_position() - 0.6, lift.start_position()],
        "velocity" | "other_velocity" => [-0.4, 0.1],
        "speed" => [0.0, 0.4],
        "pressure" => [2e6, 1.4e7],
        "oil_temperature" => [-20.0, 100.0],
        "load" => [0.0, 1500.0],
        "command" => [0.0, 1.1],
        _ => [0.0, 2.0],
    }
}

/// Opened, half shut, opened wide, shut, opened, shut.
const LEVELS: [f64; 7] = [0.0, 0.7, 0.5, 1.1, 0.0, 0.6, 0.0];
const ROWS: usize = 25 * LEVELS.len();

fn times() -> Vec<f64> {
    (0..ROWS).map(|k| k as f64 * TICK).collect()
}

fn commands() -> Vec<[f64; 2]> {
    (0..ROWS).map(|k| [LEVELS[k / 25]; 2]).collect()
}

/// As high as the bounds allow: rising, falling, to and fro; and level, whatever the variable.
fn shapes(variable: usize) -> Vec<[f64; 7]> {
    const TOP: f64 = 1.7;
    let ramp: [f64; 7] = std::array::from_fn(|k| TOP * (k as f64 - 3.0) / 3.0);
    let teeth: [f64; 7] = std::array::from_fn(|k| if k % 2 == 0 { TOP } else { -TOP });
    let level = if variable == 0 { vec![[TOP; 7], [-TOP; 7]] } else { vec![] };
    [vec![ramp, ramp.map(|c| -c), teeth], level].concat()
}

/// Root mean square of how far two runs are apart in one state, and the largest value it has in the first.
fn apart(a: &Run, b: &Run, state: usize) -> (f64, f64) {
    let of = |run: &Run| run.states.iter().skip(state).step_by(run.state_names.len()).copied().collect::<Vec<f64>>();
    let (a, b) = (of(a), of(b));
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    ((squares / a.len() as f64).sqrt(), a.iter().fold(0.0, |most: f64, x| most.max(x.abs())))
}

#[test]
fn however_steep_the_shape_four_substeps_a_tick_follow_sixteen() {
    let (time, command) = (times(), commands());
    let mut lost = Vec::new();
    let mut follow = |truck: &Truck, load_kg: f64, celsius: f64, place: String| {
        let temperature = [celsius; ROWS];
        let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &temperature, load_kg };
        let [a, b] = [4, 16].map(|substeps| {
            simulate(truck, Lifts::Both, &inputs, &time, Solver::Fixed { substeps }, None, &|| false).unwrap()
        });
        // Velocity and pressure; both stay where trucks are.
        for (state, close, most) in [(4, 0.02, 2.0), (6, 5e5, 8e7)] {
            for state in [state, STATES + state] {
                let (got, largest) = apart(&a, &b, state);
                if !(got < close && largest < most) {
                    lost.push(format!("{place}: state {state} is {got:e} apart, {largest:e} at most"));
                }
            }
        }
    };
    for lift in LiftName::BOTH {
        for (port, port_spec) in PORTS.iter().enumerate() {
            for (variable, spec) in VARIABLES.iter().enumerate() {
                for shape in shapes(variable) {
                    let truck = truck(lift, port, variable, shape, range(lift, spec.name), 0.0);
                    for (load_kg, celsius) in [(0.0, 80.0), (1500.0, 0.0)] {
                        let place = format!("{} over {}, {shape:?}, {load_kg} kg", port_spec.name, spec.name);
                        follow(&truck, load_kg, celsius, place);
                    }
                }
            }
        }
    }
    assert!(lost.is_empty(), "{}", lost.join("\n"));
}

fn velocities(outputs: &[f64], width: usize) -> impl Iterator<Item = &[f64]> {
    outputs.chunks_exact(width * OUTPUTS.len()).map(move |row| &row[2 * width..4 * width])
}

#[test]
fn from_nothing_the_derivative_tells_of_each_coefficient_by_itself_and_of_the_lag() {
    let (time, command) = (times(), commands());
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &[40.0; ROWS], load_kg: 700.0 };
    let case = Case {
        inputs,
        wanted: &time,
        warmer: 0.0,
        warming: 0.0,
        start: LiftName::BOTH.map(LiftName::start_position),
        command_slope: &[],
    };
    let force = PORTS.iter().position(|port| port.name == "force").unwrap();
    let with = |shape, lag| truck(LiftName::Main, force, 1, shape, [-0.2, 0.0], lag);
    let differentiate = |truck: &Truck, along: &[&str]| {
        let names = truck.names();
        let place = |name: &&str| names.iter().position(|n| n == &format!("main.free_shape.{name}")).unwrap();
        let along: Vec<Direction> = along.iter().map(place).map(Direction::Parameter).collect();
        differentiate(truck, &case, 4, &along, &|| false).unwrap()
    };
    let check = |exact: &[f64], quotient: &[f64], what: &str| {
        let most = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let off = exact.iter().zip(quotient).fold(0.0, |off: f64, (a, b)| off.max((a - b).abs()));
        assert!(most > 1e-4 && off < 0.02 * most, "{what}: {off:e} of {most:e}");
    };
    let columns = |all: &Sensitivity, d: usize, n: usize| -> Vec<f64> {
        velocities(&all.derivatives, n).flat_map(|row| row.iter().skip(d).step_by(n)).copied().collect()
    };
    let quotient = |a: &Sensitivity, b: &Sensitivity, step: f64| -> Vec<f64> {
        let rows = velocities(&a.outputs, 1).zip(velocities(&b.outputs, 1));
        rows.flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (b - a) / step).collect::<Vec<_>>()).collect()
    };
    let names: [String; 7] = std::array::from_fn(|k| format!("shape_{k}"));
    let quiet = differentiate(&with([0.0; 7], 0.0), &names.each_ref().map(String::as_str));
    for k in 0..7 {
        let step = 1e-4;
        let moved = with(std::array::from_fn(|j| if j == k { step } else { 0.0 }), 0.0);
        check(&columns(&quiet, k, 7), &quotient(&quiet, &differentiate(&moved, &[]), step), &names[k]);
    }
    // A lag of none is the start of one of some milliseconds.
    let ramp = std::array::from_fn(|k| 0.2 * k as f64 - 0.6);
    let at_none = differentiate(&with(ramp, 0.0), &["lag"]);
    let late = differentiate(&with(ramp, 1e-4), &[]);
    check(&columns(&at_none, 0, 1), &quotient(&at_none, &late, 1e-4), "lag");
}

#[test]
fn what_depends_on_the_other_lift_is_run_with_it() {
    let (time, command) = (times(), commands());
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &[40.0; ROWS], load_kg: 700.0 };
    let other = VARIABLES.iter().position(|v| v.name == "other_velocity").unwrap();
    let force = PORTS.iter().position(|port| port.name == "force").unwrap();
    let truck = truck(LiftName::Free, force, other, [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8], [-0.3, 0.0], 0.0);
    assert!(truck.joined());
    let one = Lifts::One(LiftName::Free);
    let alone = simulate(&truck, one, &inputs, &time, Solver::Fixed { substeps: 4 }, None, &|| false);
    assert_eq!(alone.unwrap_err().code(), "effect-needs-both-lifts");
    let main = Lifts::One(LiftName::Main);
    simulate(&truck, main, &inputs, &time, Solver::Fixed { substeps: 4 }, None, &|| false).unwrap();
    let run = simulate(&truck, Lifts::Both, &inputs, &time, Solver::Fixed { substeps: 4 }, None, &|| false).unwrap();
    let case = Case {
        inputs,
        wanted: &time,
        warmer: 0.0,
        warming: 0.0,
        start: LiftName::BOTH.map(LiftName::start_position),
        command_slope: &[],
    };
    let joint = differentiate(&truck, &case, 4, &[], &|| false).unwrap();
    for (row, outputs) in run.states.chunks_exact(run.state_names.len()).zip(joint.outputs.chunks_exact(OUTPUTS.len()))
    {
        assert!((2.0 * row[4] - outputs[2]).abs() < 1e-9 && (row[STATES + 4] - outputs[3]).abs() < 1e-9);
    }
}

#[test]
fn a_run_starts_with_the_variable_where_it_is() {
    let (time, command) = (times(), commands());
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &[40.0; ROWS], load_kg: 700.0 };
    let temperature = VARIABLES.iter().position(|v| v.name == "oil_temperature").unwrap();
    let truck = truck(LiftName::Free, 0, temperature, [0.1; 7], [0.0, 80.0], 20.0);
    for solver in [Solver::Fixed { substeps: 4 }, Solver::Adaptive { tolerance: 1e-5 }] {
        let run = simulate(&truck, Lifts::Both, &inputs, &time, solver, None, &|| false).unwrap();
        let place = run.state_names.iter().position(|name| name == "free.free_shape.spot").unwrap();
        assert!(run.states.iter().skip(place).step_by(run.state_names.len()).all(|y| (y - 0.5).abs() < 1e-12));
    }
}
