//! Recordings that run side by side are each alone to the bit: whatever their lengths, loads, temperatures, starts
//! and clocks, whichever lifts they command, and whatever effects the truck has.

mod common;

use common::space::{cases, plausible, values_near_the_thesis};
use common::truck_with;
use hydro_core::effects::Instance;
use hydro_core::mast::LiftName;
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::sensitivity::{differentiate, differentiate_all, Case};
use hydro_core::run::Inputs;
use hydro_core::truck::{Truck, Value};
use proptest::prelude::*;

const TICK: f64 = 0.02;

#[derive(Debug, Clone)]
struct Recorded {
    time: Vec<f64>,
    wanted: Vec<f64>,
    command: Vec<[f64; 2]>,
    temperature: Vec<f64>,
    load_kg: f64,
    warmer: f64,
    warming: f64,
    start: [f64; 2],
}

impl Recorded {
    fn case(&self) -> Case<'_> {
        let inputs = Inputs {
            time: &self.time,
            command: &self.command,
            oil_temperature_degc: &self.temperature,
            load_kg: self.load_kg,
        };
        let Recorded { warmer, warming, start, .. } = *self;
        Case { inputs, wanted: &self.wanted, warmer, warming, start, command_slope: &[] }
    }
}

/// On the usual clock, on one that starts later, on one that jitters, or read off between its ticks; of both lifts, or
/// of one while the other rests.
fn recordings() -> impl Strategy<Value = Recorded> {
    let conditions = (0.0..1500.0, -3.0..3.0, 0.0..2.0, 0.3..1.0, 0.5..2.0);
    let steps = prop::collection::vec((0.0..1.2, 0.0..1.2, 1usize..30), 1..6);
    let moves = prop::sample::select(vec![[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
    (0usize..6, steps, moves, -5.0..50.0, conditions).prop_map(|(clock, steps, moves, degc, conditions)| {
        let (load_kg, warmer, warming, free, main) = conditions;
        let held =
            |&(free, main, ticks): &(f64, f64, usize)| std::iter::repeat_n([moves[0] * free, moves[1] * main], ticks);
        let command: Vec<[f64; 2]> = steps.iter().flat_map(held).collect();
        let at = |k: usize| match clock {
            3 => k as f64 * TICK + 1.0,
            4 => k as f64 * TICK + if k % 3 == 1 { 0.001 } else { 0.0 },
            _ => k as f64 * TICK,
        };
        let time: Vec<f64> = (0..command.len()).map(at).collect();
        let wanted = match clock {
            5 => time.iter().map(|t| t + 0.4 * TICK).collect(),
            _ => time.clone(),
        };
        let temperature = (0..time.len()).map(|k| degc + 0.01 * k as f64).collect();
        Recorded { time, wanted, command, temperature, load_kg, warmer, warming, start: [free, main] }
    })
}

/// The thesis's truck, with one effect as large as is plausible, or with all of a lift.
fn trucks() -> impl Strategy<Value = Truck> {
    let all: Vec<Instance> = Instance::all().collect();
    let with = |effects: &[Instance], share: f64| {
        let mut changes = Vec::new();
        for effect in effects {
            let spec = effect.kind.spec();
            for (k, parameter) in spec.parameters.iter().enumerate() {
                let value = match k < effect.kind.amplitudes() {
                    true => spec.quiet + share * (spec.plausible[0][1] - spec.quiet),
                    false => plausible(effect, k),
                };
                changes.push((format!("{}.{}", effect.name(), parameter.name), value));
            }
        }
        let changes: Vec<(&str, f64)> = changes.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        truck_with(&changes)
    };
    prop_oneof![
        1 => Just(truck_with(&[])),
        4 => (prop::sample::select(all.clone()), 0.1..1.0).prop_map(move |(one, share)| with(&[one], share)),
        1 => prop::sample::select(LiftName::BOTH.to_vec()).prop_map(move |lift| {
            let own: Vec<Instance> = all.iter().copied().filter(|one| one.lift == Some(lift)).collect();
            with(&own, 0.1)
        }),
    ]
}

proptest! {
    #![proptest_config(cases(64))]
    #[test]
    fn every_recording_beside_others_is_the_recording_alone(
        truck in trucks(),
        recordings in prop::collection::vec(recordings(), 1..20),
        substeps in 1usize..6,
        threads in 1usize..5,
    ) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let given: Vec<Case> = recordings.iter().map(Recorded::case).collect();
        let alone = given.iter().map(|case| differentiate(&truck, case, substeps, &[], &|| false));
        match pool.install(|| differentiate_all(&truck, &given, substeps, &[], &|| false)) {
            Ok(beside) => {
                for (k, (beside, alone)) in beside.iter().zip(alone).enumerate() {
                    let alone = alone.unwrap();
                    let bits = |outputs: &[f64]| outputs.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                    prop_assert!(bits(&beside.outputs) == bits(&alone.outputs), "recording {}", k);
                    prop_assert!(beside.derivatives.is_empty());
                }
            }
            Err((k, error)) => {
                let first = alone.enumerate().find_map(|(k, run)| run.err().map(|error| (k, error.to_string())));
                prop_assert_eq!(Some((k, error.to_string())), first);
            }
        }
    }
}

#[test]
fn a_recording_that_no_run_takes_is_told_by_its_place() {
    let truck = truck_with(&[]);
    let time: Vec<f64> = (0..200).map(|k| k as f64 * TICK).collect();
    let command = vec![[0.6; 2]; time.len()];
    let temperature = vec![40.0; time.len()];
    let at = |load_kg: f64| Case {
        inputs: Inputs { time: &time, command: &command, oil_temperature_degc: &temperature, load_kg },
        wanted: &time,
        warmer: 0.0,
        warming: 0.0,
        start: LiftName::BOTH.map(LiftName::start_position),
        command_slope: &[],
    };
    let (place, error) =
        differentiate_all(&truck, &[at(0.0), at(500.0), at(-1.0), at(900.0)], 4, &[], &|| false).unwrap_err();
    assert_eq!(place, 2);
    assert!(error.to_string().contains("load"), "{error}");
    let (place, error) = differentiate_all(&truck, &[at(0.0), at(500.0)], 4, &[], &|| true).unwrap_err();
    assert_eq!(place, 0);
    assert!(error.to_string().contains("interrupt"), "{error}");
}

proptest! {
    #![proptest_config(cases(128))]
    /// It seeps, and swings on its oil by a few millimetres at most: in the middle of its stroke and on either stop,
    /// however light it is, for any truck whose parameters a fit may come by.
    #[test]
    fn a_lift_that_no_command_moves_stays_where_it_is(
        values in values_near_the_thesis(1.6),
        mut recorded in recordings(),
        lift in prop::sample::select(LiftName::BOTH.to_vec()),
        light in any::<bool>(),
        place in prop_oneof![2 => 0.0..1.0, 1 => Just(0.0), 1 => Just(1.0)],
        substeps in 3usize..9,
    ) {
        let k = usize::from(lift == LiftName::Main);
        let lift = lift.as_str();
        let stop = |end: &str| match values[&format!("{lift}.cylinder.stroke_{end}")] {
            Value::Number(at) => at,
            Value::Table(_) => unreachable!(),
        };
        let (lower, upper) = (stop("lower"), stop("upper"));
        recorded.start[k] = lower + place * (upper - lower);
        recorded.command.iter_mut().for_each(|both| both[k] = 0.0);
        if light {
            recorded.load_kg = 0.0;
        }
        let truck = Truck::from_values(values).unwrap();
        let run = differentiate(&truck, &recorded.case(), substeps, &[], &|| false).unwrap();
        let name = format!("position_{lift}_m");
        let column = OUTPUTS.iter().position(|output| output.name == name).unwrap();
        let began = run.outputs[column];
        for row in run.outputs.chunks_exact(OUTPUTS.len()) {
            let moved = row[column] - began;
            prop_assert!(moved.abs() < 5e-3, "{name} moves by {moved} m");
        }
    }
}
