//! The effects: silent at their quiet values, to the bit, and each as its equation says.

mod common;

use common::{column, state, thesis_values, truck_with, Lowering, TICK};
use hydro_core::effects::Instance;
use hydro_core::mast::{Extended, Lift, LiftName, LiftState, Mast, Physics, Thesis, STATES};
use hydro_core::outputs::OUTPUTS;
use hydro_core::parameters::ParameterSpec;
use hydro_core::run::sensitivity::{differentiate, Case, Direction};
use hydro_core::run::{simulate, Inputs, Lifts, Run, Solver};
use hydro_core::truck::{Truck, Value};

/// The thesis's truck with these effects, their amplitudes at `amplitude(specification)`, what else
/// they have in the middle of what is plausible, and where something must be met, on the lifts' way.
fn truck_with_effects(effects: &[Instance], amplitude: impl Fn(&Instance) -> f64) -> Truck {
    let mut values = thesis_values();
    let mut set = |name: String, value: f64| values.insert(name, Value::Number(value));
    for instance in effects {
        let name = instance.name();
        for (k, p) in instance.kind.spec().parameters.iter().enumerate() {
            let value = if k < instance.kind.amplitudes() {
                amplitude(instance)
            } else {
                common::space::plausible(instance, k)
            };
            set(format!("{name}.{}", p.name), value);
        }
        if let Some(lift) = instance.lift {
            match instance.kind.spec().id {
                "friction_position" => {
                    set(format!("{name}.centre"), lift.start_position() - 0.05);
                }
                "end_cushion" => {
                    set(format!("{name}.length"), 0.3);
                    set(format!("{}.cylinder.stroke_lower", lift.as_str()), lift.start_position() - 0.3);
                }
                _ => {}
            }
        }
    }
    Truck::from_values(values).unwrap()
}

fn quiet(instance: &Instance) -> f64 {
    instance.kind.spec().quiet
}

/// As loud as is plausible.
fn loud(instance: &Instance) -> f64 {
    instance.kind.spec().plausible[0][1]
}

/// Both lifts at 60 °C with 700 kg: a tenth of a second at rest, then opened, then opened wide.
fn lower(truck: &Truck, solver: Solver) -> Run {
    let time: Vec<f64> = (0..75).map(|k| f64::from(k) * TICK).collect();
    let command: Vec<[f64; 2]> = (0..75).map(|k| [[0.0; 2], [0.7, 0.8], [1.3, 1.2]][(k + 35) / 40]).collect();
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &[60.0; 75], load_kg: 700.0 };
    simulate(truck, Lifts::Both, &inputs, &time, solver, None, &|| false).unwrap()
}

const SOLVERS: [Solver; 2] = [Solver::Adaptive { tolerance: 1e-5 }, Solver::Fixed { substeps: 4 }];

/// The lifts' states, without those of effects.
fn lifts(run: &Run) -> Vec<u64> {
    let rows = run.states.chunks_exact(run.state_names.len());
    rows.flat_map(|row| row[..2 * STATES].iter().map(|x| x.to_bits())).collect()
}

#[test]
fn an_effect_at_its_quiet_value_changes_no_bit_of_a_run_in_either_solver() {
    let all: Vec<Instance> = Instance::all().collect();
    for solver in SOLVERS {
        let thesis = lower(&truck_with(&[]), solver);
        for instance in &all {
            let extended = lower(&truck_with_effects(&[*instance], quiet), solver);
            assert!(lifts(&extended) == lifts(&thesis), "{} with {solver:?}", instance.name());
        }
        assert!(lifts(&lower(&truck_with_effects(&all, quiet), solver)) == lifts(&thesis), "all with {solver:?}");
    }
}

/// Between two runs, of one state of either lift, over the first 75 rows.
fn largest_difference(a: &Run, b: &Run, state: usize) -> f64 {
    let of = |run: &Run, k: usize| [0, STATES].map(|lift| run.states[k * run.state_names.len() + lift + state]);
    (0..75).flat_map(|k| of(a, k).into_iter().zip(of(b, k))).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
}

#[test]
fn an_effect_at_another_value_changes_the_run_and_both_solvers_agree_on_how() {
    let thesis = SOLVERS.map(|solver| lower(&truck_with(&[]), solver));
    for instance in Instance::all() {
        let truck = truck_with_effects(&[instance], loud);
        let runs = SOLVERS.map(|solver| lower(&truck, solver));
        // What these feed back to valve and compensator is the pressure between them, which refills the volume
        // there within a substep.
        let sharp = ["valve_flow_force", "compensator_dynamics"].contains(&instance.kind.spec().id);
        let share = if sharp { 2.5e-2 } else { 8e-3 };
        // Velocity and pressure: what the integrators are apart without effects, and what an effect changes at least.
        for (state, close, least) in [(4, 3e-5, 1e-4), (6, 1e3, 5e3)] {
            let before = largest_difference(&thesis[0], &thesis[1], state);
            assert!(before < close, "without effects, state {state}: {before:e}");
            let change = largest_difference(&runs[0], &thesis[0], state);
            let apart = largest_difference(&runs[0], &runs[1], state);
            let place = format!("{}, state {state}: {apart:e} of {change:e}", instance.name());
            assert!(change > least && apart < 1.5 * before + share * change, "{place}");
        }
    }
}

#[test]
fn halved_substeps_quarter_the_error_where_an_effect_of_the_pressure_acts() {
    for instance in Instance::all().filter(|instance| instance.name().ends_with("leakage")) {
        let truck = truck_with_effects(&[instance], |_| 1e-10);
        let exact = lower(&truck, Solver::Adaptive { tolerance: 1e-8 });
        let errors = [2, 4, 8].map(|substeps| {
            let run = lower(&truck, Solver::Fixed { substeps });
            let rows = run.states.chunks_exact(2 * STATES).zip(exact.states.chunks_exact(2 * STATES));
            rows.flat_map(|(a, b)| [4, STATES + 4].map(|v| (a[v] - b[v]).abs())).fold(0.0, f64::max)
        });
        assert!(errors[0] > 3.5 * errors[1] && errors[1] > 3.5 * errors[2], "{}: {errors:?} m/s", instance.name());
    }
}

#[test]
fn at_one_temperature_warm_friction_is_another_coefficient_from_the_first_substep() {
    let (rate, oil_temperature_degc) = (0.03, 70.0);
    let sigma_2 = 4137.8 * (-rate * (oil_temperature_degc - 20.0f64)).exp();
    // In motion, where what the friction was before the start would show.
    let mut start = vec![0.0; STATES];
    (start[3], start[4], start[5], start[6], start[7], start[8]) = (0.9, -0.2, -0.5, 9e6, 5e6, 1e-5);
    for solver in SOLVERS {
        let runs = [("free.friction_temperature.rate", rate), ("free.friction.sigma_2", sigma_2)].map(|change| {
            let command = [0.7; 50];
            let lowering = Lowering { lift: LiftName::Free, load_kg: 700.0, oil_temperature_degc, command: &command };
            let run = lowering.run_from(&truck_with(&[change]), solver, Some(&start)).unwrap();
            column(&run, state::VELOCITY)
        });
        let apart = runs[0].iter().zip(&runs[1]).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        assert!(apart < 1e-9, "{solver:?}: {apart:e} m/s");
    }
}

#[test]
fn the_thesis_model_carries_no_state_of_the_catalogue_and_an_effect_its_own_only() {
    assert_eq!(Physics::<f64>::states(&Thesis), 0);
    assert_eq!(lower(&truck_with(&[]), SOLVERS[1]).state_names.len(), 2 * STATES);
    for instance in Instance::all() {
        let run = lower(&truck_with_effects(&[instance], quiet), SOLVERS[1]);
        assert_eq!(run.state_names.len(), 2 * STATES + instance.kind.spec().states.len(), "{}", instance.name());
    }
}

/// Rates of a moving mast under one effect, and of the same mast without it.
fn rates(name: &str, amplitude: f64, oil_temperature_degc: f64) -> ([Lift<f64>; 2], [Vec<f64>; 2], Vec<f64>) {
    let effects: Vec<Instance> = Instance::all().filter(|instance| instance.name() == name).collect();
    assert_eq!(effects.len(), 1, "{name}");
    let truck = truck_with_effects(&effects, |_| amplitude);
    let (lifts, effects) = truck.build(LiftName::BOTH, 700.0, |_, v| v).unwrap();
    let mut x = vec![0.0; 2 * STATES];
    for k in 0..2 {
        let p_a = lifts[k].balance.equilibrium_pressure();
        let moving = LiftState {
            i: 0.7,
            v: -0.1 - 0.05 * k as f64,
            z: -1e-3,
            p_a: 1.1 * p_a,
            a_comp: 2e-5,
            ..lifts[k].at_rest(0.5)
        };
        moving.write(&mut x[k * STATES..(k + 1) * STATES]);
    }
    let command = [0.7; 2];
    let mut thesis = Mast { lifts: lifts.clone(), physics: Thesis, command, oil_temperature_degc: 0.0 };
    let physics = Extended::new(&effects, &lifts);
    let mut extended = Mast { lifts: lifts.clone(), physics, command, oil_temperature_degc: 0.0 };
    thesis.set_inputs(command, oil_temperature_degc);
    extended.set_inputs(command, oil_temperature_degc);
    let mut both = [vec![0.0; 2 * STATES], vec![0.0; 2 * STATES]];
    thesis.rates(&x, &mut both[0]);
    extended.rates(&x, &mut both[1]);
    (lifts, both, x)
}

fn assert_near(got: f64, want: f64) {
    assert!((got - want).abs() <= 1e-9 * want.abs(), "{got} is not {want}");
}

#[test]
fn leakage_takes_oil_from_the_cylinder_in_proportion_to_its_pressure_over_the_tank() {
    for (lift, name) in [(0, "free.leakage"), (1, "main.leakage")] {
        let (lifts, [without, with], x) = rates(name, 2e-12, 40.0);
        let s = LiftState::from_slice(&x[lift * STATES..(lift + 1) * STATES]);
        let volume = lifts[lift].v_0 + lifts[lift].balance.area * s.x;
        let flow = 2e-12 * (s.p_a - lifts[lift].p_tank);
        let pressure = lift * STATES + 6;
        assert_near(with[pressure] - without[pressure], -lifts[lift].bulk.at(s.p_a) / volume * flow);
        let others = (0..2 * STATES).filter(|&k| k != pressure);
        assert!(others.into_iter().all(|k| with[k] == without[k]));
    }
}

#[test]
fn viscous_friction_falls_by_its_rate_for_each_kelvin_above_20_degrees() {
    let sigma_2 = 4137.8;
    for oil_temperature_degc in [20.0, 21.0, 60.0, -10.0] {
        let (lifts, [without, with], x) = rates("free.friction_temperature", 0.02, oil_temperature_degc);
        let factor = (-0.02f64 * (oil_temperature_degc - 20.0)).exp();
        let less = (1.0 - factor) * sigma_2 * x[4];
        let change = with[4] - without[4];
        assert!((change - less / lifts[0].balance.inertia).abs() < 1e-12, "{oil_temperature_degc}: {change}");
    }
}

#[test]
fn coupled_lifts_obey_the_joint_mass_matrix_and_keep_its_kinetic_energy() {
    for factor in [0.25, 1.0] {
        let (lifts, [without, with], x) = rates("mast_coupling", factor, 40.0);
        let joint = factor * (2.0 * lifts[0].m_c + 4.0 * lifts[0].m);
        let inertia = [lifts[0].balance.inertia, lifts[1].balance.inertia];
        let force = [0, 1].map(|k| inertia[k] * without[k * STATES + 4]);
        let a = [with[4], with[STATES + 4]];
        assert_near(inertia[0] * a[0] + joint * a[1], force[0]);
        assert_near(joint * a[0] + inertia[1] * a[1], force[1]);
        // What the forces do is the change of ½M_F·v_F² + M₁₂·v_F·v_M + ½M_M·v_M².
        let v = [x[4], x[STATES + 4]];
        let power = force[0] * v[0] + force[1] * v[1];
        let change = inertia[0] * v[0] * a[0] + joint * (a[0] * v[1] + v[0] * a[1]) + inertia[1] * v[1] * a[1];
        assert_near(change, power);
    }
}

/// Every combination of the bounds of an effect's parameters.
fn corners(parameters: &[ParameterSpec]) -> impl Iterator<Item = Vec<f64>> + '_ {
    let end = |corner: usize, k: usize, p: &ParameterSpec| if corner >> k & 1 == 1 { p.upper } else { p.lower };
    (0..1 << parameters.len())
        .map(move |corner| parameters.iter().enumerate().map(|(k, p)| end(corner, k, p)).collect())
}

#[test]
fn at_every_corner_of_an_effects_bounds_four_substeps_a_tick_follow_sixteen() {
    // Opened, half shut, opened wide, shut, opened, shut.
    const LEVELS: [f64; 7] = [0.0, 0.7, 0.5, 1.1, 0.0, 0.6, 0.0];
    const ROWS: usize = 25 * LEVELS.len();
    let time: Vec<f64> = (0..ROWS).map(|k| k as f64 * TICK).collect();
    let command: Vec<[f64; 2]> = (0..ROWS).map(|k| [LEVELS[k / 25]; 2]).collect();
    let mut lost = Vec::new();
    // Shapes have too many corners: `free_shape.rs` tries theirs.
    for instance in Instance::all().filter(|instance| instance.kind.amplitudes() == 1) {
        let spec = instance.kind.spec();
        for corner in corners(spec.parameters) {
            let mut values = thesis_values();
            let mut set = |name: String, value: f64| values.insert(name, Value::Number(value));
            for (p, &value) in spec.parameters.iter().zip(&corner) {
                set(format!("{}.{}", instance.name(), p.name), value);
            }
            if let Some(lift) = instance.lift {
                match spec.id {
                    // A bump where the lift comes by; a stop that it comes near to.
                    "friction_position" => {
                        set(format!("{}.centre", instance.name()), lift.start_position() - 0.2);
                    }
                    "end_cushion" => {
                        set(format!("{}.cylinder.stroke_lower", lift.as_str()), lift.start_position() - 0.45);
                    }
                    _ => {}
                }
            }
            let truck = Truck::from_values(values).unwrap();
            for (load_kg, celsius) in [(0.0, 80.0), (0.0, -20.0), (1500.0, 0.0), (1500.0, 100.0)] {
                let temperature = [celsius; ROWS];
                let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &temperature, load_kg };
                let runs = [4, 16].map(|substeps| {
                    let solver = Solver::Fixed { substeps };
                    simulate(&truck, Lifts::Both, &inputs, &time, solver, None, &|| false).unwrap()
                });
                let place = format!("{} {corner:?}, {load_kg} kg, {celsius} degC", instance.name());
                // Root mean squares of velocity and pressure; both stay where trucks are.
                for (state, apart, most) in [(4, 0.02, 2.0), (6, 5e5, 8e7)] {
                    for state in [state, STATES + state] {
                        let [a, b] = [0, 1].map(|k| {
                            let run = &runs[k];
                            run.states.iter().skip(state).step_by(run.state_names.len()).copied().collect::<Vec<f64>>()
                        });
                        let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
                        let got = (squares / ROWS as f64).sqrt();
                        let largest = a.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                        if !(got < apart && largest < most) {
                            lost.push(format!("{place}: state {state} is {got:e} apart, {largest:e} at most"));
                        }
                    }
                }
            }
        }
    }
    assert!(lost.is_empty(), "{}", lost.join("\n"));
}

#[test]
fn at_its_quiet_value_the_derivative_tells_of_every_effect() {
    let time: Vec<f64> = (0..75).map(|k| f64::from(k) * TICK).collect();
    let command: Vec<[f64; 2]> = (0..75).map(|k| [[0.0; 2], [0.7, 0.8], [1.3, 1.2]][(k + 35) / 40]).collect();
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &[60.0; 75], load_kg: 700.0 };
    let start = LiftName::BOTH.map(LiftName::start_position);
    let case = Case { inputs, wanted: &time, warmer: 0.0, warming: 0.0, start, command_slope: &[] };
    for instance in Instance::all() {
        let spec = instance.kind.spec();
        let truck = truck_with_effects(&[instance], quiet);
        let amplitudes = spec.parameters[..instance.kind.amplitudes()].iter();
        let along: Vec<Direction> = amplitudes
            .map(|p| format!("{}.{}", instance.name(), p.name))
            .map(|full| Direction::Parameter(truck.names().iter().position(|name| *name == full).unwrap()))
            .collect();
        let at_quiet = differentiate(&truck, &case, 4, &along, &|| false).unwrap();
        // A ten-thousandth of a loud effect is what its derivative says.
        let little = 1e-4 * (loud(&instance) - spec.quiet);
        let truck = truck_with_effects(&[instance], |_| spec.quiet + little);
        let moved = differentiate(&truck, &case, 4, &[], &|| false).unwrap();
        // The velocities, of which those of the lifts joined or apart are the third and the fourth output.
        let (mut most, mut apart) = (0.0f64, 0.0f64);
        // All amplitudes together.
        let exact = at_quiet.derivatives.chunks_exact(along.len()).map(|each| each.iter().sum::<f64>());
        for (k, exact) in exact.enumerate().filter(|(k, _)| [2, 3].contains(&(k % OUTPUTS.len()))) {
            let change = (moved.outputs[k] - at_quiet.outputs[k]) / little;
            most = most.max(exact.abs());
            apart = apart.max((exact - change).abs());
        }
        let place = format!("{}: {apart:e} of {most:e}", instance.name());
        assert!(most * (loud(&instance) - spec.quiet) > 1e-5, "{place}");
        assert!(apart < 0.05 * most, "{place}");
    }
}
