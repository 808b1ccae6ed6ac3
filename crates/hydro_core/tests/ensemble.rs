//! Ensembles: a member's bits are its own, and what fails has a verdict and disturbs no other.

mod common;

use common::thesis_values;
use hydro_core::control::controller::FixedPoint;
use hydro_core::control::fixed::Word;
use hydro_core::control::settings::{Curve, Lift, LiftSettings, Settings, SharedSettings};
use hydro_core::ensemble::distribution::Distribution;
use hydro_core::ensemble::draw;
use hydro_core::ensemble::lowerings::{Make, Outcome};
use hydro_core::ensemble::measures::{Settling, MEASURES};
use hydro_core::ensemble::member::{Column, Condition, Makeup, DEFAULTS};
use hydro_core::ensemble::requirement::{Requirement, Signal, Template};
use hydro_core::ensemble::trial::Trial;
use hydro_core::ensemble::verdict::Verdict;
use hydro_core::error::Error;
use hydro_core::lanes::{Precision, Width};
use hydro_core::mast::LiftName;
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::closed_loop::{Controller, Reading};
use hydro_core::run::Lifts;
use hydro_core::truck::{Truck, Value};

/// Feeds the speed asked for forward and corrects it by what the encoder says.
struct Plain {
    gain: i32,
    before: [i32; 2],
    wanted: i32,
}

impl Controller for Plain {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        self.wanted = request;
        let currents = [0, 1].map(|k| {
            let speed = 98 * (self.before[k] - reading.position[k]);
            (400 + request + self.gain * (request - speed) / 64 + reading.pressure[k] % 4).clamp(0, 1400)
        });
        self.before = reading.position;
        if request == 0 {
            [0, 0]
        } else {
            currents
        }
    }
    fn reference(&self) -> [i32; 2] {
        [self.wanted, self.wanted]
    }
}

fn make(numbers: &[f64]) -> Result<Box<dyn Controller>, Error> {
    Ok(Box::new(Plain { gain: numbers[0] as i32, before: [500, 1000], wanted: 0 }))
}

const MAKE: Make = &make;

/// A fixed-point controller whose settings are the member's.
fn fixed(numbers: &[f64]) -> Result<Box<dyn Controller>, Error> {
    let gain = numbers[0];
    let lift = Lift {
        numbers: LiftSettings {
            proportional: 0.002 * gain,
            integral: 1.2,
            derivative: 0.0008,
            a: -0.003,
            b: 1.86,
            c: -0.31,
            d: -0.05,
            forks_per_count: 1.0,
            filter_rate: 20.0,
            delay: 8.0 - gain / 16.0,
            u_min: 0.0,
            u_max: 640.0,
            i_min: 0.0,
            i_max: 1400.0,
            adaptation_s: 0.5 * gain,
            swing_limit: 0.0,
            early_corner: 1.5,
            prediction: gain / 64.0,
            overspeed: 0.0,
            overspeed_from: 590.0,
        },
        table: Curve { first: 0, spacing: 5, values: (0..21).map(|k| 400.0 + 45.0 * f64::from(k)).collect() },
        ratio: Curve { first: 900, spacing: 8, values: vec![1.0, 0.3] },
        swing: None,
        shaper: None,
    };
    let shared = SharedSettings {
        request_most: 590.0,
        ramp_up: 600.0,
        ramp_down: 900.0,
        ramp_corner: 1.5,
        temperature_least: -20.0,
        temperature_most: 90.0,
    };
    let config = Settings { shared, lifts: [lift.clone(), lift] }.config(Word::Bits16)?;
    Ok(Box::new(FixedPoint::new(config)))
}

const FIXED: Make = &fixed;

fn trial(extended: bool, lifts: Lifts) -> Trial {
    let mut values = thesis_values();
    if extended {
        values.insert("free.friction_temperature.rate".into(), Value::Number(0.01));
    }
    let truck = Truck::from_values(values).unwrap();
    let place = |name: &str| truck.names().iter().position(|known| known == name).unwrap();
    let omega = place("free.valve.omega");
    let columns = vec![
        (Column::Condition(Condition::Load), Distribution::Uniform { lower: 0.0, upper: 1500.0 }),
        (Column::Condition(Condition::OilTemperature), Distribution::Uniform { lower: 10.0, upper: 60.0 }),
        // Wide enough that the valve's steps are cut differently from member to member.
        (Column::Parameter(omega), Distribution::LogUniform { lower: 20.0, upper: 2000.0 }),
        (Column::Controller(0), Distribution::Choice(vec![0.0, 4.0, 64.0])),
        (Column::Level(1), Distribution::Uniform { lower: 0.1, upper: 0.5 }),
        (Column::Condition(Condition::EncoderFactor), Distribution::Choice(vec![1.0, 0.9])),
    ];
    let profile = vec![(0.0, 0.0), (0.4, 0.3), (2.4, 0.2)];
    let makeup = Makeup::new(truck, lifts, DEFAULTS, profile, vec![4.0], columns, 11).unwrap();
    let on = |signal, template| Requirement { lift: 0, signal, peak_to_peak_s: None, template };
    let calm = Template::NeverAfterSettling { upper: 0.1, after_s: 1.0 };
    let all = f64::INFINITY;
    Trial {
        makeup,
        requirements: vec![
            on(Signal::Speed, Template::Always { lower: -all, upper: 0.6, from_s: 0.0, to_s: all }),
            Requirement { peak_to_peak_s: Some(0.5), ..on(Signal::Speed, calm) },
            on(Signal::Error, Template::Settles { band: 0.1, within_s: 1.0 }),
        ],
        settling: Settling { after_s: 1.0, band_m_s: 0.05 },
        tick_s: 0.02,
        ticks: 200,
        substeps: 2,
        precision: Precision::Double,
        followed: true,
    }
}

fn columns(trial: &Trial, count: usize) -> Vec<f64> {
    let dimensions = trial.makeup.columns.len();
    let uniform = draw::uniform(5, 0, count, dimensions);
    uniform.chunks_exact(dimensions).flat_map(|u| trial.makeup.at(u)).collect()
}

fn bits(outcome: &Outcome) -> (Verdict, Vec<u64>) {
    let bits = |x: &f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
    (outcome.verdict, outcome.numbers.iter().map(bits).collect())
}

#[test]
fn a_members_bits_depend_on_no_lane_mate_no_chunk_no_width_and_no_thread() {
    // Controllers asked one lane after the other, and such as run in lanes, with settings of their own.
    for (extended, lifts, make, precision) in [
        (false, Lifts::One(LiftName::Free), MAKE, Precision::Double),
        (true, Lifts::Both, MAKE, Precision::Double),
        (false, Lifts::One(LiftName::Free), FIXED, Precision::Double),
        (false, Lifts::Both, FIXED, Precision::Double),
        (true, Lifts::Both, MAKE, Precision::Single),
        (false, Lifts::One(LiftName::Free), FIXED, Precision::Single),
    ] {
        let trial = Trial { precision, ..trial(extended, lifts) };
        let run = |trial: &Trial, columns: &[f64], streams: &[u64], width: Width| -> Vec<(Verdict, Vec<u64>)> {
            trial.run(columns, streams, make, width, &|| false).unwrap().iter().map(bits).collect()
        };
        let (count, per) = (40, trial.makeup.columns.len());
        let all = columns(&trial, count);
        let streams: Vec<u64> = (0..count as u64).collect();
        let widest = run(&trial, &all, &streams, precision.widest());
        for width in precision.widths().iter().filter(|width| width.is_here()) {
            assert_eq!(run(&trial, &all, &streams, *width), widest, "{width:?}");
        }
        // Other mates, in another order, in pieces.
        let mut pieces = Vec::new();
        for piece in (0..count).rev().collect::<Vec<_>>().chunks(7) {
            let some: Vec<f64> = piece.iter().flat_map(|&k| all[k * per..(k + 1) * per].to_vec()).collect();
            let own: Vec<u64> = piece.iter().map(|&k| streams[k]).collect();
            pieces.extend(run(&trial, &some, &own, precision.widest()));
        }
        pieces.reverse();
        assert_eq!(pieces, widest);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert_eq!(one.install(|| run(&trial, &all, &streams, precision.widest())), widest);
        // Members do differ, and one by itself has its bits and its trajectory.
        assert!(widest.iter().any(|outcome| outcome.0 != Verdict::OutOfBounds));
        assert!(widest.windows(2).any(|pair| pair[0] != pair[1]));
        for k in [0, 17, 39] {
            let own = &all[k * per..(k + 1) * per];
            if widest[k].0 == Verdict::OutOfBounds {
                assert!(trial.trace(own, streams[k], make, &|| false).is_err());
                continue;
            }
            let (outcome, trace) = trial.trace(own, streams[k], make, &|| false).unwrap();
            assert_eq!(bits(&outcome), widest[k]);
            assert_eq!((trace.outputs.len(), trace.orders.len()), (200 * OUTPUTS.len(), 200));
            // The watched peak is that of the trajectory.
            let velocity = OUTPUTS.iter().position(|o| o.name == "velocity_free_m_s").unwrap();
            let fastest = trace.outputs.chunks(OUTPUTS.len()).map(|row| -row[velocity]).fold(f64::MIN, f64::max);
            let peak = MEASURES.iter().position(|(name, ..)| *name == "peak_speed_m_s").unwrap();
            assert_eq!(outcome.numbers[trial.requirements.len() + peak], fastest);
        }
    }
}

/// What half the bits change: far less than a substep leaves, while the controllers order the same.
#[test]
fn single_precision_is_double_precision_to_a_tenth_of_a_millimetre_per_second() {
    let double = trial(false, Lifts::One(LiftName::Free));
    let single = Trial { precision: Precision::Single, ..double.clone() };
    let velocity = OUTPUTS.iter().position(|o| o.name == "velocity_free_m_s").unwrap();
    let (all, per) = (columns(&double, 40), double.makeup.columns.len());
    let mut compared = 0;
    for k in 0..40 {
        let own = &all[k * per..(k + 1) * per];
        let Ok((_, fine)) = double.trace(own, k as u64, FIXED, &|| false) else { continue };
        let (_, coarse) = single.trace(own, k as u64, FIXED, &|| false).unwrap();
        let rows = fine.outputs.chunks(OUTPUTS.len()).zip(coarse.outputs.chunks(OUTPUTS.len()));
        for ((a, b), (own, other)) in rows.zip(fine.orders.iter().zip(&coarse.orders)) {
            // A reading that is rounded the other way leads elsewhere.
            if own != other {
                break;
            }
            assert!((a[velocity] - b[velocity]).abs() < 1e-4, "member {k}: {} and {}", a[velocity], b[velocity]);
            compared += 1;
        }
    }
    assert!(compared > 4000, "{compared}");
}

#[test]
fn what_is_out_of_bounds_has_a_verdict_and_disturbs_no_other() {
    let mut trial = trial(false, Lifts::One(LiftName::Free));
    let truck = &trial.makeup.truck;
    let stiff = truck.names().iter().position(|name| name == "free.friction.sigma_0").unwrap();
    let columns = vec![
        (Column::Condition(Condition::Load), Distribution::Uniform { lower: 0.0, upper: 1500.0 }),
        (Column::Parameter(stiff), Distribution::LogUniform { lower: 1.0, upper: 1e8 }),
    ];
    trial.makeup = Makeup::new(
        truck.clone(),
        Lifts::One(LiftName::Free),
        DEFAULTS,
        vec![(0.0, 0.0), (0.4, 0.3)],
        vec![4.0],
        columns,
        11,
    )
    .unwrap();
    // A stiff bristle among the mates changes none of their bits.
    let all = [800.0, 2500.0, -1.0, 2500.0, 800.0, 1e8, 800.0, 2500.0];
    let found = trial.run(&all, &[0, 1, 2, 0], MAKE, trial.precision.widest(), &|| false).unwrap();
    assert_eq!(found[1].verdict, Verdict::OutOfBounds);
    assert!(found[1].numbers.iter().all(|x| x.is_nan()));
    assert_eq!(bits(&found[0]), bits(&found[3]));
    let alone = trial.run(&all[..2], &[0], MAKE, trial.precision.widest(), &|| false).unwrap();
    assert_eq!(bits(&found[0]), bits(&alone[0]));
}

/// As [`make`]; there is none of some gains.
fn picky(numbers: &[f64]) -> Result<Box<dyn Controller>, Error> {
    if numbers[0] == 64.0 {
        let (name, value, requirement) = ("gain".to_string(), "64".to_string(), "below 64".to_string());
        return Err(Error::Argument { name, value, requirement });
    }
    make(numbers)
}

#[test]
fn a_member_whose_controller_cannot_be_made_has_a_verdict_and_disturbs_no_other() {
    for lifts in [Lifts::One(LiftName::Main), Lifts::Both] {
        let trial = trial(false, lifts);
        let (all, per) = (columns(&trial, 24), trial.makeup.columns.len());
        let streams: Vec<u64> = (0..24).collect();
        let width = trial.precision.widest();
        let whole = trial.run(&all, &streams, MAKE, width, &|| false).unwrap();
        let found = trial.run(&all, &streams, &picky, width, &|| false).unwrap();
        let gain = |k: usize| all[k * per + 3];
        assert!((0..24).any(|k| gain(k) == 64.0) && (0..24).any(|k| gain(k) != 64.0));
        for k in 0..24 {
            if gain(k) != 64.0 {
                assert_eq!(bits(&found[k]), bits(&whole[k]));
                continue;
            }
            assert_eq!(found[k].verdict, Verdict::OutOfBounds);
            assert!(found[k].numbers.len() == trial.numbers() && found[k].numbers.iter().all(|x| x.is_nan()));
            // By itself the member says why.
            let own = &all[k * per..(k + 1) * per];
            assert!(trial.trace(own, k as u64, &picky, &|| false).is_err());
        }
    }
}

#[test]
fn without_a_controller_nothing_is_asked_of_the_speed_asked_for() {
    let followed = trial(false, Lifts::One(LiftName::Free));
    assert!(followed.check().is_ok());
    let open = Trial { followed: false, ..followed };
    assert!(matches!(open.check(), Err(Error::Argument { name, .. }) if name == "signal"));
}

#[test]
fn an_interrupt_ends_an_ensemble() {
    let mut trial = trial(false, Lifts::One(LiftName::Free));
    trial.ticks = 2000;
    let all = columns(&trial, 4);
    let ended = trial.run(&all, &[0, 1, 2, 3], MAKE, trial.precision.widest(), &|| true);
    assert!(matches!(ended, Err(Error::Interrupted { .. })));
}
