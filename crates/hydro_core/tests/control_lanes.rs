//! The controller in lanes is the controller, to the bit: from any state, with any settings side by side.

use hydro_core::control::config::{Config, PAST};
use hydro_core::control::controller::{FixedPoint, State};
use hydro_core::control::fixed::Word;
use hydro_core::control::lift::LiftState;
use hydro_core::control::numbers::Numbers;
use hydro_core::control::reference::ReferenceState;
use hydro_core::control::settings::{
    Curve, Lift, LiftSettings, Settings, ShaperSettings, SharedSettings, SwingSettings,
};
use hydro_core::control::vectors::Draws;
use hydro_core::integer::{Integer, LaneInteger};
use hydro_core::lanes::{
    with_four, with_registers, with_single_registers, LaneScalar, LaneWork, Lanes, Precision, Width,
};
use hydro_core::run::closed_loop::{Controller, Reading};

/// What a controller may leave out: each a bit of a number below this.
const COMBINATIONS: usize = 1 << 6;

/// The settings whose parts are those bits; the numbers differ from one to the next, so do delays and tables.
fn settings(parts: usize) -> Settings {
    let has = |bit: usize| parts >> bit & 1 == 1;
    let more = parts as f64;
    let lift = |k: usize| Lift {
        numbers: LiftSettings {
            proportional: 0.001 + 0.0003 * more,
            integral: [1.178, 2.2][k] + 0.01 * more,
            derivative: 0.0008 + 0.0001 * more,
            a: -0.003,
            b: 1.86,
            c: -0.31,
            d: -0.05,
            forks_per_count: [1.0, 2.0][k],
            filter_rate: 20.0 + more / 8.0,
            delay: (parts % 16) as f64,
            u_min: 5.0,
            u_max: 650.0,
            i_min: 300.0,
            i_max: 1300.0,
            adaptation_s: if has(0) { 2.0 } else { 0.0 },
            swing_limit: if has(1) { 60.0 } else { 0.0 },
            early_corner: if has(2) { 12.0 } else { 1.5 },
            prediction: if has(3) { 0.5 } else { 0.0 },
            overspeed: if has(4) { 3.0 } else { 0.0 },
            overspeed_from: 500.0,
        },
        table: Curve { first: 0, spacing: 5, values: (0..20 + parts % 4).map(|k| 400.0 + 40.0 * k as f64).collect() },
        ratio: match (has(5), k) {
            (true, _) => Curve { first: 900, spacing: 7, values: vec![1.0, 0.4] },
            (false, k) => Curve { first: 0, spacing: 0, values: vec![[1.0, 0.0][k]; 2] },
        },
        swing: has(1).then(|| SwingSettings {
            spacing: 8,
            frequency: vec![2.4, 2.0, 1.7, 1.6],
            damping: vec![0.35; 4],
            gain: vec![4.0 + more / 16.0; 4],
            lead: vec![-30.0, 0.0, 40.0, 170.0],
        }),
        shaper: has(2).then(|| ShaperSettings { spacing: 8, delay: vec![0.1, 0.21, 0.25, 0.3], share: vec![0.55; 4] }),
    };
    let shared = SharedSettings {
        request_most: 600.0,
        ramp_up: 600.0 + more,
        ramp_down: 900.0 - more,
        ramp_corner: 1.5,
        temperature_least: -20.0,
        temperature_most: 90.0,
    };
    Settings { shared, lifts: [lift(0), lift(1)] }
}

fn config(word: Word, parts: usize) -> Config {
    settings(parts).config(word).unwrap()
}

fn lanes_of<I: LaneInteger<N>, T, const N: usize>(all: &[T], of: impl Fn(&T) -> i64) -> I {
    I::from_lanes(std::array::from_fn(|lane| of(&all[lane])))
}

/// States side by side; their rings are written at the same place.
fn beside<I: LaneInteger<N>, const N: usize>(states: &[State]) -> State<I> {
    let whole = |of: &dyn Fn(&State) -> i64| lanes_of::<I, _, N>(states, of);
    let ring = |of: &dyn Fn(&State) -> [i64; PAST]| -> [I; PAST] { std::array::from_fn(|k| whole(&|s| of(s)[k])) };
    State {
        reference: ReferenceState {
            ramp: whole(&|s| s.reference.ramp),
            smooth: whole(&|s| s.reference.smooth),
            early: [0, 1].map(|k| whole(&|s| s.reference.early[k])),
        },
        wanted: [0, 1].map(|k| whole(&|s| s.wanted[k])),
        lifts: [0, 1].map(|k| LiftState {
            started: whole(&|s| s.lifts[k].started),
            position: whole(&|s| s.lifts[k].position),
            pressure: whole(&|s| s.lifts[k].pressure),
            speed: whole(&|s| s.lifts[k].speed),
            asked: ring(&|s| s.lifts[k].asked),
            references: ring(&|s| s.lifts[k].references),
            corrections: ring(&|s| s.lifts[k].corrections),
            oldest: states[0].lifts[k].oldest,
            error: whole(&|s| s.lifts[k].error),
            integral: whole(&|s| s.lifts[k].integral),
            trim: whole(&|s| s.lifts[k].trim),
            mean: whole(&|s| s.lifts[k].mean),
            cosine: whole(&|s| s.lifts[k].cosine),
            sine: whole(&|s| s.lifts[k].sine),
        }),
    }
}

/// One lane's state.
fn alone<I: LaneInteger<N>, const N: usize>(state: &State<I>, lane: usize) -> State {
    let of = |value: I| value.lanes()[lane];
    State {
        reference: ReferenceState {
            ramp: of(state.reference.ramp),
            smooth: of(state.reference.smooth),
            early: state.reference.early.map(of),
        },
        wanted: state.wanted.map(of),
        lifts: state.lifts.map(|lift| LiftState {
            started: of(lift.started),
            position: of(lift.position),
            pressure: of(lift.pressure),
            speed: of(lift.speed),
            asked: lift.asked.map(of),
            references: lift.references.map(of),
            corrections: lift.corrections.map(of),
            oldest: lift.oldest,
            error: of(lift.error),
            integral: of(lift.integral),
            trim: of(lift.trim),
            mean: of(lift.mean),
            cosine: of(lift.cosine),
            sine: of(lift.sine),
        }),
    }
}

fn readings<I: LaneInteger<N>, const N: usize>(all: &[(i32, Reading)]) -> (I, Reading<I>) {
    let whole = |of: &dyn Fn(&Reading) -> i32| lanes_of::<I, _, N>(all, |(_, reading)| i64::from(of(reading)));
    let reading = Reading {
        position: [0, 1].map(|k| whole(&|r| r.position[k])),
        pressure: [0, 1].map(|k| whole(&|r| r.pressure[k])),
        temperature: whole(&|r| r.temperature),
    };
    (lanes_of::<I, _, N>(all, |(request, _)| i64::from(*request)), reading)
}

/// Ticks from states drawn over the whole of their ranges, each compared with the scalar's.
#[derive(Clone, Copy)]
struct FromAnyState {
    word: Word,
    /// The parts of the first lane; those of the others follow.
    first: usize,
    ticks: usize,
}

impl<const N: usize> LaneWork<N> for FromAnyState {
    /// How many ticks were compared.
    type Output = usize;
    fn run<S: LaneScalar<N>>(self) -> usize {
        let configs: Vec<Config> =
            (0..N).map(|lane| config(self.word, (self.first + 5 * lane) % COMBINATIONS)).collect();
        let together = Numbers::<S::Integer>::complete::<N>(std::array::from_fn(|lane| &configs[lane]));
        let own: Vec<Numbers<i64>> = configs.iter().map(|config| Numbers::complete([config])).collect();
        let mut draws = Draws::new(1 + self.first as u64);
        for _ in 0..self.ticks {
            let mut states: Vec<State> = configs.iter().map(|config| draws.state(config)).collect();
            let read: Vec<(i32, Reading)> = states.iter().map(|state| draws.reading(state)).collect();
            for k in 0..2 {
                let oldest = states[0].lifts[k].oldest;
                states.iter_mut().for_each(|state| state.lifts[k].oldest = oldest);
            }
            let mut state = beside::<S::Integer, N>(&states);
            let (request, reading) = readings::<S::Integer, N>(&read);
            let current = state.tick_of(&together, request, &reading).map(|current| current.lanes());
            for lane in 0..N {
                let (request, reading) = &read[lane];
                let expected = states[lane].tick_of(&own[lane], i64::from(*request), &reading.whole());
                assert_eq!(current.map(|lanes| lanes[lane]), expected, "lane {lane} of {N}, parts from {}", self.first);
                assert_eq!(alone::<S::Integer, N>(&state, lane), states[lane], "lane {lane} of {N}");
            }
        }
        self.ticks * N
    }
}

/// Runs in which absent parts are left out, against the whole controller of each lane.
#[derive(Clone, Copy)]
struct FromTheStart {
    word: Word,
    first: usize,
    step: usize,
}

impl<const N: usize> LaneWork<N> for FromTheStart {
    type Output = ();
    fn run<S: LaneScalar<N>>(self) {
        let configs: Vec<Config> =
            (0..N).map(|lane| config(self.word, (self.first + self.step * lane) % COMBINATIONS)).collect();
        let numbers = Numbers::<S::Integer>::of::<N>(std::array::from_fn(|lane| &configs[lane]));
        let whole: Vec<Numbers<i64>> = configs.iter().map(|config| Numbers::complete([config])).collect();
        let mut state = State::<S::Integer>::at_rest();
        let mut single: Vec<FixedPoint<&Config>> = configs.iter().map(FixedPoint::new).collect();
        let mut reference: Vec<State> = vec![State::at_rest(); N];
        let mut draws = Draws::new(77);
        let mut position = [[700i32, 1500]; N];
        let mut moved = false;
        for k in 0..300 {
            let read: Vec<(i32, Reading)> = (0..N)
                .map(|lane| {
                    let drawn = draws.reading(&reference[lane]).1;
                    position[lane] = [0, 1].map(|lift| position[lane][lift] - (drawn.temperature & 7).abs());
                    let pressure = drawn.pressure.map(|steps| 1500 + steps % 300);
                    let request = [0, 500, 120, 590, 0, 300][(k / 40 + lane) % 6];
                    (request, Reading { position: position[lane], pressure, temperature: 60 + drawn.temperature % 30 })
                })
                .collect();
            let (request, reading) = readings::<S::Integer, N>(&read);
            let current = state.tick_of(&numbers, request, &reading).map(|current| current.lanes());
            let meant = state.meant().map(|meant| meant.lanes());
            for (lane, (request, reading)) in read.iter().enumerate() {
                let expected = reference[lane].tick_of(&whole[lane], i64::from(*request), &reading.whole());
                assert_eq!(current.map(|lanes| lanes[lane]), expected, "lane {lane} of {N}, tick {k}");
                assert_eq!(meant.map(|lanes| lanes[lane]), reference[lane].meant());
                assert_eq!(single[lane].tick(*request, reading).map(i64::from), expected);
                moved |= expected[0] > 0;
            }
        }
        assert!(moved, "some valve opens");
    }
}

fn here(precision: Precision) -> impl Iterator<Item = Width> {
    precision.widths().iter().copied().filter(|width| width.is_here())
}

/// In every kind of lanes that there is here, and in the plain ones.
fn in_all_lanes<T>(
    work: impl LaneWork<32, Output = T>
        + LaneWork<16, Output = T>
        + LaneWork<8, Output = T>
        + LaneWork<4, Output = T>
        + LaneWork<1, Output = T>
        + Copy,
) -> Vec<T> {
    let mut found: Vec<T> = here(Precision::Double).map(|width| with_registers(width, work)).collect();
    found.extend(here(Precision::Single).map(|width| with_single_registers(width, work)));
    found.push(with_four(work));
    found.push(LaneWork::<4>::run::<Lanes<4>>(work));
    found
}

#[test]
fn from_any_state_a_tick_in_lanes_is_the_scalar_tick() {
    let mut compared = 0;
    for word in Word::BOTH {
        for first in 0..COMBINATIONS {
            compared += in_all_lanes(FromAnyState { word, first, ticks: 60 }).into_iter().sum::<usize>();
        }
    }
    assert!(compared >= 100_000, "{compared}");
}

#[test]
fn from_the_start_what_no_lane_has_is_left_out_and_no_order_changes() {
    for word in Word::BOTH {
        for first in 0..COMBINATIONS {
            // The same in all lanes, so that what is absent is left out; and different ones.
            for step in [0, 9] {
                in_all_lanes(FromTheStart { word, first, step });
            }
        }
    }
}

/// Integers where arithmetic is apt to err.
const CORNERS: [i64; 10] = [0, 1, -1, 255, -256, 65_535, i32::MAX as i64, i32::MIN as i64, -65_536, 4096];

#[derive(Clone, Copy)]
struct Operations;

impl<const N: usize> LaneWork<N> for Operations {
    type Output = ();
    fn run<S: LaneScalar<N>>(self) {
        for from in 0..CORNERS.len() {
            let a: [i64; N] = std::array::from_fn(|lane| CORNERS[(from + lane) % CORNERS.len()]);
            for by in 0..CORNERS.len() {
                let b: [i64; N] = std::array::from_fn(|lane| CORNERS[(by + 3 * lane) % CORNERS.len()]);
                let bits: [i64; N] = std::array::from_fn(|lane| (by as i64 + 7 * lane as i64) % 31);
                let (x, y, z) = (S::Integer::from_lanes(a), S::Integer::from_lanes(b), S::Integer::from_lanes(bits));
                let (wide, narrow) = (x.shl(12), y.and(S::Integer::constant(65_535)));
                let table: Vec<S::Integer> = (0..31).map(|k| S::Integer::constant(k * k - 7)).collect();
                let less = x.lt(y);
                let found = [
                    x + y,
                    x - y,
                    -x,
                    wide * narrow,
                    x.product(y),
                    x.abs(),
                    x.signed_as(y),
                    x.and(y),
                    x.shl(9),
                    x.abs().shr(3),
                    x.shl_by(z),
                    x.abs().shr_by(z),
                    S::Integer::select(less, x, y),
                    S::Integer::select(x.is_zero(), y, x),
                    x.clamp_to(S::Integer::constant(-300), S::Integer::constant(70_000)),
                    S::Integer::lookup(&table, z),
                ]
                .map(|value| value.lanes());
                for lane in 0..N {
                    let (x, y, bits) = (a[lane], b[lane], bits[lane]);
                    let expected = [
                        x + y,
                        x - y,
                        -x,
                        (x << 12) * (y & 65_535),
                        x * y,
                        x.abs(),
                        if y < 0 { -x } else { x },
                        x & y,
                        x << 9,
                        x.abs() >> 3,
                        x << bits,
                        x.abs() >> bits,
                        if x < y { x } else { y },
                        if x == 0 { y } else { x },
                        x.clamp(-300, 70_000),
                        bits * bits - 7,
                    ];
                    assert_eq!(found.map(|lanes| lanes[lane]), expected, "{x}, {y} in lane {lane} of {N}");
                }
            }
        }
    }
}

#[test]
fn every_operation_on_integers_in_lanes_is_that_on_each() {
    in_all_lanes(Operations);
}

/// Numbers at and beside what rounds differently.
const ROUNDED: [f64; 16] = [
    0.0,
    -0.0,
    0.5,
    -0.5,
    0.49999999999999994,
    -0.49999999999999994,
    2.5,
    -3.5,
    1e9 + 0.5,
    2147483647.4,
    -2147483648.6,
    1e300,
    -1e300,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

#[derive(Clone, Copy)]
struct Rounding;

impl<const N: usize> LaneWork<N> for Rounding {
    type Output = ();
    fn run<S: LaneScalar<N>>(self) {
        for from in 0..ROUNDED.len() {
            let number = S::from_lanes(std::array::from_fn(|lane| ROUNDED[(from + lane) % ROUNDED.len()]));
            // What the lanes hold of it, and the largest integer of 32 bits that they have: singles round.
            let x = number.lanes();
            let most = if S::constant(0.1).lanes()[0] == 0.1 { i32::MAX } else { 2_147_483_520 };
            let (floor, nearest) = (number.floor(), number.nearest());
            let back = S::of_integer(nearest).lanes();
            for lane in 0..N {
                let (down, round) = ((x[lane].floor() as i32).min(most), (x[lane].round() as i32).min(most));
                assert_eq!(floor.lanes()[lane], i64::from(down), "{}", x[lane]);
                assert_eq!(nearest.lanes()[lane], i64::from(round), "{}", x[lane]);
                assert_eq!(back[lane].to_bits(), f64::from(round).to_bits());
            }
        }
    }
}

#[test]
fn a_reading_is_rounded_in_lanes_as_by_itself() {
    in_all_lanes(Rounding);
}
