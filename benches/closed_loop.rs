//! What sensors and controller add to an open-loop lowering: `cargo bench --bench closed_loop`.
//!
//! Sixteen lanes of the thesis's truck, ten seconds, 0 to 1500 kg, one core. The open loop plays back the currents that
//! the closed loop ordered, so that both integrate the same lowerings: the ratio closed over open is the sensors (three
//! normal draws a tick and lane, rounding) and the fixed-point controller alone. Both are timed in turn, and the least
//! time of each counts. The controller does all that it can: the pressure's swing, the shaped reference, the predictor.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use std::time::Instant;

use hydro_core::control::config::Config;
use hydro_core::control::controller::FixedPoint;
use hydro_core::control::fixed::Word;
use hydro_core::control::settings::{
    Curve, Lift, LiftSettings, Settings, ShaperSettings, SharedSettings, SwingSettings,
};
use hydro_core::lanes::{with_sixteen, LaneScalar, LaneWork};
use hydro_core::mast::{LiftName, Mast, Thesis, STATES};
use hydro_core::run::closed_loop::{ClosedLoop, Seat, Sensors};
use hydro_core::run::drive::Drive;
use hydro_core::run::ticks::{Clock, Ticks, Warmer};
use hydro_core::scalar::Scalar;
use hydro_core::solver::vectors::widest;

const TICKS: usize = 500;
const TURNS: usize = 60;

fn config() -> Config {
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
            adaptation_s: 2.0,
            swing_limit: 60.0,
            early_corner: 10.0,
            prediction: 0.5,
            overspeed: 4.0,
            overspeed_from: 590.0,
        },
        table: Curve { first: 0, spacing: 5, values: (0..21).map(|k| 500.0 + 45.0 * f64::from(k)).collect() },
        ratio: Curve { first: 0, spacing: 0, values: vec![[1.0, 0.0][k]; 2] },
        swing: Some(SwingSettings {
            spacing: 9,
            frequency: vec![4.7, 4.3, 3.4, 2.7, 2.3, 2.0, 2.0, 2.0, 2.0],
            damping: vec![0.35; 9],
            gain: vec![2.0; 9],
            lead: vec![100.0; 9],
        }),
        shaper: Some(ShaperSettings {
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

struct Compare {
    substeps: usize,
}

impl<const N: usize> LaneWork<N> for Compare {
    /// Least times of the open and of the closed loop [s].
    type Output = [f64; 2];
    fn run<S: LaneScalar<N>>(self) -> [f64; 2] {
        let (config, request, truck) = (config(), request(), common::truck_with(&[]));
        let time: Vec<f64> = (0..TICKS).map(|k| 0.02 * k as f64).collect();
        let oil = vec![40.0; TICKS];
        let clock = Clock { time: &time, oil_temperature_degc: &oil };
        let load = S::from_lanes(std::array::from_fn(|lane| 100.0 * lane as f64));
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
                warmer: Warmer::none(),
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
        let closed = || {
            let seats = std::array::from_fn(|lane| Seat {
                controller: Box::new(FixedPoint::new(&config)),
                sensors: Sensors::noisy(0.3e5, 0.1, [0.0; 2], 7, lane as u64),
                request: &request,
                delay: 2,
            });
            ClosedLoop::<S, N, 1>::new([LiftName::Free], &truck, seats)
        };
        let mut first = closed();
        let (_, ended) = run(&mut first);
        let ordered = |k: usize, lane: usize| k.checked_sub(2).map_or(0, |then| first.orders()[then][lane].current[0]);
        let command = |k: usize| [S::from_lanes(std::array::from_fn(|lane| f64::from(ordered(k, lane)) * 1e-3))];
        let mut played = Played((0..TICKS).map(command).collect());
        let mut least = [f64::INFINITY; 2];
        for _ in 0..TURNS {
            let (took, end) = run(&mut played);
            assert_eq!(end, ended, "both integrate the same lowerings");
            least[0] = least[0].min(took);
            let mut drive = closed();
            least[1] = least[1].min(run(&mut drive).0);
        }
        least
    }
}

fn main() {
    println!("16 lanes of 10 s: microseconds a lane");
    println!("{:>16}{:>10}{:>10}{:>14}", "substeps a tick", "open", "closed", "closed/open");
    for substeps in [2, 4, 8] {
        let [open, closed] = with_sixteen(Compare { substeps });
        let each = 1e6 / 16.0;
        println!("{substeps:>16}{:>10.1}{:>10.1}{:>14.2}", open * each, closed * each, closed / open);
    }
}
