mod common;
use common::space::{cases, differences, trucks, within};
use common::{truck_with, TICK};
use hydro_core::error::Error;
use hydro_core::mast::LiftName;
use hydro_core::parameters::Scale;
use hydro_core::run::{simulate, Inputs, Lifts, Run, Solver};
use hydro_core::truck::Truck;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use std::cell::RefCell;
use std::collections::BTreeMap;

fn run(truck: &Truck, lifts: Lifts, load: f64, temp: f64, command: &[[f64; 2]], solver: Solver) -> Result<Run, Error> {
    let time: Vec<f64> = (0..command.len()).map(|k| k as f64 * TICK).collect();
    let inputs = Inputs { time: &time, command, oil_temperature_degc: &vec![temp; time.len()], load_kg: load };
    let n = std::cell::Cell::new(0);
    simulate(truck, lifts, &inputs, &time, solver, None, &|| {
        n.set(n.get() + 1);
        n.get() > 20_000
    })
}

#[test]
fn zz_search() {
    let fixed = std::env::var("WHICH").as_deref() != Ok("adaptive");
    let mut runner = TestRunner::new(cases(300));
    let commands = proptest::collection::vec([0.0..1.75f64, 0.0..1.75f64], 1..6)
        .prop_map(|levels| levels.iter().flat_map(|l| vec![*l; 10]).collect::<Vec<_>>());
    let usual = truck_with(&[]);
    let outcomes: RefCell<BTreeMap<String, usize>> = RefCell::default();
    let worst_time = RefCell::new(0.0f64);
    let strategy = (trucks(), within(0.0, 2e4, Scale::Linear), -50.0..150.0f64, commands);
    let result = runner.run(&strategy, |(truck, load, temp, command)| {
        let solver = if fixed { Solver::Fixed { substeps: 8 } } else { Solver::Adaptive { tolerance: 1e-4 } };
        let t = std::time::Instant::now();
        let r = run(&truck, Lifts::Both, load, temp, &command, solver);
        let e = t.elapsed().as_secs_f64();
        if e > *worst_time.borrow() {
            *worst_time.borrow_mut() = e;
            if e > 1.0 {
                println!("{e} s");
            }
        }
        let word = match &r {
            Ok(run) => {
                let n = run.state_names.len();
                let mut big = 0.0f64;
                let mut what = String::new();
                for row in run.states.chunks_exact(n) {
                    for k in 0..n {
                        let s = [10.0, 1e3, 10.0, 100.0, 100.0, 1e3, 1e9, 1e9, 1e-2][k % 9];
                        let m = (row[k] / s).abs();
                        if m > big || !m.is_finite() {
                            big = m;
                            what = run.state_names[k].clone();
                        }
                    }
                }
                if big > 1.0 {
                    format!("big {what}")
                } else {
                    "ok".into()
                }
            }
            Err(e) => {
                let s = match e {
                    Error::NotFinite { worst_state, .. } => worst_state.clone(),
                    Error::StepTooSmall { worst_state, .. } => worst_state.clone(),
                    _ => String::new(),
                };
                format!("{} {s}", e.code())
            }
        };
        *outcomes.borrow_mut().entry(word.clone()).or_default() += 1;
        if std::env::var("SHRINK").as_deref() == Ok(word.as_str()) {
            return Err(TestCaseError::fail(format!(
                "{:?}\nload {load} temp {temp} command {:?}\n{}",
                r.err(),
                command.iter().step_by(10).collect::<Vec<_>>(),
                differences(&truck, &usual)
            )));
        }
        Ok(())
    });
    println!("{:#?} worst {} s", outcomes.borrow(), worst_time.borrow());
    if let Err(e) = result {
        println!("{}", e.to_string().split("minimal failing").next().unwrap());
    }
    let _ = LiftName::Free;
}
