//! Which share of what the processor's ports can do a lowering uses: `cargo bench --bench port_share`.
//!
//! A number that counts what is done with it lowers the free lift for ten seconds at sixteen loads, with two substeps a tick;
//! then the same lowerings run in sixteen lanes (or as many as the processor has registers for), one core. Beside it each kind
//! of operation is timed by itself in the same lanes, eight that do not wait for each other at a time: its throughput.
//! Additions, multiplications and choices share ports, divisions and roots the divider, which works beside them. The share of
//! each unit is how long its operations take at their throughput, over the time of the lowering. The counts are of the source:
//! what the compiler finds twice is done once.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use std::cell::Cell;
use std::hint::black_box;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::time::Instant;

use hydro_core::elementary::{self, Binary};
use hydro_core::lanes::{with_registers, LaneScalar, LaneWork, Precision};
use hydro_core::mast::{LiftName, Mast, Thesis, STATES};
use hydro_core::run::drive::Drive;
use hydro_core::run::ticks::{Clock, Oil, Ticks, Warmer};
use hydro_core::scalar::Scalar;
use hydro_core::solver::vectors::{widest, Work};

const TICKS: usize = 500;
const SUBSTEPS: usize = 2;
const TURNS: usize = 60;
const LOADS: usize = 16;

const KINDS: [&str; 5] = ["additions", "multiplications", "divisions", "roots", "comparisons and choices"];
const ADD: usize = 0;
const MULTIPLY: usize = 1;
const DIVIDE: usize = 2;
const ROOT: usize = 3;
const CHOOSE: usize = 4;

thread_local! {
    static COUNTS: [Cell<u64>; KINDS.len()] = const { [const { Cell::new(0) }; KINDS.len()] };
}

fn count(kind: usize) {
    COUNTS.with(|counts| counts[kind].set(counts[kind].get() + 1));
}

/// A number that counts what is done with it.
#[derive(Debug, Clone, Copy)]
struct Counted(f64);

macro_rules! binary {
    ($($trait:ident $method:ident $op:tt $kind:ident),*) => {$(
        impl $trait for Counted {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                count($kind);
                Counted(self.0 $op other.0)
            }
        }
    )*};
}
binary!(Add add + ADD, Sub sub - ADD, Mul mul * MULTIPLY, Div div / DIVIDE);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        count(CHOOSE);
        Counted(-self.0)
    }
}

impl Binary for Counted {
    fn two_to(self) -> Self {
        count(CHOOSE);
        Counted(self.0.two_to())
    }
    fn split(self) -> (Self, Self) {
        count(CHOOSE);
        let (k, m) = self.0.split();
        (Counted(k), Counted(m))
    }
}

impl Scalar for Counted {
    type Mask = bool;
    const NUMBERS: usize = 1;
    type Real = Counted;

    fn constant(value: f64) -> Self {
        Counted(value)
    }
    fn from_real(value: Self) -> Self {
        value
    }
    fn real(self) -> Self {
        self
    }
    fn implicit(root: Self, _residual: Self, _slope: Self) -> Self {
        root
    }
    fn lt(self, other: Self) -> bool {
        count(CHOOSE);
        self.0 < other.0
    }
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        count(CHOOSE);
        if mask {
            yes
        } else {
            no
        }
    }
    fn is_finite(self) -> bool {
        count(CHOOSE);
        self.0.is_finite()
    }
    fn largest(self) -> f64 {
        self.0
    }
    fn sqrt(self) -> Self {
        count(ROOT);
        Counted(self.0.sqrt())
    }
    fn exp(self) -> Self {
        elementary::exp(self)
    }
    fn ln(self) -> Self {
        elementary::ln(self)
    }
    // Before a run alone.
    fn cos(self) -> Self {
        Counted(self.0.cos())
    }
    fn sin(self) -> Self {
        Counted(self.0.sin())
    }
    fn inverse_fourth_root(self) -> Self {
        elementary::inverse_fourth_root(self)
    }
    // One instruction each, as in lanes.
    fn max(self, other: Self) -> Self {
        count(CHOOSE);
        Counted(Scalar::max(self.0, other.0))
    }
    fn min(self, other: Self) -> Self {
        count(CHOOSE);
        Counted(Scalar::min(self.0, other.0))
    }
    fn abs(self) -> Self {
        count(CHOOSE);
        Counted(self.0.abs())
    }
}

/// Currents of a second and a half each.
struct Played;

impl<S: Scalar> Drive<S, 1> for Played {
    fn known_ahead(&self) -> bool {
        true
    }
    fn tick(&mut self, _k: usize, _x: &[S], _oil_temperature_degc: S) {}
    fn command(&self, k: usize) -> [S; 1] {
        [S::constant([0.0, 0.55, 0.45, 0.62, 0.5, 0.4, 0.0][k.min(TICKS - 1) * 7 / TICKS])]
    }
}

/// A lowering at these loads: seconds, and where each ended.
fn lowering<S: Scalar>(load_kg: S) -> (f64, S) {
    let truck = common::truck_with(&[]);
    let time: Vec<f64> = (0..TICKS).map(|k| 0.02 * k as f64).collect();
    let oil = vec![40.0; TICKS];
    let (lifts, _) = truck.build([LiftName::Free], load_kg, |_, v| S::constant(v)).expect("no effects");
    let from = [S::constant(LiftName::Free.start_position())];
    let (mast, start) = Mast::at_rest(lifts, Thesis, from, [S::zero()], S::constant(40.0));
    let mut end = S::zero();
    let mut record = |_, x: &[S]| end = x[0];
    let ticks = Ticks {
        mast,
        drive: &mut Played,
        clock: Clock { time: &time, oil_temperature_degc: &oil },
        oil: Oil::Warmer(Warmer::none()),
        start: &start,
        wanted: &time,
        substeps: SUBSTEPS,
        record: &mut record,
        carry_on: true,
        interrupt: &|| false,
    };
    let began = Instant::now();
    widest(ticks).map_err(|_| "stopped").expect("every lane runs");
    (began.elapsed().as_secs_f64(), end)
}

/// Eight numbers, each many times through one operation.
struct Throughput<S> {
    kind: usize,
    from: S,
}

const TOGETHER: usize = 8;
const ROUNDS: usize = 2000;

impl<S: Scalar> Work for Throughput<S> {
    type Number = S;
    type Output = f64;
    #[inline(always)]
    fn run(self) -> f64 {
        let mut x = [self.from; TOGETHER];
        let (one, tiny) = (black_box(S::constant(1.000_000_1)), black_box(S::constant(1e-9)));
        // A closure that is not inlined is compiled without the vectors.
        macro_rules! timed {
            ($x:ident => $next:expr) => {{
                let began = Instant::now();
                for _ in 0..ROUNDS {
                    for $x in &mut x {
                        *$x = $next;
                    }
                }
                began.elapsed().as_secs_f64()
            }};
        }
        let took = match self.kind {
            ADD => timed!(x => *x + tiny),
            MULTIPLY => timed!(x => *x * one),
            DIVIDE => timed!(x => *x / one),
            ROOT => timed!(x => x.sqrt()),
            _ => timed!(x => x.max(tiny)),
        };
        black_box(x);
        took / (TOGETHER * ROUNDS) as f64
    }
}

struct Share;

impl<const N: usize> LaneWork<N> for Share {
    /// Least seconds of a lowering, and of each kind of operation; for each lane.
    type Output = (f64, [f64; KINDS.len()]);
    fn run<S: LaneScalar<N>>(self) -> Self::Output {
        let load = S::from_lanes(std::array::from_fn(|lane| load_kg(lane * LOADS / N)));
        let (mut least, mut each) = (f64::INFINITY, [f64::INFINITY; KINDS.len()]);
        for _ in 0..TURNS {
            let (took, end) = lowering(load);
            assert!(end.lanes().iter().all(|x| x.is_finite()));
            least = least.min(took);
            for (kind, each) in each.iter_mut().enumerate() {
                *each = each.min(widest(Throughput { kind, from: S::constant(1.5) }));
            }
        }
        (least / N as f64, each.map(|one| one / N as f64))
    }
}

fn load_kg(k: usize) -> f64 {
    1500.0 * k as f64 / (LOADS - 1) as f64
}

fn main() {
    for k in 0..LOADS {
        lowering(Counted(load_kg(k)));
    }
    let counts = COUNTS.with(|counts| counts.each_ref().map(|count| count.get() as f64 / LOADS as f64));
    let (took, each) = with_registers(Precision::Double.widest(), Share);
    let all = counts.iter().sum::<f64>();
    let columns = ["operation", "a state and substep", "of all", "ns each"];
    println!("{} lanes, {SUBSTEPS} substeps a tick", Precision::Double.widest().lanes());
    println!("{}", columns.map(|column| format!("{column:>26}")).concat());
    let per_state = 1.0 / (TICKS * SUBSTEPS * STATES) as f64;
    for (kind, name) in KINDS.iter().enumerate() {
        let (count, share) = (counts[kind] * per_state, format!("{:.1}%", 100.0 * counts[kind] / all));
        println!("{name:>26}{count:>26.1}{share:>26}{:>26.4}", 1e9 * each[kind]);
    }
    let busy = |unit: &[usize]| unit.iter().map(|&kind| counts[kind] * each[kind]).sum::<f64>() / took;
    println!(
        "a lowering: {:.1} us a lane, {:.2} ns a state and substep; busy of that: adders and multipliers {:.0} %, divider {:.0} %",
        1e6 * took,
        1e9 * took * per_state,
        100.0 * busy(&[ADD, MULTIPLY, CHOOSE]),
        100.0 * busy(&[DIVIDE, ROOT]),
    );
}
