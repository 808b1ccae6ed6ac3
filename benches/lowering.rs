//! Nanoseconds for one lowering of ten seconds and one lane: `cargo bench --bench lowering`.
//!
//! The free lift of the thesis, 800 kg, 40 °C, the first PRMS reference's command, four substeps
//! a tick: f64, lanes of 4, 8 and 16, duals of 8 directions, duals over lanes. A row's "elements" are
//! lanes, so that criterion's throughput is lowerings per second.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use criterion::measurement::WallTime;
use criterion::{criterion_group, criterion_main, BenchmarkGroup, Criterion, Throughput};
use hydro_core::dual::Dual;
use hydro_core::lanes::{with_eight, with_sixteen, LaneScalar, LaneWork, Lanes};
use hydro_core::mast::{LiftName, Mast, Thesis, STATES};
use hydro_core::scalar::Scalar;
use hydro_core::solver::fixed::{Fixed, ValveRates, ValveSteps};
use hydro_core::solver::vectors::{widest, Work};

const SUBSTEPS: usize = 4;
const TICK: f64 = 0.02;

#[derive(Clone)]
struct Lowering<S> {
    fixed: Fixed<S, Thesis, 1>,
    command: Vec<f64>,
}

impl<S: Scalar> Work for Lowering<S> {
    type Number = S;
    type Output = S;
    #[inline(always)]
    fn run(mut self) -> S {
        for (k, &u) in self.command.iter().enumerate() {
            self.fixed.mast.set_inputs([S::constant(u)], S::constant(40.0));
            let then = self.command.get(k + 1).copied().unwrap_or(u);
            for left in (0..SUBSTEPS).rev() {
                self.fixed.substep(Some([S::constant(if left > 0 { u } else { then })]));
            }
        }
        self.fixed.lift(0).x
    }
}

fn lowering<S: Scalar>(value: impl Fn(usize, f64) -> S) -> Lowering<S> {
    let reference = common::references().into_iter().find(|r| r.name == "free_prms1_800kg_40c").expect("it is there");
    let command = reference.command.iter().take(500).map(|u| u[0]).collect();
    let truck = common::truck_with(&[]);
    let (lifts, _) = truck.build([LiftName::Free], S::constant(800.0), value).expect("it has no effects");
    let mut start = vec![S::zero(); STATES];
    lifts[0].at_rest(S::constant(LiftName::Free.start_position())).write(&mut start);
    let mut mast = Mast { lifts, physics: Thesis, command: [S::zero()], oil_temperature_degc: S::constant(40.0) };
    mast.set_inputs([S::zero()], S::constant(40.0));
    let h = TICK / SUBSTEPS as f64;
    let valve_steps = ValveSteps::of(ValveRates::default().with(&mast.lifts[0].valve), h);
    Lowering { fixed: Fixed::new(mast, &start, h, valve_steps), command }
}

struct Row<'a, 'b>(&'a mut BenchmarkGroup<'b, WallTime>);

impl<const N: usize> LaneWork<N> for Row<'_, '_> {
    type Output = ();
    fn run<S: LaneScalar<N>>(self) {
        let ready = lowering(|_, v| S::constant(v));
        self.0.throughput(Throughput::Elements(N as u64));
        self.0.bench_function(format!("lanes_{N}"), |b| b.iter(|| widest(ready.clone())));
    }
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("lowering_10s");
    macro_rules! row {
        ($name:literal, $lanes:expr, $value:expr) => {
            let ready = lowering($value);
            group.throughput(Throughput::Elements($lanes));
            group.bench_function($name, |b| b.iter(|| widest(ready.clone())));
        };
    }
    row!("f64", 1, |_, v| v);
    row!("lanes_4", 4, |_, v| Lanes([v; 4]));
    with_eight(Row(&mut group));
    with_sixteen(Row(&mut group));
    row!("dual_8", 1, |k, v| if k < 8 { Dual::<f64, 8>::variable(v, k) } else { Dual::constant(v) });
    row!("dual_16", 1, |k, v| if k < 16 { Dual::<f64, 16>::variable(v, k) } else { Dual::constant(v) });
    row!("dual_32", 1, |k, v| if k < 32 { Dual::<f64, 32>::variable(v, k) } else { Dual::constant(v) });
    row!("dual_8_lanes_4", 4, |k, v| {
        let x = Lanes([v; 4]);
        if k < 8 {
            Dual::<Lanes<4>, 8>::variable(x, k)
        } else {
            Dual::from_real(x)
        }
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
