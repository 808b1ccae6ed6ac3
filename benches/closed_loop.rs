//! What sensors and controller add to an open-loop lowering: `cargo bench --bench closed_loop`.
//!
//! A block of lanes of the thesis's truck, ten seconds, 0 to 1500 kg, one core. The open loop plays back the currents that
//! the closed loop ordered, so that both integrate the same lowerings: the ratio closed over open is the sensors (a normal
//! draw for each pressure and for the temperature, rounding) and the fixed-point controller alone. They are
//! timed in turn: the ratio is the median of the turns', whose two runs, a millisecond apart, have the same clock of the
//! processor; of each time the least is shown. "Thesis" is the PID of Table 5.3 with its feed-forward; "full" does all that a
//! controller can: the pressure's swing, the shaped reference, the predictor, learning. "Lane by lane" is the same
//! controller asked for one lane after the other, as any other controller is.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use std::time::Instant;

use hydro_core::control::config::Config;
use hydro_core::control::controller::FixedPoint;
use hydro_core::control::fixed::Word;
use hydro_core::control::settings::{
    Curve, Lift, LiftSettings, Settings, ShaperSettings, SharedSettings, SwingSettings,
};
use hydro_core::lanes::{with_four, with_registers, LaneScalar, LaneWork, Precision};
use hydro_core::mast::{LiftName, Mast, Thesis, STATES};
use hydro_core::run::closed_loop::{ClosedLoop, Controller, Reading, Seat};
use hydro_core::run::drive::Drive;
use hydro_core::run::sensing::Sensors;
use hydro_core::run::ticks::{Clock, Oil, Ticks, Warmer};
use hydro_core::scalar::Scalar;
use hydro_core::solver::vectors::widest;

const TICKS: usize = 500;
const TURNS: usize = 60;

fn config(full: bool) -> Config {
    let lift = |k: usize| Lift {
        numbers: LiftSettings {
            proportional: 0.0012,
            integral: 2.0,
            derivative: 0.001,
            a: -0.003,
            b: 1.86,
            c: -0.31,
            d: -0.05,
            forks_per_count: [1.0, 2.0][k],
            filter_rate: 20.0,
            delay: 8.0,
            u_min: 0.0,
            u_max: 640.0,
            i_min: 0.0,
            i_max: 1400.0,
            adaptation_s: if full { 2.0 } else { 0.0 },
            swing_limit: if full { 60.0 } else { 0.0 },
            early_corner: if full { 10.0 } else { 1.5 },
            prediction: if full { 0.5 } else { 0.0 },
            overspeed: if full { 4.0 } else { 0.0 },
            overspeed_from: 590.0,
        },
        table: Curve { first: 0, spacing: 5, values: (0..21).map(|k| 500.0 + 45.0 * f64::from(k)).collect() },
        ratio: Curve { first: 0, spacing: 0, values: vec![[1.0, 0.0][k]; 2] },
        swing: full.then(|| SwingSettings {
            spacing: 9,
            frequency: vec![4.7, 4.3, 3.4, 2.7, 2.3, 2.0, 2.0, 2.0, 2.0],
            damping: vec![0.35; 9],
            gain: vec![2.0; 9],
            lead: vec![100.0; 9],
        }),
        shaper: full.then(|| ShaperSettings {
            spacing: 9,
            delay: vec![0.1, 0.12, 0.15, 0.18, 0.2, 0.22, 0.23, 0.24, 0.25],
            share: vec![0.54; 9],
        }),
    };
    let shared = SharedSettings {
        request_most: 590.0,
        ramp_up: 600.0,
        ramp_down: 900.0,
        ramp_corner: 1.5,
        temperature_least: -20.0,
        temperature_most: 90.0,
    };
    Settings { shared, lifts: [lift(0), lift(1)] }.config(Word::Bits16).expect("sixteen bits hold it")
}

/// Steps of a second and a half.
fn request() -> Vec<i32> {
    (0..TICKS).map(|k| [0, 200, 450, 100, 300, 50, 0][k * 7 / TICKS]).collect()
}

/// Currents played back, by tick.
struct Played<S>(Vec<[S; 1]>);

impl<S: Scalar> Drive<S, 1> for Played<S> {
    fn known_ahead(&self) -> bool {
        false
    }
    fn tick(&mut self, _k: usize, _x: &[S], _oil_temperature_degc: S) {}
    fn command(&self, k: usize) -> [S; 1] {
        self.0[k]
    }
}

/// A controller that shows lanes nothing but its answers.
struct Alone<C>(C);

impl<C: Controller> Controller for Alone<C> {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        self.0.tick(request, reading)
    }
    fn reference(&self) -> [i32; 2] {
        self.0.reference()
    }
}

/// Least times [s] of the open loop, of the closed one, and of the closed one lane by lane; for each lane. Median over
/// the turns of closed over open.
struct Found {
    least: [f64; 3],
    ratio: f64,
}

#[derive(Clone, Copy)]
struct Compare {
    substeps: usize,
    full: bool,
}

impl<const N: usize> LaneWork<N> for Compare {
    type Output = Found;
    fn run<S: LaneScalar<N>>(self) -> Found {
        let (config, request, truck) = (config(self.full), request(), common::truck_with(&[]));
        let time: Vec<f64> = (0..TICKS).map(|k| 0.02 * k as f64).collect();
        let oil = vec![40.0; TICKS];
        let clock = Clock { time: &time, oil_temperature_degc: &oil };
        let load = S::from_lanes(std::array::from_fn(|lane| 100.0 * (lane * 16 / N) as f64));
        let run = |drive: &mut dyn Drive<S, 1>| {
            let (lifts, _) = truck.build([LiftName::Free], load, |_, v| S::constant(v)).expect("no effects");
            let mut start = vec![S::zero(); STATES];
            lifts[0].at_rest(S::constant(LiftName::Free.start_position())).write(&mut start);
            let mast = Mast { lifts, physics: Thesis, command: [S::zero()], oil_temperature_degc: S::constant(40.0) };
            let mut end = S::zero();
            let mut record = |_, x: &[S]| end = x[0];
            let ticks = Ticks {
                mast,
                drive,
                clock,
                oil: Oil::Warmer(Warmer::none()),
                start: &start,
                wanted: &time,
                substeps: self.substeps,
                record: &mut record,
                carry_on: true,
                interrupt: &|| false,
            };
            let began = Instant::now();
            widest(ticks).map_err(|_| "stopped").expect("every lane runs");
            let took = began.elapsed().as_secs_f64();
            assert!(end.lanes().iter().all(|x| x.is_finite()));
            (took, end.lanes())
        };
        let closed = |alone: bool| {
            let controller = || -> Box<dyn Controller> {
                let inner = FixedPoint::new(config.clone());
                if alone {
                    Box::new(Alone(inner))
                } else {
                    Box::new(inner)
                }
            };
            let seats = std::array::from_fn(|lane| Seat {
                controller: controller(),
                sensors: Sensors::noisy(0.3e5, 0.1, [0.0; 2], 7, lane as u64),
                request: &request,
                delay: 2,
            });
            ClosedLoop::<S, N, 1>::new([LiftName::Free], &truck, seats)
        };
        let mut first = closed(false).remembering();
        let (_, ended) = run(&mut first);
        let orders: [_; N] = std::array::from_fn(|lane| first.orders(lane));
        let ordered = |k: usize, lane: usize| k.checked_sub(2).map_or(0, |then| orders[lane][then].current[0]);
        let command = |k: usize| [S::from_lanes(std::array::from_fn(|lane| f64::from(ordered(k, lane)) * 1e-3))];
        let mut played = Played((0..TICKS).map(command).collect());
        let (mut least, mut ratios) = ([f64::INFINITY; 3], Vec::new());
        for _ in 0..TURNS {
            let (open, end) = run(&mut played);
            assert_eq!(end, ended, "both integrate the same lowerings");
            let [closed, alone] = [false, true].map(|alone| {
                let (took, end) = run(&mut closed(alone));
                assert_eq!(end, ended, "as in one go");
                took
            });
            ratios.push(closed / open);
            for (least, took) in least.iter_mut().zip([open, closed, alone]) {
                *least = least.min(took / N as f64);
            }
        }
        ratios.sort_by(f64::total_cmp);
        Found { least, ratio: ratios[TURNS / 2] }
    }
}

fn main() {
    println!("lowerings of 10 s: microseconds a lane");
    let columns = ["lanes", "controller", "substeps a tick", "open", "closed", "closed/open", "lane by lane"];
    println!("{}", columns.map(|column| format!("{column:>16}")).concat());
    let row = |lanes: usize, compare: Compare, found: Found| {
        let controller = if compare.full { "full" } else { "thesis" };
        let [open, closed, alone] = found.least;
        let times = [open, closed].map(|time| format!("{:>16.1}", 1e6 * time)).concat();
        println!(
            "{lanes:>16}{controller:>16}{:>16}{times}{:>16.2}{:>16.1}",
            compare.substeps,
            found.ratio,
            1e6 * alone
        );
    };
    for full in [false, true] {
        for substeps in [2, 3, 4, 8] {
            let compare = Compare { substeps, full };
            for width in Precision::Double.widths().iter().copied().filter(|width| width.is_here()) {
                row(width.lanes(), compare, with_registers(width, compare));
            }
            row(4, compare, with_four(compare));
        }
    }
}
