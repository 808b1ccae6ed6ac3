//! Lanes: each is bit-equal to the scalar run, whatever its neighbours, the build. Those in registers are held where the
//! library runs them: `closed_loop.rs`, `side_by_side.rs`, `ensemble.rs`.
//!
//! Without any optimisation, which is built sooner than the debug profile and asks for deep stacks:
//! `RUST_MIN_STACK=268435456 cargo test -p hydro_core --test lanes --config profile.dev.opt-level=0`.

mod common;

use common::thesis_values;
use hydro_core::dual::Dual;
use hydro_core::lanes::Lanes;
use hydro_core::mast::{Extended, LiftName, Mast, Physics, Thesis, STATES};
use hydro_core::random::Random;
use hydro_core::scalar::Scalar;
use hydro_core::solver::fixed::{Fixed, ValveSteps};
use hydro_core::truck::{Truck, Value};

const TICKS: usize = 150;
const SUBSTEPS: usize = 3;
/// Of the thesis's physics alone, and with effects.
const VALVE_STEPS: [ValveSteps; 2] = [ValveSteps::Implicit(2), ValveSteps::Linear(2)];

/// One member of an ensemble: factors on a truck's values, load, temperature, command.
struct Member {
    factors: Vec<f64>,
    load: f64,
    temperature: f64,
    command: [Vec<f64>; 2],
}

fn truck() -> Truck {
    let mut values = thesis_values();
    values.insert("mast_coupling.factor".into(), Value::Number(0.7));
    values.insert("free.friction_temperature.rate".into(), Value::Number(0.01));
    Truck::from_values(values).unwrap()
}

fn members(count: usize, seed: u64) -> Vec<Member> {
    let mut random = Random::new(seed, 0);
    let size = truck().values().len();
    let mut level = |low: f64, high: f64| low + (high - low) * random.uniform();
    (0..count)
        .map(|_| Member {
            factors: (0..size).map(|_| level(0.95, 1.05)).collect(),
            load: level(0.0, 1500.0),
            temperature: level(15.0, 65.0),
            command: [0, 1].map(|_| {
                let levels: Vec<f64> = (0..TICKS / 25).map(|_| level(0.0, 1.2)).collect();
                (0..TICKS).map(|k| levels[k / 25]).collect()
            }),
        })
        .collect()
}

struct Lower<S, X> {
    fixed: Fixed<S, X, 2>,
    command: Vec<[S; 2]>,
    temperature: S,
}

impl<S: Scalar, X: Physics<S>> Lower<S, X> {
    fn run(mut self) -> Vec<S> {
        for (k, u) in self.command.iter().enumerate() {
            self.fixed.mast.set_inputs(*u, self.temperature);
            for left in (0..SUBSTEPS).rev() {
                // The next command is told in time in two ticks of three.
                let then = if left > 0 { Some(u) } else { self.command.get(k + 1).filter(|_| k % 3 > 0) };
                self.fixed.substep(then.copied());
            }
        }
        let mut x = vec![S::zero(); self.fixed.mast.dim()];
        self.fixed.write(&mut x);
        x
    }
}

/// Runs members over any scalar; `number(f)` builds a scalar from f(member) in each lane.
fn lower<S: Scalar>(extended: bool, number: impl Fn(&dyn Fn(usize) -> f64) -> S, set: &[Member]) -> Vec<S> {
    let truck = truck();
    let load = number(&|lane| set[lane].load);
    let value = |k: usize, v: f64| number(&|lane| v * set[lane].factors[k]);
    let (lifts, effects) = truck.build(LiftName::BOTH, load, value).unwrap();
    let temperature = number(&|lane| set[lane].temperature);
    let command = (0..TICKS).map(|k| [0, 1].map(|lift| number(&|lane| set[lane].command[lift][k]))).collect::<Vec<_>>();
    let valve_steps = VALVE_STEPS[usize::from(extended)];
    fn go<S: Scalar, X: Physics<S>>(
        mast: Mast<S, X, 2>,
        command: Vec<[S; 2]>,
        temperature: S,
        valve_steps: ValveSteps,
    ) -> Vec<S> {
        let mut mast = mast;
        mast.set_inputs(command[0], temperature);
        let mut start = vec![S::zero(); mast.dim()];
        for (k, lift) in LiftName::BOTH.iter().enumerate() {
            let at = S::constant(lift.start_position());
            mast.lifts[k].at_rest(at).write(&mut start[k * STATES..(k + 1) * STATES]);
        }
        let fixed = Fixed::new(mast, &start, 0.02 / SUBSTEPS as f64, valve_steps);
        Lower { fixed, command, temperature }.run()
    }
    let zero = S::zero();
    if extended {
        let physics = Extended::new(&effects, &lifts);
        let mast = Mast { lifts, physics, command: [zero; 2], oil_temperature_degc: zero };
        go(mast, command, temperature, valve_steps)
    } else {
        let mast = Mast { lifts, physics: Thesis, command: [zero; 2], oil_temperature_degc: zero };
        go(mast, command, temperature, valve_steps)
    }
}

fn in_lanes<const N: usize>(extended: bool, set: &[Member]) -> Vec<Lanes<N>> {
    lower(extended, |f| Lanes(std::array::from_fn(f)), set)
}

fn alone(extended: bool, member: Member) -> Vec<u64> {
    lower(extended, |f| f(0), &[member]).into_iter().map(f64::to_bits).collect()
}

fn each_lane_is_the_scalar_run<const N: usize>(extended: bool) {
    for seed in 0..3 {
        let together = in_lanes::<N>(extended, &members(N, seed));
        for (lane, member) in members(N, seed).into_iter().enumerate() {
            let bits: Vec<u64> = together.iter().map(|x| x.0[lane].to_bits()).collect();
            assert_eq!(bits, alone(extended, member), "lane {lane} of {N}, seed {seed}");
        }
    }
}

#[test]
fn four_lanes_of_the_thesis_model_are_four_scalar_runs() {
    each_lane_is_the_scalar_run::<4>(false);
}

#[test]
fn lanes_with_effects_are_scalar_runs_too() {
    each_lane_is_the_scalar_run::<4>(true);
}

#[test]
fn a_lane_does_not_see_its_neighbours() {
    let together = in_lanes::<4>(false, &members(4, 5));
    let mut turned = members(4, 5);
    turned.rotate_left(3);
    // A neighbour that runs away must not disturb the others.
    turned[0].factors = vec![1.0; turned[0].factors.len()];
    turned[0].load = f64::NAN;
    let turned = in_lanes::<4>(false, &turned);
    for lane in 1..4 {
        let same = together.iter().zip(&turned).all(|(a, b)| a.0[(lane + 3) % 4].to_bits() == b.0[lane].to_bits());
        assert!(same, "lane {lane}");
    }
}

#[test]
fn duals_over_lanes_are_duals_and_their_values_are_the_plain_run() {
    const P: usize = 3;
    let seed = |k: usize| [11, 30, 47].iter().position(|&j| j == k);
    let make = |f: &dyn Fn(usize) -> f64| Lanes::<4>(std::array::from_fn(f));
    let truck = truck();
    let set = members(4, 9);
    let run = |lane: Option<usize>| {
        let pick = |f: &dyn Fn(&Member) -> f64| match lane {
            Some(lane) => make(&|_| f(&set[lane])),
            None => make(&|lane| f(&set[lane])),
        };
        let value = |k: usize, v: f64| {
            let x = pick(&|m| v * m.factors[k]);
            seed(k).map_or(Dual::from_real(x), |direction| Dual::<Lanes<4>, P>::variable(x, direction))
        };
        let (lifts, _) = truck.build(LiftName::BOTH, Dual::from_real(pick(&|m| m.load)), value).unwrap();
        let temperature = Dual::from_real(pick(&|m| m.temperature));
        let mut mast = Mast { lifts, physics: Thesis, command: [Dual::zero(); 2], oil_temperature_degc: temperature };
        let command: Vec<_> =
            (0..TICKS).map(|k| [0, 1].map(|lift| Dual::from_real(pick(&|m| m.command[lift][k])))).collect();
        mast.set_inputs(command[0], temperature);
        let mut start = vec![Dual::zero(); 2 * STATES];
        for (k, lift) in LiftName::BOTH.iter().enumerate() {
            let at = Dual::constant(lift.start_position());
            mast.lifts[k].at_rest(at).write(&mut start[k * STATES..(k + 1) * STATES]);
        }
        let fixed = Fixed::new(mast, &start, 0.02 / SUBSTEPS as f64, VALVE_STEPS[0]);
        Lower { fixed, command, temperature }.run()
    };
    let plain = in_lanes::<4>(false, &set);
    let together = run(None);
    for lane in 0..4 {
        let single = run(Some(lane));
        for ((a, b), c) in together.iter().zip(&single).zip(&plain) {
            assert_eq!(a.re.0[lane].to_bits(), c.0[lane].to_bits());
            for p in 0..P {
                assert_eq!(a.eps[p].0[lane].to_bits(), b.eps[p].0[0].to_bits());
            }
        }
    }
}

#[test]
fn debug_and_release_and_every_machine_give_these_bits() {
    // FNV-1a (Fowler, Noll & Vo) over the final states of eight members, made once by this test.
    for (extended, made) in [(true, 0x6fb5_ef07_682d_5371u64), (false, 0x1886_3bd9_a935_de78)] {
        let mut hash = 0xcbf2_9ce4_8422_2325u64;
        let members: Vec<Vec<u64>> = members(8, 1).into_iter().map(|member| alone(extended, member)).collect();
        for state in 0..members[0].len() {
            for member in &members {
                for byte in member[state].to_le_bytes() {
                    hash = (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
                }
            }
        }
        assert_eq!(hash, made, "{hash:#x}");
    }
}
