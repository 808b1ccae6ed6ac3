//! The loop closed: one call a tick, nothing known ahead, each lane alone to the bit.

mod common;

use std::sync::{Arc, Mutex};

use common::thesis_values;
use hydro_core::lanes::{LaneScalar, Lanes};
use hydro_core::mast::{LiftName, Mast, Thesis, STATES};
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::closed_loop::{ClosedLoop, Controller, Reading, Seat};
use hydro_core::run::lowering::{lower, Member, Trace};
use hydro_core::run::sensing::Sensors;
use hydro_core::run::ticks::{Clock, Oil, Ticks, Warmer};
use hydro_core::run::{simulate, Inputs, Lifts, Solver};
use hydro_core::solver::vectors::Work;
use hydro_core::truck::{Truck, Value};

const TICKS: usize = 120;
const SUBSTEPS: usize = 4;

/// Plays currents back.
struct Player(Vec<[i32; 2]>, usize);

impl Controller for Player {
    fn tick(&mut self, _request: i32, _reading: &Reading) -> [i32; 2] {
        self.1 += 1;
        self.0[self.1 - 1]
    }
    fn reference(&self) -> [i32; 2] {
        [0, 0]
    }
}

/// Answers every sensor, so that whatever differs shows.
#[derive(Default)]
struct Nervous {
    before: [i32; 2],
}

impl Controller for Nervous {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        let current = [0, 1].map(|k| {
            let slower = reading.position[k] - self.before[k];
            (500 + request + 8 * slower + reading.pressure[k] % 64 + reading.temperature).clamp(0, 1400)
        });
        self.before = reading.position;
        current
    }
    fn reference(&self) -> [i32; 2] {
        [1, 2]
    }
}

fn truck(extended: bool) -> Truck {
    truck_with_area(extended, 0.002375829)
}

fn truck_with_area(extended: bool, free_area: f64) -> Truck {
    let mut values = thesis_values();
    values.insert("free.cylinder.area".into(), Value::Number(free_area));
    if extended {
        values.insert("mast_coupling.factor".into(), Value::Number(0.7));
        values.insert("free.chain_elasticity.compliance".into(), Value::Number(1e-7));
        values.insert("main.valve_delay.delay".into(), Value::Number(0.013));
        values.insert("free.valve_delay.delay".into(), Value::Number(0.03));
    }
    Truck::from_values(values).unwrap()
}

fn times() -> Vec<f64> {
    (0..TICKS).map(|k| 0.02 * k as f64).collect()
}

fn seat(k: usize, request: &[i32]) -> Seat<'_> {
    let zero = [1e-4 * k as f64, 0.0];
    let sensors = Sensors::noisy(0.3e5, 0.1, zero, 7, k as u64);
    Seat { controller: Box::new(Nervous::default()), sensors, request, delay: k % 4 }
}

fn run(members: Vec<Member>, lifts: Lifts) -> Vec<Trace> {
    let (time, oil) = (times(), vec![40.0; TICKS]);
    lower(members, lifts, Clock { time: &time, oil_temperature_degc: &oil }, SUBSTEPS, &|| false).unwrap()
}

fn bits(trace: &Trace) -> Vec<u64> {
    trace.outputs.iter().map(|x| x.to_bits()).collect()
}

fn staircase() -> Vec<[i32; 2]> {
    (0..TICKS).map(|k| [[0, 0], [620, 500], [900, 0], [700, 1100]][k * 4 / TICKS]).collect()
}

#[test]
fn a_controller_that_plays_a_recording_gives_the_bits_of_the_recording_replayed() {
    for extended in [false, true] {
        let truck = truck(extended);
        let request = [0];
        let seat = Seat {
            controller: Box::new(Player(staircase(), 0)),
            sensors: Sensors::perfect(),
            request: &request,
            delay: 0,
        };
        let start = LiftName::BOTH.map(LiftName::start_position);
        let member = Member { truck: &truck, load_kg: 800.0, warmer: 0.0, start, seat };
        let trace = &run(vec![member], Lifts::Both)[0];
        let time = times();
        let command: Vec<[f64; 2]> =
            staircase().iter().map(|order| order.map(|current| f64::from(current) * 1e-3)).collect();
        let oil = vec![40.0; TICKS];
        let inputs = Inputs { time: &time, command: &command, oil_temperature_degc: &oil, load_kg: 800.0 };
        let solver = Solver::Fixed { substeps: SUBSTEPS };
        let replayed = simulate(&truck, Lifts::Both, &inputs, &time, solver, None, &|| false).unwrap();
        let position = OUTPUTS.iter().position(|o| o.name == "position_main_m").unwrap();
        let dim = replayed.state_names.len();
        let place = STATES + hydro_core::mast::POSITION;
        for k in 0..TICKS {
            let (closed, open) = (trace.outputs[k * OUTPUTS.len() + position], replayed.states[k * dim + place]);
            assert_eq!(closed.to_bits(), open.to_bits(), "tick {k}");
        }
    }
}

#[test]
fn a_member_is_alone_to_the_bit_wherever_it_stands_and_whoever_runs_away_beside_it() {
    let request: Vec<i32> = (0..TICKS).map(|k| [0, 300, 150][k * 3 / TICKS]).collect();
    for extended in [false, true] {
        let (good, other) = (truck(extended), truck_with_area(extended, 2e-3));
        let member = |k: usize| Member {
            truck: if k.is_multiple_of(2) { &good } else { &other },
            load_kg: if k == 5 { f64::NAN } else { 100.0 * k as f64 },
            warmer: k as f64,
            start: [0.9, 1.8],
            seat: seat(k, &request),
        };
        let together = run((0..19).map(member).collect(), Lifts::Both);
        for k in [0, 3, 7, 15, 16, 18] {
            let alone = run(vec![member(k)], Lifts::Both);
            assert_eq!(bits(&together[k]), bits(&alone[0]), "member {k}");
            assert_eq!(together[k].orders, alone[0].orders, "member {k}");
        }
        assert!(together[4].outputs.iter().all(|x| x.is_finite()));
        assert!(!together[5].outputs.iter().all(|x| x.is_finite()));
    }
}

#[test]
fn a_member_is_alone_to_the_bit_beside_trucks_whose_valves_are_stepped_more_finely() {
    let request: Vec<i32> = (0..TICKS).map(|k| [0, 300, 150][k * 3 / TICKS]).collect();
    // In half a tick the valve of the first takes one step, those of the others two and more.
    let trucks: Vec<Truck> = [34.3, 60.0, 120.0].map(|omega| common::truck_with(&[("free.valve.omega", omega)])).into();
    let member = |k: usize| Member {
        truck: &trucks[k % 3],
        load_kg: 100.0 * k as f64,
        warmer: 40.0,
        start: [0.9, 1.8],
        seat: seat(k, &request),
    };
    let (time, oil) = (times(), vec![0.0; TICKS]);
    let clock = Clock { time: &time, oil_temperature_degc: &oil };
    let run = |members| lower(members, Lifts::One(LiftName::Free), clock, 2, &|| false).unwrap();
    let together = run((0..19).map(member).collect());
    for k in 0..19 {
        let alone = run(vec![member(k)]);
        assert_eq!(bits(&together[k]), bits(&alone[0]), "member {k}");
        assert_eq!(together[k].orders, alone[0].orders, "member {k}");
    }
}

#[test]
fn trucks_that_all_run_away_are_told_so_and_a_start_that_is_no_number_is_refused() {
    let (request, truck) = (vec![300; TICKS], truck(false));
    let member = |k: usize, start: f64| Member {
        truck: &truck,
        load_kg: f64::NAN,
        warmer: 40.0,
        start: [start, 1.8],
        seat: seat(k, &request),
    };
    let (time, oil) = (times(), vec![0.0; TICKS]);
    let clock = Clock { time: &time, oil_temperature_degc: &oil };
    let run = |members| lower(members, Lifts::Both, clock, SUBSTEPS, &|| false);
    let found = run((0..17).map(|k| member(k, 0.9)).collect()).unwrap();
    for trace in found {
        assert_eq!((trace.outputs.len(), trace.orders.len()), (TICKS * OUTPUTS.len(), TICKS));
        assert!(trace.outputs[trace.outputs.len() - OUTPUTS.len()..].iter().any(|x| x.is_nan()));
    }
    assert_eq!(run(vec![member(0, f64::NAN)]).unwrap_err().code(), "argument-invalid");
}

/// What sixteen members do in groups of N, and of one in `f64`.
fn free_lift<S: LaneScalar<N>, const N: usize>(members: std::ops::Range<usize>) -> Vec<Vec<u64>> {
    let truck = truck(false);
    let request = vec![300; 3];
    let (time, oil) = (times(), vec![40.0; TICKS]);
    let clock = Clock { time: &time, oil_temperature_degc: &oil };
    let mut all = Vec::new();
    for first in members.step_by(N) {
        let load = S::from_lanes(std::array::from_fn(|lane| 90.0 * (first + lane) as f64));
        let (lifts, _) = truck.build([LiftName::Free], load, |_, v| S::constant(v)).unwrap();
        let mut start = vec![S::zero(); STATES];
        lifts[0].at_rest(S::constant(0.98)).write(&mut start);
        let zero = S::zero();
        let mast = Mast { lifts, physics: Thesis, command: [zero], oil_temperature_degc: zero };
        let seats = std::array::from_fn(|lane| seat(first + lane, &request));
        let mut drive = ClosedLoop::<S, N, 1>::new([LiftName::Free], &truck, seats);
        let mut seen: [Vec<u64>; N] = std::array::from_fn(|_| Vec::new());
        let mut record = |_, x: &[S]| {
            for value in x {
                for (seen, value) in seen.iter_mut().zip(value.lanes()) {
                    seen.push(value.to_bits());
                }
            }
        };
        let ticks = Ticks {
            mast,
            drive: &mut drive,
            clock,
            oil: Oil::Warmer(Warmer::none()),
            start: &start,
            wanted: &time,
            substeps: SUBSTEPS,
            record: &mut record,
            carry_on: false,
            interrupt: &|| false,
        };
        ticks.run().unwrap();
        all.extend(seen);
    }
    all
}

#[test]
fn lanes_are_scalar_runs() {
    let alone = free_lift::<f64, 1>(0..8);
    assert_eq!(alone, free_lift::<Lanes<4>, 4>(0..8));
    assert!(alone.iter().skip(1).all(|member| *member != alone[0]));
}

/// Notes what it is asked and shown.
struct Witness(Arc<Mutex<Vec<(i32, Reading)>>>);

impl Controller for Witness {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        self.0.lock().unwrap().push((request, *reading));
        [800, 0]
    }
    fn reference(&self) -> [i32; 2] {
        [0, 0]
    }
}

#[test]
fn one_tick_is_one_call_and_a_delay_is_a_shift() {
    let truck = truck(false);
    let request: Vec<i32> = (0..50).collect();
    let go = |delay: usize| {
        let seen = Arc::new(Mutex::new(Vec::new()));
        let controller = Box::new(Witness(seen.clone()));
        let seat = Seat { controller, sensors: Sensors::perfect(), request: &request, delay };
        let member = Member { truck: &truck, load_kg: 800.0, warmer: 0.0, start: [0.98, 1.96], seat };
        let trace = run(vec![member], Lifts::One(LiftName::Free)).remove(0);
        let seen = seen.lock().unwrap().clone();
        (seen, trace)
    };
    let (seen, prompt) = go(0);
    assert_eq!(seen.len(), TICKS);
    let asked: Vec<i32> = seen.iter().map(|(request, _)| *request).collect();
    assert_eq!(asked[..50], request[..]);
    assert!(asked[50..].iter().all(|&request| request == 49));
    // Half a bar of rounding; at rest p_A is the weight over the area.
    let weight = (12.6 + 4.0 * (278.0 + 800.0)) / 2.0 * 9.82 / 0.002375829;
    assert!(seen[0].1.pressure[0] > 0 && f64::from(seen[0].1.pressure[0]) * 0.06e5 < 2.0 * weight);
    assert_eq!((seen[0].1.pressure[1], seen[0].1.position[1], seen[0].1.temperature), (0, 0, 80));
    let n = OUTPUTS.len();
    let moved = |trace: &Trace, k: usize| trace.outputs[k * n + 2].abs();
    let (_, late) = go(6);
    assert!(moved(&prompt, 6) > 1e-4 && moved(&late, 6) < moved(&prompt, 6) / 10.0);
    // At rest nothing happens, so the answer is the same, six ticks later.
    for k in 12..TICKS {
        assert!((moved(&late, k) - moved(&prompt, k - 6)).abs() < 2e-3, "tick {k}");
    }
}
