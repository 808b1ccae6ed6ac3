//! The fast path and the adaptive integrator as one more peer of `benches/peers`.
//!
//!     cargo bench --bench lowerings -- LOWERINGS TRAJECTORIES substeps=3 lanes=8
//!     cargo bench --bench lowerings -- LOWERINGS TRAJECTORIES tolerance=1e-4
//!
//! Reads and writes the two binary files of `benches/peers/lowerings.h`: the free lift with the
//! thesis's values, one core. `lanes=1` is plain `f64`.

#[path = "../crates/hydro_core/tests/common/mod.rs"]
mod common;

use std::time::Instant;

use hydro_core::lanes::{with_eight, with_sixteen, LaneScalar, LaneWork, Lanes};
use hydro_core::mast::{LiftName, LiftState, Mast, Thesis, STATES};
use hydro_core::run::{simulate, Inputs, Lifts, Solver};
use hydro_core::scalar::Scalar;
use hydro_core::solver::fixed::{Fixed, ValveRates, ValveSteps};
use hydro_core::solver::vectors::{widest, Work};
use hydro_core::truck::Truck;

/// Least time [s] to be measured over: one pass of the fastest takes two milliseconds, too few to be warm.
const LEAST_S: f64 = 0.2;

/// x, v, p_A, p_B at each tick.
type Point = [f64; 4];

struct Lowering {
    load_kg: f64,
    oil_temperature_degc: f64,
    command: Vec<f64>,
}

struct Set {
    tick: f64,
    lowerings: Vec<Lowering>,
}

fn read(path: &str) -> Set {
    let bytes = std::fs::read(path).expect("the lowerings file can be read");
    let word = |k: usize| <[u8; 8]>::try_from(&bytes[8 * k..8 * k + 8]).expect("eight bytes");
    let number = |k: usize| f64::from_le_bytes(word(k));
    let (n, ticks) = (i64::from_le_bytes(word(0)) as usize, i64::from_le_bytes(word(1)) as usize);
    let lowerings = (0..n)
        .map(|k| {
            let row = 3 + k * (ticks + 2);
            Lowering {
                load_kg: number(row),
                oil_temperature_degc: number(row + 1),
                command: (0..ticks).map(|j| number(row + 2 + j)).collect(),
            }
        })
        .collect();
    Set { tick: number(2), lowerings }
}

fn write(path: &str, points: &[Vec<Point>], seconds: f64) {
    let mut bytes = Vec::new();
    bytes.extend((points.len() as i64).to_le_bytes());
    bytes.extend((points[0].len() as i64).to_le_bytes());
    bytes.extend(seconds.to_le_bytes());
    for value in points.iter().flatten().flatten() {
        bytes.extend(value.to_le_bytes());
    }
    std::fs::write(path, bytes).expect("the trajectories file can be written");
}

/// Some lowerings side by side, one a lane.
struct Block<'a, S> {
    fixed: Fixed<S, Thesis, 1>,
    command: &'a [S],
    substeps: usize,
    out: &'a mut [[S; 4]],
}

impl<S: Scalar> Work for Block<'_, S> {
    type Number = S;
    type Output = ();
    #[inline(always)]
    fn run(mut self) {
        let point = |s: &LiftState<S>| [s.x, s.v, s.p_a, s.p_b];
        self.out[0] = point(self.fixed.lift(0));
        for (k, &u) in self.command.iter().enumerate() {
            self.fixed.mast.command = [u];
            let then = self.command.get(k + 1).copied().unwrap_or(u);
            for left in (0..self.substeps).rev() {
                self.fixed.substep(Some([if left > 0 { u } else { then }]));
            }
            self.out[k + 1] = point(self.fixed.lift(0));
        }
    }
}

fn fixed<S: Scalar>(
    truck: &Truck,
    set: &Set,
    width: usize,
    substeps: usize,
    number: impl Fn(&dyn Fn(usize) -> f64) -> S,
    lane: impl Fn(S, usize) -> f64,
) -> (Vec<Vec<Point>>, f64) {
    let ticks = set.lowerings[0].command.len();
    let mut points = Vec::new();
    let mut seconds = 0.0;
    for group in set.lowerings.chunks(width) {
        let of = |l: usize| &group[l.min(group.len() - 1)];
        let command: Vec<S> = (0..ticks).map(|k| number(&|l| of(l).command[k])).collect();
        let temperature = number(&|l| of(l).oil_temperature_degc);
        let mut out = vec![[S::zero(); 4]; ticks + 1];
        let clock = Instant::now();
        let (lifts, _) = truck
            .build([LiftName::Free], number(&|l| of(l).load_kg), |_, v| S::constant(v))
            .expect("the thesis's truck has no effects");
        let mut start = vec![S::zero(); STATES];
        lifts[0].at_rest(S::constant(LiftName::Free.start_position())).write(&mut start);
        let mut mast = Mast { lifts, physics: Thesis, command: [S::zero()], oil_temperature_degc: temperature };
        mast.set_inputs([S::zero()], temperature);
        let h = set.tick / substeps as f64;
        let valve_steps = ValveSteps::of(ValveRates::default().with(&mast.lifts[0].valve), h);
        let fixed = Fixed::new(mast, &start, h, valve_steps);
        widest(Block { fixed, command: &command, substeps, out: &mut out });
        seconds += clock.elapsed().as_secs_f64();
        for l in 0..group.len() {
            points.push(out.iter().map(|p| p.map(|s| lane(s, l))).collect());
        }
    }
    (points, seconds)
}

fn adaptive(truck: &Truck, set: &Set, tolerance: f64) -> (Vec<Vec<Point>>, f64) {
    let ticks = set.lowerings[0].command.len();
    let time: Vec<f64> = (0..=ticks).map(|k| k as f64 * set.tick).collect();
    let clock = Instant::now();
    let points = set
        .lowerings
        .iter()
        .map(|lowering| {
            let command: Vec<[f64; 2]> = lowering.command.iter().map(|&u| [u, 0.0]).collect();
            let temperature = vec![lowering.oil_temperature_degc; ticks];
            let inputs = Inputs {
                time: &time[..ticks],
                command: &command,
                oil_temperature_degc: &temperature,
                load_kg: lowering.load_kg,
            };
            let solver = Solver::Adaptive { tolerance };
            let run = simulate(truck, Lifts::One(LiftName::Free), &inputs, &time, solver, None, &|| false)
                .expect("the lowering can be integrated");
            run.states.chunks_exact(STATES).map(|x| [x[3], x[4], x[6], x[7]]).collect()
        })
        .collect();
    (points, clock.elapsed().as_secs_f64())
}

fn lanes<const N: usize>(truck: &Truck, set: &Set, substeps: usize) -> (Vec<Vec<Point>>, f64) {
    fixed(truck, set, N, substeps, |f| Lanes::<N>(std::array::from_fn(f)), |s, l| s.0[l])
}

struct Together<'a> {
    truck: &'a Truck,
    set: &'a Set,
    substeps: usize,
}

impl<const N: usize> LaneWork<N> for Together<'_> {
    type Output = (Vec<Vec<Point>>, f64);
    fn run<S: LaneScalar<N>>(self) -> Self::Output {
        let number = |f: &dyn Fn(usize) -> f64| S::from_lanes(std::array::from_fn(f));
        fixed(self.truck, self.set, N, self.substeps, number, |s: S, l| s.lanes()[l])
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [input, output, settings @ ..] = arguments.as_slice() else {
        println!("lowerings: give LOWERINGS TRAJECTORIES name=value ...; see benches/peers/README.md");
        return;
    };
    let option = |name: &str| {
        let text = settings.iter().find_map(|s| s.strip_prefix(&format!("{name}=")));
        text.map(|t| t.parse::<f64>().unwrap_or_else(|_| panic!("{name} is a number, not {t}")))
    };
    let truck = common::truck_with(&[]);
    let set = read(input);
    let substeps = option("substeps").unwrap_or(4.0) as usize;
    let run = || match (option("tolerance"), option("lanes").unwrap_or(1.0) as usize) {
        (Some(tolerance), _) => adaptive(&truck, &set, tolerance),
        (None, 1) => fixed(&truck, &set, 1, substeps, |f| f(0), |s, _| s),
        (None, 4) => lanes::<4>(&truck, &set, substeps),
        (None, 8) => with_eight(Together { truck: &truck, set: &set, substeps }),
        (None, 16) => with_sixteen(Together { truck: &truck, set: &set, substeps }),
        (None, other) => panic!("lanes is 1, 4, 8 or 16, not {other}"),
    };
    let (points, mut seconds) = run();
    let mut passes = 1;
    while seconds < LEAST_S {
        seconds += run().1;
        passes += 1;
    }
    write(output, &points, seconds / f64::from(passes));
}
