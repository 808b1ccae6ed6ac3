//! Exact sensitivities along whole trajectories of the fixed path: difference quotients agree with
//! them, and the run they ride on is the plain run, to the bit.

mod common;

use std::collections::BTreeSet;

use common::{thesis_values, truck_with};
use hydro_core::dual::Dual;
use hydro_core::effects::Instance;
use hydro_core::mast::{Extended, LiftName, Mast, Physics, Thesis, CYLINDER_PRESSURE, POSITION, STATES, VELOCITY};
use hydro_core::outputs::{Readings, OUTPUTS};
use hydro_core::run::sensitivity::{differentiate, differentiate_all, Case, Direction};
use hydro_core::run::{simulate, Inputs, Lifts, Solver};
use hydro_core::scalar::Scalar;
use hydro_core::solver::fixed::{Fixed, ValveRates, ValveSteps};
use hydro_core::truck::{Owner, Truck, Value};

const SUBSTEPS: usize = 4;

/// Period of the command [s]: a power of two, so that every route lays its substeps alike, to the bit.
const TICK: f64 = 1.0 / 64.0;

/// How far the pressure equation is solved.
#[derive(Clone, Copy, PartialEq)]
enum Newton {
    /// As far as every run does.
    AsShipped,
    /// Until the step is lost in rounding.
    ToTheEnd,
}

/// A truck, its command and where it starts; a load of 800 kg, oil of 45 °C and 1.5 K more.
struct Scene {
    name: &'static str,
    truck: Truck,
    command: Vec<f64>,
    start: [f64; 2],
}

const LOAD: f64 = 800.0;
const TEMPERATURE: f64 = 45.0;
const WARMER: f64 = 1.5;

/// Opening, closing a little, opening wide, closing: the compensator regulates and saturates, and
/// the valve's hysteresis turns. The valve is not shut again: over the last of its opening the volume
/// drains within a substep, and what Newton's iteration leaves there shows in quotients along the
/// smallest openings.
fn up_and_down() -> Vec<f64> {
    [vec![0.0; 5], vec![0.7; 30], vec![0.55; 20], vec![0.95; 25], vec![0.5; 20]].concat()
}

fn regulating() -> Scene {
    let start = LiftName::BOTH.map(LiftName::start_position);
    Scene { name: "regulating", truck: truck_with(&[]), command: up_and_down(), start }
}

/// Tables that rise from their first knot, and a command that visits every segment.
fn every_knot() -> Scene {
    let mut values = thesis_values();
    for lift in ["free", "main"] {
        let mut knots = |table: &str, change: &dyn Fn(usize, f64) -> f64| {
            let Some(Value::Table(list)) = values.get_mut(&format!("{lift}.valve.{table}")) else { unreachable!() };
            for (k, knot) in list.iter_mut().enumerate() {
                *knot = change(k, *knot);
            }
        };
        knots("table_area", &|k, area| area + 3e-7 * (k + 1) as f64);
        // The valve starts at zero, which is not to be a knot.
        knots("table_current", &|k, current| if k == 0 { 0.1 } else { current });
    }
    let command = [vec![0.0; 5], vec![0.3; 20], vec![1.5; 30]].concat();
    Scene { name: "every knot", truck: Truck::from_values(values).unwrap(), command, ..regulating() }
}

/// From the upper stop, on which a start beyond it is put, down onto the lower one.
fn from_stop_to_stop() -> Scene {
    let truck = truck_with(&[
        ("free.cylinder.stroke_lower", 1.04),
        ("main.cylinder.stroke_lower", 1.85),
        ("main.cylinder.stroke_upper", 1.9),
    ]);
    Scene { name: "from stop to stop", truck, start: [1.2, 2.0], command: [vec![0.0; 5], vec![0.9; 45]].concat() }
}

/// Valves whose damping is far faster than a substep, as fits may come by: they are stepped implicitly.
fn fast_valves() -> Scene {
    let truck = truck_with(&[("free.valve.omega", 569.0), ("main.valve.omega", 300.0)]);
    Scene { name: "fast valves", truck, ..regulating() }
}

/// Every effect of the catalogue at once; the joint inertia makes both lifts run together. Dead time is of the
/// run that looks the command up, and has its own test.
fn with_effects() -> Scene {
    let mut changes = Vec::new();
    for instance in Instance::all().filter(|instance| instance.kind.spec().id != "valve_delay") {
        let spec = instance.kind.spec();
        for (k, p) in spec.parameters.iter().enumerate() {
            let soft = spec.quiet + 0.2 * (spec.plausible[0][1] - spec.quiet);
            let amplitudes = instance.kind.amplitudes();
            // A shape that rises.
            let value = if k < amplitudes {
                soft * (k + 1) as f64 / amplitudes as f64
            } else {
                common::space::plausible(&instance, k)
            };
            changes.push((format!("{}.{}", instance.name(), p.name), value));
        }
        // A bump and a cushion that the lift comes by.
        if let Some(lift) = instance.lift {
            match spec.id {
                "friction_position" => {
                    changes.push((format!("{}.centre", instance.name()), lift.start_position() - 0.1))
                }
                // A range that the lift's velocity goes through.
                "free_shape" => {
                    changes.push((format!("{}.lower", instance.name()), -0.12));
                    changes.push((format!("{}.upper", instance.name()), 0.02));
                }
                // One that it goes through to both ends, so that no narrow spline is silent.
                "fine_shape" => {
                    changes.push((format!("{}.lower", instance.name()), -0.08));
                    changes.push((format!("{}.upper", instance.name()), 0.001));
                }
                // And one that the command's steps do.
                "free_response" => changes.push((format!("{}.range", instance.name()), 0.3)),
                "end_cushion" => {
                    changes.push((format!("{}.length", instance.name()), 0.4));
                    changes.push((format!("{}.cylinder.stroke_lower", lift.as_str()), lift.start_position() - 0.3));
                }
                _ => {}
            }
        }
    }
    let changes: Vec<(&str, f64)> = changes.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    Scene { name: "with effects", truck: truck_with(&changes), ..regulating() }
}

/// All states at each tick over any scalar: `number` makes one of a value that may be a variable.
fn lower<S: Scalar, const L: usize>(
    scene: &Scene,
    which: [LiftName; L],
    newton: Newton,
    number: &dyn Fn(Direction, f64) -> S,
) -> Vec<S> {
    let load = number(Direction::Load, LOAD);
    let (lifts, effects) = scene.truck.build(which, load, |k, v| number(Direction::Parameter(k), v)).unwrap();
    let (command, oil_temperature_degc) = ([S::zero(); L], S::zero());
    if effects.is_empty() {
        let mast = Mast { lifts, physics: Thesis, command, oil_temperature_degc };
        run(mast, scene, which, newton, number)
    } else {
        let physics = Extended::new(&effects, &lifts);
        run(Mast { lifts, physics, command, oil_temperature_degc }, scene, which, newton, number)
    }
}

fn run<S: Scalar, X: Physics<S>, const L: usize>(
    mut mast: Mast<S, X, L>,
    scene: &Scene,
    which: [LiftName; L],
    newton: Newton,
    number: &dyn Fn(Direction, f64) -> S,
) -> Vec<S> {
    let temperature = S::constant(TEMPERATURE) + number(Direction::OilTemperature, WARMER);
    let mut states = vec![S::zero(); mast.dim()];
    for (k, lift) in mast.lifts.iter().enumerate() {
        let start = number(Direction::Start(which[k]), scene.start[which[k] as usize]);
        let start = start.clamp_to(lift.stop.lower, lift.stop.upper);
        lift.at_rest(start).write(&mut states[k * STATES..(k + 1) * STATES]);
    }
    let h = TICK / SUBSTEPS as f64;
    let rates = mast.lifts.iter().fold(ValveRates::default(), |rates, lift| rates.with(&lift.valve));
    let commands = |u: f64| std::array::from_fn(|k| S::constant(of_lift(which[k], u)));
    mast.set_inputs(commands(scene.command[0]), temperature);
    mast.start_effects(&mut states);
    let dim = states.len();
    let mut fixed = Fixed::new(mast, &states, h, ValveSteps::of(rates, h));
    if newton == Newton::ToTheEnd {
        fixed.tolerance = 1e-10;
    }
    // The last command holds until nothing more is asked for.
    for &u in &scene.command[..scene.command.len() - 1] {
        fixed.mast.set_inputs(commands(u), temperature);
        for _ in 0..SUBSTEPS {
            fixed.substep(None);
        }
        let end = states.len();
        states.resize(end + dim, S::zero());
        fixed.write(&mut states[end..]);
    }
    states
}

/// The main lift's valve opens a little less.
fn of_lift(lift: LiftName, u: f64) -> f64 {
    match lift {
        LiftName::Free => u,
        LiftName::Main => 0.9 * u,
    }
}

fn plain<const L: usize>(
    scene: &Scene,
    which: [LiftName; L],
    newton: Newton,
    moved: Option<(Direction, f64)>,
) -> Vec<f64> {
    lower(scene, which, newton, &|direction, v| match moved {
        Some((along, by)) if along == direction => v + by,
        _ => v,
    })
}

fn seed(variable: bool, v: f64) -> Dual<f64, 1> {
    if variable {
        Dual::variable(v, 0)
    } else {
        Dual::constant(v)
    }
}

fn exact<const L: usize>(scene: &Scene, which: [LiftName; L], newton: Newton, along: Direction) -> Vec<f64> {
    let states = lower(scene, which, newton, &|direction, v| seed(direction == along, v));
    states.iter().map(|x| x.eps[0]).collect()
}

/// Everything that the lifts `which` can be differentiated along, with a typical size and a name.
fn directions(scene: &Scene, which: &[LiftName]) -> Vec<(Direction, f64, String)> {
    let truck = &scene.truck;
    let mut all = vec![
        (Direction::Load, LOAD, "load".to_string()),
        (Direction::OilTemperature, TEMPERATURE, "oil temperature".to_string()),
    ];
    for &lift in which {
        all.push((Direction::Start(lift), 1.0, format!("{}.start", lift.as_str())));
    }
    for (k, ((name, value), owner)) in truck.names().into_iter().zip(truck.values()).zip(truck.owners()).enumerate() {
        let concerned = match owner {
            Owner::Lift(lift) => which.contains(&lift),
            Owner::Mast => which.len() == 2,
        };
        if concerned {
            // A knot at zero lies below the valve's least opening of 1e-9 m², and stays there.
            let size = if value == 0.0 { 1e-10 } else { value.abs() };
            all.push((Direction::Parameter(k), size, name));
        }
    }
    all
}

/// Places of position, velocity and cylinder pressure of L lifts.
fn places<const L: usize>() -> impl Iterator<Item = usize> {
    (0..L).flat_map(|k| [POSITION, VELOCITY, CYLINDER_PRESSURE].map(|state| k * STATES + state))
}

/// A state of a lift along its trajectory.
fn along_time(states: &[f64], dim: usize, place: usize) -> impl Iterator<Item = f64> + '_ {
    states.iter().skip(place).step_by(dim).copied()
}

fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Largest difference of two trajectories of a state.
fn apart(a: &[f64], b: &[f64], dim: usize, place: usize) -> f64 {
    largest(along_time(a, dim, place).zip(along_time(b, dim, place)).map(|(a, b)| a - b))
}

/// Extrapolated from two central differences with a step of `h`.
fn quotient(h: f64, run: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let central =
        |h: f64| -> Vec<f64> { run(h).iter().zip(run(-h)).map(|(up, down)| (up - down) / (2.0 * h)).collect() };
    central(0.5 * h).iter().zip(central(h)).map(|(fine, coarse)| (4.0 * fine - coarse) / 3.0).collect()
}

/// Holds sensitivities against central differences of whole runs, and gives the names of the
/// directions that move anything.
///
/// Both are of the pressure equation solved to the end. As shipped, Newton's iteration stops earlier:
/// what it leaves in the pressures depends on where it started, hence on the parameters, and a
/// difference quotient counts that in, up to a quarter of the little that the volume between the
/// valves does. The derivatives do not; see the test below.
fn agree<const L: usize>(scene: &Scene, which: [LiftName; L]) -> Vec<String> {
    let base = plain(scene, which, Newton::ToTheEnd, None);
    let dim = base.len() / scene.command.len();
    let size = |states: &[f64], place: usize| largest(along_time(states, dim, place));
    let mut heard = Vec::new();
    for (direction, scale, name) in directions(scene, &which) {
        let exact = exact(scene, which, Newton::ToTheEnd, direction);
        // By how much a change of the whole scale moves the states, in units of their own size.
        let reach = places::<L>().fold(0.0, |m: f64, p| m.max(scale * size(&exact, p) / size(&base, p)));
        // A step that moves the states by a ten-millionth moves no kink over a substep here (at a
        // millionth the first does) and is far above rounding; what hardly matters is moved by a
        // thousandth at most.
        let step = scale * (1e-7 / reach).min(1e-3);
        let quotient = quotient(step, |by| plain(scene, which, Newton::ToTheEnd, Some((direction, by))));
        for place in places::<L>() {
            let rounding = 1e-14 * size(&base, place) / step;
            let (apart, of) = (apart(&quotient, &exact, dim, place), size(&exact, place));
            assert!(apart <= 1e-6 * of + rounding, "{}, state {place} along {name}: {apart:e} of {of:e}", scene.name);
        }
        if reach > 1e-9 {
            heard.push(name);
        }
    }
    heard
}

#[test]
fn sensitivities_of_whole_runs_are_difference_quotients_along_everything_a_run_depends_on() {
    let mut heard = BTreeSet::new();
    for scene in [regulating(), every_knot(), from_stop_to_stop(), fast_valves()] {
        for lift in LiftName::BOTH {
            heard.extend(agree(&scene, [lift]));
        }
    }
    let scene = with_effects();
    heard.extend(agree(&scene, LiftName::BOTH));
    // No direction is silent in all scenes, where nothing would have been compared, but a choice.
    let chosen = |name: &String| [".port", ".variable", ".fades"].iter().any(|end| name.ends_with(end));
    let all = directions(&scene, &LiftName::BOTH).into_iter().map(|(.., name)| name).filter(|name| !chosen(name));
    assert_eq!(all.filter(|name| !heard.contains(name)).collect::<Vec<_>>(), Vec::<String>::new());
}

#[test]
fn what_newtons_iteration_leaves_hardly_changes_values_and_derivatives() {
    let scene = regulating();
    for lift in LiftName::BOTH {
        let runs = [Newton::AsShipped, Newton::ToTheEnd].map(|newton| plain(&scene, [lift], newton, None));
        let left = [POSITION, VELOCITY, CYLINDER_PRESSURE].map(|place| apart(&runs[0], &runs[1], STATES, place));
        assert!(left[0] < 1e-7 && left[1] < 5e-7 && left[2] < 20.0, "{}: {left:?} m, m/s, Pa", lift.as_str());
        for (direction, _, name) in directions(&scene, &[lift]) {
            let [shipped, end] =
                [Newton::AsShipped, Newton::ToTheEnd].map(|newton| exact(&scene, [lift], newton, direction));
            // The volume between the valves acts only while it refills, where the iteration has the
            // farthest to go and leaves most.
            let most = if name.contains(".volume.") { 1e-2 } else { 1e-3 };
            for place in places::<1>() {
                let (apart, of) = (apart(&shipped, &end, STATES, place), largest(along_time(&end, STATES, place)));
                assert!(apart <= most * of, "state {place} along {name}: {apart:e} of {of:e}");
            }
        }
    }
}

#[test]
fn the_run_of_duals_is_the_plain_run_to_the_bit() {
    fn hold<const L: usize>(scene: &Scene, which: [LiftName; L]) {
        let plain = plain(scene, which, Newton::AsShipped, None);
        for (along, _, name) in directions(scene, &which) {
            let duals = lower(scene, which, Newton::AsShipped, &|direction, v| seed(direction == along, v));
            assert!(plain.iter().zip(&duals).all(|(a, b)| a.to_bits() == b.re.to_bits()), "{}, {name}", scene.name);
        }
    }
    for lift in LiftName::BOTH {
        hold(&regulating(), [lift]);
        hold(&fast_valves(), [lift]);
    }
    hold(&with_effects(), LiftName::BOTH);
}

fn with_case<T>(scene: &Scene, use_it: impl FnOnce(&Case) -> T) -> T {
    let time: Vec<f64> = (0..scene.command.len()).map(|k| k as f64 * TICK).collect();
    let command: Vec<[f64; 2]> = scene.command.iter().map(|&u| LiftName::BOTH.map(|lift| of_lift(lift, u))).collect();
    let temperature = vec![TEMPERATURE; time.len()];
    let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &temperature, load_kg: LOAD };
    use_it(&Case { inputs, wanted: &time, warmer: WARMER, warming: 0.0, start: scene.start, command_slope: &[] })
}

/// Outputs at each tick from states; `dim` states a row, of which the lift named first comes first.
fn outputs_of(truck: &Truck, states: &[f64], dim: usize, which: &[LiftName]) -> Vec<f64> {
    let readings = Readings::new(which, truck.effects());
    let read = |row: &[f64], j: usize| -> f64 { readings.of(j).map(|(place, factor)| factor * row[place]).sum() };
    let rows = states.chunks_exact(dim);
    rows.flat_map(|row| (0..OUTPUTS.len()).map(|j| read(row, j)).collect::<Vec<_>>()).collect()
}

#[test]
fn outputs_are_those_of_the_states_to_the_bit_and_their_derivatives_to_single_precision() {
    fn total(scene: &Scene, states: &dyn Fn(&[LiftName]) -> Vec<f64>) -> Vec<f64> {
        let groups: &[&[LiftName]] = if scene.truck.effects().count() > 0 {
            &[&LiftName::BOTH]
        } else {
            &[&[LiftName::Free], &[LiftName::Main]]
        };
        let parts = groups.iter().map(|which| {
            let states = states(which);
            outputs_of(&scene.truck, &states, states.len() / scene.command.len(), which)
        });
        parts.reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect()).unwrap()
    }
    for scene in [regulating(), every_knot(), from_stop_to_stop(), with_effects()] {
        let all = directions(&scene, &LiftName::BOTH);
        let along: Vec<Direction> = all.iter().map(|(direction, ..)| *direction).collect();
        let got = with_case(&scene, |case| differentiate(&scene.truck, case, SUBSTEPS, &along, &|| false).unwrap());
        let states = |which: &[LiftName]| match *which {
            [lift] => plain(&scene, [lift], Newton::AsShipped, None),
            _ => plain(&scene, LiftName::BOTH, Newton::AsShipped, None),
        };
        assert!(got.outputs == total(&scene, &states), "{}", scene.name);
        for (d, (direction, size, name)) in all.iter().enumerate() {
            let states = |which: &[LiftName]| match *which {
                [lift] => exact(&scene, [lift], Newton::AsShipped, *direction),
                _ => exact(&scene, LiftName::BOTH, Newton::AsShipped, *direction),
            };
            let (column, exact) = (got.derivatives.iter().skip(d).step_by(all.len()), total(&scene, &states));
            let column: Vec<f64> = column.copied().collect();
            for j in 0..OUTPUTS.len() {
                let (apart, of) =
                    (apart(&column, &exact, OUTPUTS.len(), j), largest(along_time(&exact, OUTPUTS.len(), j)));
                // A knot below the valve's least opening moves nothing, and what is left of it is rounding.
                let nothing = 1e-12 * largest(along_time(&got.outputs, OUTPUTS.len(), j)) / size;
                let place = format!("{}, {} along {name}", scene.name, OUTPUTS[j].name);
                assert!(apart <= 3e-4 * of + nothing, "{place}: {apart:e} of {of:e}");
            }
        }
    }
}

#[test]
fn the_outputs_beside_the_derivatives_are_those_of_the_plain_run_to_the_bit() {
    let scene = regulating();
    with_case(&scene, |case| {
        let case = Case { warmer: 0.0, warming: 0.0, ..*case };
        let beside = differentiate(&scene.truck, &case, SUBSTEPS, &[], &|| false).unwrap().outputs;
        for (lift, columns) in [(LiftName::Free, [0, 2, 4]), (LiftName::Main, [1, 3, 5])] {
            let solver = Solver::Fixed { substeps: SUBSTEPS };
            let run =
                simulate(&scene.truck, Lifts::One(lift), &case.inputs, case.wanted, solver, None, &|| false).unwrap();
            let outputs = outputs_of(&scene.truck, &run.states, STATES, &[lift]);
            for j in columns {
                let bits = |all: &[f64]| -> Vec<u64> { along_time(all, OUTPUTS.len(), j).map(f64::to_bits).collect() };
                assert!(bits(&outputs) == bits(&beside), "{} of {}", OUTPUTS[j].name, lift.as_str());
            }
        }
    });
}

#[test]
fn cases_side_by_side_are_each_alone_to_the_bit() {
    for scene in [regulating(), with_effects()] {
        let along: Vec<Direction> = directions(&scene, &LiftName::BOTH).iter().map(|(way, ..)| *way).collect();
        with_case(&scene, |case| {
            let cooler = Case { warmer: 0.0, ..*case };
            let together = differentiate_all(&scene.truck, &[*case, cooler], SUBSTEPS, &along, &|| false).unwrap();
            for (beside, case) in together.iter().zip([case, &cooler]) {
                let alone = differentiate(&scene.truck, case, SUBSTEPS, &along, &|| false).unwrap();
                assert!(beside.outputs == alone.outputs, "{}", scene.name);
                assert!(beside.derivatives == alone.derivatives, "{}", scene.name);
            }
        });
    }
}

#[test]
fn along_however_many_directions_each_derivative_is_to_the_bit_the_same() {
    for scene in [regulating(), with_effects()] {
        let along: Vec<Direction> = directions(&scene, &LiftName::BOTH).iter().map(|(way, ..)| *way).collect();
        with_case(&scene, |case| {
            let of = |some: &[Direction]| differentiate(&scene.truck, case, SUBSTEPS, some, &|| false).unwrap();
            let all = of(&along);
            for n in [1, 8, 9, 16, 17, 40, 41] {
                let few = of(&along[..n]);
                assert!(few.outputs == all.outputs, "{}: outputs beside {n} directions", scene.name);
                let mut rows = few.derivatives.chunks_exact(n).zip(all.derivatives.chunks_exact(along.len()));
                assert!(rows.all(|(some, every)| *some == every[..n]), "{}, {n}", scene.name);
            }
        });
    }
}

#[test]
fn the_derivative_along_a_dead_time_is_the_difference_quotient() {
    let late = |delay: f64| {
        let scene = Scene { truck: truck_with(&[("free.valve_delay.delay", delay)]), ..regulating() };
        with_case(&scene, |case| {
            let names = scene.truck.names();
            let k = names.iter().position(|name| name == "free.valve_delay.delay").unwrap();
            differentiate(&scene.truck, case, SUBSTEPS, &[Direction::Parameter(k)], &|| false).unwrap()
        })
    };
    // Not a whole number of substeps, where the share of a jump changes its slope.
    let (at, by) = (0.0467, 1e-5);
    let (here, less, more) = (late(at), late(at - by), late(at + by));
    let quotient: Vec<f64> = more.outputs.iter().zip(&less.outputs).map(|(a, b)| (a - b) / (2.0 * by)).collect();
    for j in 0..OUTPUTS.len() {
        let column = |all: &[f64]| all.iter().skip(j).step_by(OUTPUTS.len()).copied().collect::<Vec<_>>();
        let (exact, quotient) = (column(&here.derivatives), column(&quotient));
        let size = quotient.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let apart = exact.iter().zip(&quotient).fold(0.0f64, |most, (a, b)| most.max((a - b).abs()));
        assert!(apart <= 0.02 * size, "{}: {apart:e} of {size:e}", OUTPUTS[j].name);
    }
}

#[test]
fn the_derivative_along_the_commands_is_the_difference_quotient() {
    // Shaken from tick to tick while the valve is open, as by a dither, and a little more or less: a hysteresis feels
    // the first turn from rest one way or the other.
    const SHAKEN: f64 = 2e-3;
    const BY: f64 = 2e-5;
    let slope = |u: f64, k: usize| if u > 0.0 { [1.0, -1.0][k % 2] } else { 0.0 };
    for scene in [regulating(), with_effects()] {
        let shaken = |by: f64| {
            let command = scene.command.iter().enumerate().map(|(k, &u)| u + (SHAKEN + by) * slope(u, k)).collect();
            let slopes: Vec<[f64; 2]> = scene
                .command
                .iter()
                .enumerate()
                .map(|(k, &u)| LiftName::BOTH.map(|lift| of_lift(lift, slope(u, k))))
                .collect();
            let scene = Scene { truck: scene.truck.clone(), command, ..scene };
            with_case(&scene, |case| {
                let case = Case { command_slope: &slopes, ..*case };
                differentiate(&scene.truck, &case, SUBSTEPS, &[Direction::Command], &|| false).unwrap()
            })
        };
        let (here, less, more) = (shaken(0.0), shaken(-BY), shaken(BY));
        for j in 0..OUTPUTS.len() {
            let column = |all: &[f64]| along_time(all, OUTPUTS.len(), j).collect::<Vec<_>>();
            let quotient = column(&more.outputs)
                .iter()
                .zip(column(&less.outputs))
                .map(|(a, b)| (a - b) / (2.0 * BY))
                .collect::<Vec<_>>();
            let (exact, size) = (column(&here.derivatives), largest(quotient.iter().copied()));
            let apart = largest(exact.iter().zip(&quotient).map(|(a, b)| a - b));
            assert!(size > 0.0 && apart <= 0.02 * size, "{}: {apart:e} of {size:e}", OUTPUTS[j].name);
        }
    }
}

#[test]
fn a_slope_of_the_commands_has_a_row_for_each() {
    let scene = regulating();
    with_case(&scene, |case| {
        let case = Case { command_slope: &[[1.0; 2]; 3], ..*case };
        let error = differentiate(&scene.truck, &case, SUBSTEPS, &[Direction::Command], &|| false).unwrap_err();
        assert!(error.to_string().contains("command_slope"), "{error}");
    });
}
