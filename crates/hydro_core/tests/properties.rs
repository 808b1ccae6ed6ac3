//! What holds for every submodel and the whole mast over the whole range of their parameters:
//! exact derivatives are difference quotients, a lane is a number, a dual over lanes is a dual.

mod common;

use std::cell::Cell;

use common::space::{cases, inside, signed, spec};
use common::truck_with;
use hydro_core::dual::Dual;
use hydro_core::effects::Instance;
use hydro_core::lanes::Lanes;
use hydro_core::mast::{Extended, LiftName, Mast, Physics, STATES};
use hydro_core::parameters::{ParameterSpec, Scale};
use hydro_core::parts::area_table::AreaTable;
use hydro_core::parts::bulk_modulus::BulkModulus;
use hydro_core::parts::compensator::Compensator;
use hydro_core::parts::force_balance::ForceBalance;
use hydro_core::parts::lugre::LuGre;
use hydro_core::parts::orifice::Orifice;
use hydro_core::parts::stiff_valve::StiffValveStep;
use hydro_core::parts::valve::{Valve, ValveState};
use hydro_core::parts::viscosity::viscosity;
use hydro_core::parts::{cylinder, volume};
use hydro_core::ports::{Closed, Open};
use hydro_core::scalar::Scalar;
use hydro_core::truck::Truck;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

/// A part of the model as a function from numbers to numbers, over any scalar.
trait Submodel {
    /// Where each argument lies.
    fn arguments(&self) -> Vec<BoxedStrategy<f64>>;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S>;
}

/// Inside the bounds: on them sit kinks, as where the compensator's leakage is its largest opening.
fn anywhere(spec: &ParameterSpec) -> BoxedStrategy<f64> {
    inside(spec.lower, spec.upper, spec.scale)
}

fn named<const N: usize>(names: [&str; N]) -> Vec<BoxedStrategy<f64>> {
    names.map(|name| anywhere(spec(name))).into()
}

fn celsius() -> BoxedStrategy<f64> {
    inside(-50.0, 150.0, Scale::Linear)
}

fn pressure() -> BoxedStrategy<f64> {
    inside(1e4, 1e8, Scale::Log)
}

fn drop() -> BoxedStrategy<f64> {
    signed(1.0, 1e8)
}

fn speed() -> BoxedStrategy<f64> {
    signed(1e-6, 2.0)
}

struct Viscosity;
impl Submodel for Viscosity {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        [named(["viscosity.nu_0", "viscosity.lambda", "viscosity.T_0"]), vec![celsius()]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        vec![viscosity(x[0], x[1], x[2], x[3])]
    }
}

struct Bulk;
impl Submodel for Bulk {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let parameters = named(["bulk.E_max", "bulk.p_max", "bulk.a_1", "bulk.a_2", "bulk.a_3"]);
        [parameters, vec![prop_oneof![4 => pressure(), 1 => drop()].boxed()]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        vec![BulkModulus::new(x[0], x[1], x[2], x[3], x[4]).at(x[5])]
    }
}

struct Flow;
impl Submodel for Flow {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let nu = inside(1e-7, 1e-2, Scale::Log);
        let area = inside(1e-13, 1e-3, Scale::Log);
        [named(["valve.C_D", "valve.Re_cr", "oil.density"]), vec![nu, area, drop()]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let orifice = Orifice::new(x[0], x[1], x[2]);
        let c2 = orifice.critical_squared(x[3]);
        let slopes = orifice.flow_and_slopes(c2, x[4], x[5]);
        vec![orifice.flow(c2, x[4], x[5]), slopes.q, slopes.by_pressure, slopes.by_area]
    }
}

/// Eight knots; the currents are 0.1 A apart and more.
struct Table;
impl Submodel for Table {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let currents = (0..8).map(|k| inside(0.2 * k as f64, 0.2 * k as f64 + 0.1, Scale::Linear));
        let areas = (0..8).map(|k| inside(5e-6 * k as f64, 5e-6 * (k + 1) as f64, Scale::Linear));
        currents.chain(areas).chain([inside(1e-13, 1e-6, Scale::Log), inside(-0.2, 2.0, Scale::Linear)]).collect()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        vec![AreaTable::new(&x[..8], &x[8..16], x[16]).at(x[17])]
    }
}

struct ProportionalValve;
impl Submodel for ProportionalValve {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let parameters = named(["valve.omega", "valve.D", "valve.f_hs", "valve.sigma_0", "valve.sigma_1"]);
        let current = inside(-0.1, 2.0, Scale::Linear);
        [parameters, vec![current.clone(), signed(1e-3, 50.0), signed(1e-6, 0.1), current]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let valve = Valve::new(x[0], x[1], x[2], x[3], x[4]);
        let from = ValveState { i: x[5], rate: x[6], bristle: x[7] };
        let rates = valve.rates(from, x[8]);
        let next = valve.over(S::constant(1e-3)).advance(from, x[8]);
        let (fastest, swing) = (valve.fastest_rate(), valve.swing_rate());
        vec![rates.i, rates.rate, rates.bristle, fastest, swing, next.i, next.rate, next.bristle]
    }
}

/// Its nonlinearly implicit step, the bristle bent by a share of its most.
struct StiffValve;
impl Submodel for StiffValve {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let parameters = named(["valve.omega", "valve.D", "valve.f_hs", "valve.sigma_0", "valve.sigma_1"]);
        let current = inside(-0.1, 2.0, Scale::Linear);
        [parameters, vec![current.clone(), signed(1e-3, 50.0), signed(1e-3, 1.0), current]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let valve = Valve::new(x[0], x[1], x[2], x[3], x[4]);
        let from = ValveState { i: x[5], rate: x[6], bristle: x[7] * x[2] / x[3] };
        let next = StiffValveStep::new(valve.over(S::constant(1e-3))).advance(from, x[8]);
        vec![next.i, next.rate, next.bristle]
    }
}

struct PressureCompensator;
impl Submodel for PressureCompensator {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let parameters = named([
            "compensator.A_max",
            "compensator.A_leak",
            "compensator.A_spool",
            "compensator.p_reg",
            "compensator.p_set",
            "compensator.tau",
            "compensator.C_D",
            "compensator.theta",
        ]);
        let area = inside(1e-13, 1e-3, Scale::Log);
        // Half of the drops across the valve lie where the compensator regulates.
        [parameters, vec![prop_oneof![signed(1e3, 1e7), inside(1e4, 2e7, Scale::Log)].boxed(), drop(), area]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let compensator = Compensator::new(x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]);
        let p_set = compensator.p_set;
        vec![compensator.steady_area(x[8], x[9], x[10], p_set), compensator.rate(x[8], x[9], x[10], p_set)]
    }
}

struct Friction;
impl Submodel for Friction {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let parameters = named([
            "friction.F_pr",
            "friction.K_brk",
            "friction.c_v",
            "friction.f_cfr",
            "friction.sigma_0",
            "friction.sigma_1",
            "friction.sigma_2",
        ]);
        [parameters, vec![inside(1.0, 4e4, Scale::Log), speed(), signed(1e-8, 1.0)]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let friction = LuGre::new(x[0] + x[7] * x[3], x[1], x[2], x[4], x[5], x[6]);
        let (force, rate) = friction.force_and_rate(x[8], x[9], friction.sigma_2);
        vec![friction.steady(x[8].abs()), force, rate]
    }
}

struct Pressures;
impl Submodel for Pressures {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let flow = || signed(1e-9, 1e-2);
        let cylinder = named(["bulk.E_max", "cylinder.V_0", "cylinder.area"]);
        let volume = named(["volume.E", "volume.V"]);
        [cylinder, volume, vec![inside(-0.1, 5.0, Scale::Linear), flow(), flow()]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        vec![cylinder::stiffness(x[0], x[1], x[2], x[5]), volume::pressure_rate(x[3] / x[4], x[6], x[7])]
    }
}

struct Balance;
impl Submodel for Balance {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let parameters = named(["cylinder.mass", "mass.moving", "gravity.g", "cylinder.area"]);
        [parameters, vec![pressure(), signed(1e-3, 1e5)]].concat()
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let balance = ForceBalance::new(x[0], x[1], x[2], x[3]);
        let force = balance.net_force(x[4], x[5]);
        vec![balance.inertia, balance.equilibrium_pressure(), force, force / balance.inertia]
    }
}

/// Both lifts with every effect: rates of all states, along all parameters, states and inputs.
struct WholeMast {
    truck: Truck,
}

impl WholeMast {
    /// Effects carry an amplitude other than their quiet one.
    fn new() -> Self {
        let mut changes = Vec::new();
        for instance in Instance::all() {
            for (k, p) in instance.kind.spec().parameters.iter().enumerate() {
                let share = if k < instance.kind.amplitudes() { 0.3 } else { 0.5 };
                changes.push((format!("{}.{}", instance.name(), p.name), p.lower + share * (p.upper - p.lower)));
            }
        }
        let changes: Vec<(&str, f64)> = changes.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        WholeMast { truck: truck_with(&changes) }
    }

    fn dim(&self) -> usize {
        2 * STATES + self.truck.effects().map(|e| e.kind.spec().states.len()).sum::<usize>()
    }
}

impl Submodel for WholeMast {
    fn arguments(&self) -> Vec<BoxedStrategy<f64>> {
        let mut all = Vec::new();
        for (name, usual) in self.truck.names().iter().zip(self.truck.values()) {
            let inner = name.split_once('.').unwrap().1;
            all.push(if inner.starts_with("valve.table_current") {
                inside(usual - 0.03, usual + 0.03, Scale::Linear)
            } else if inner.starts_with("valve.table_area") {
                inside(0.9 * usual, 1.1 * usual + 1e-8, Scale::Linear)
            } else {
                let effects = Instance::all().flat_map(|instance| {
                    let row = move |p| (format!("{}.{}", instance.name(), p), p);
                    let parameters = instance.kind.spec().parameters;
                    parameters.iter().map(move |p| (row(p.name).0, *p)).collect::<Vec<_>>()
                });
                let found = effects.into_iter().find(|(full, _)| full == name).map(|(_, spec)| spec);
                anywhere(&found.unwrap_or_else(|| *spec(inner)))
            });
        }
        for _ in LiftName::BOTH {
            all.extend([
                inside(-0.1, 2.0, Scale::Linear),
                signed(1e-3, 50.0),
                signed(1e-6, 0.1),
                inside(-0.05, 3.0, Scale::Linear),
                speed(),
                signed(1e-8, 1.0),
                prop_oneof![9 => pressure(), 1 => drop()].boxed(),
                prop_oneof![9 => pressure(), 1 => drop()].boxed(),
                inside(1e-13, 1e-3, Scale::Log),
            ]);
        }
        for effect in self.truck.effects() {
            all.extend(effect.kind.spec().states.iter().map(|s| signed(1e-3 * s.scale, 3.0 * s.scale)));
        }
        let current = inside(0.0, 1.75, Scale::Linear);
        all.extend([current.clone(), current, inside(0.0, 2e4, Scale::Linear), celsius()]);
        all
    }
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Vec<S> {
        let parameters = self.truck.values().len();
        let (states, inputs) = x[parameters..].split_at(self.dim());
        let (lifts, effects) = self.truck.build(LiftName::BOTH, inputs[2], |k, _| x[k]).unwrap();
        let physics = Extended::new(&effects, &lifts);
        let mut mast = Mast { lifts, physics, command: [S::zero(); 2], oil_temperature_degc: S::zero() };
        mast.set_inputs([inputs[0], inputs[1]], inputs[3]);
        assert_eq!(mast.physics.states(), self.dim() - 2 * STATES);
        let mut rates = vec![S::zero(); self.dim()];
        mast.rates(states, &mut rates);
        rates
    }
}

/// Directions a dual carries at once.
const P: usize = 8;

/// All derivatives, one row a direction.
fn by_duals<M: Submodel>(model: &M, x: &[f64]) -> Vec<Vec<f64>> {
    let mut rows = Vec::new();
    for first in (0..x.len()).step_by(P) {
        let seed = |k: usize, v: f64| {
            let direction = k.wrapping_sub(first);
            if direction < P {
                Dual::<f64, P>::variable(v, direction)
            } else {
                Dual::constant(v)
            }
        };
        let y = model.evaluate(&x.iter().enumerate().map(|(k, &v)| seed(k, v)).collect::<Vec<_>>());
        let plain = model.evaluate(x);
        for (a, b) in y.iter().zip(&plain) {
            assert_eq!(a.re.to_bits(), b.to_bits(), "the value of a dual is the plain number");
        }
        rows.extend((0..P.min(x.len() - first)).map(|k| y.iter().map(|y| y.eps[k]).collect::<Vec<_>>()));
    }
    rows
}

/// How far rounding moves each result: what a last bit in the arguments, and in the result itself, does to it.
fn rounding<M: Submodel>(model: &M, x: &[f64]) -> Vec<f64> {
    let plain = model.evaluate(x);
    let mut noise: Vec<f64> = plain.iter().map(|y| y.abs() * f64::EPSILON).collect();
    for period in 1..=3 {
        let turned =
            |k: usize, x: f64| x * if (k / period).is_multiple_of(2) { 1.0 + f64::EPSILON } else { 1.0 - f64::EPSILON };
        let other = model.evaluate(&x.iter().enumerate().map(|(k, &x)| turned(k, x)).collect::<Vec<_>>());
        for ((noise, a), b) in noise.iter_mut().zip(&plain).zip(other) {
            *noise = noise.max((a - b).abs());
        }
    }
    noise
}

/// A derivative by extrapolated central differences (Ridders 1982), and how wrong it may be.
fn by_differences(f: impl Fn(f64) -> Vec<f64>, h: f64, rounding: &[f64]) -> Vec<(f64, f64)> {
    const LEVELS: usize = 14;
    let step = |k: usize| h * 0.5f64.powi(k as i32);
    let pairs: Vec<(Vec<f64>, Vec<f64>)> = (0..LEVELS).map(|k| (f(step(k)), f(-step(k)))).collect();
    (0..pairs[0].0.len())
        .map(|output| {
            let central: Vec<f64> =
                (0..LEVELS).map(|k| (pairs[k].0[output] - pairs[k].1[output]) / (2.0 * step(k))).collect();
            // Rounding also shows where halving the step no longer matters.
            let change = |k: usize| (central[k] - central[k - 1]).abs() * step(k);
            let noise = (LEVELS - 4..LEVELS).map(change).fold(rounding[output], f64::max);
            let mut best = (central[0], f64::INFINITY);
            let mut last = vec![central[0]];
            for k in 1..LEVELS {
                let mut row = vec![central[k]];
                for j in 1..=k.min(4) {
                    let factor = 4f64.powi(j as i32);
                    row.push((factor * row[j - 1] - last[j - 1]) / (factor - 1.0));
                    let error = (row[j] - row[j - 1]).abs().max((row[j] - last[j - 1]).abs()) + 4.0 * noise / step(k);
                    if error < best.1 {
                        best = (row[j], error);
                    }
                }
                last = row;
            }
            best
        })
        .collect()
}

/// Each derivative agrees with the difference quotient to 1e-6 and what the quotient is good for.
/// Where it is good for nothing, because a kink or a cancellation lies within the steps, nothing is
/// learnt; that may happen to one derivative in fifty.
fn assert_duals_are_difference_quotients<M: Submodel>(model: &M, count: u32) {
    let (all, blunt) = (Cell::new(0usize), Cell::new(0usize));
    let mut runner = TestRunner::new(cases(count));
    let result = runner.run(&model.arguments(), |x| {
        let exact = by_duals(model, &x);
        let rounding = rounding(model, &x);
        for (k, row) in exact.iter().enumerate() {
            let h = if x[k] == 0.0 { 1e-4 } else { 1e-2 * x[k].abs() };
            let moved = |by: f64| {
                let mut x = x.clone();
                x[k] += by;
                model.evaluate(&x)
            };
            for (j, (quotient, error)) in by_differences(moved, h, &rounding).into_iter().enumerate() {
                let size = row[j].abs().max(quotient.abs());
                let nothing = 100.0 * rounding[j] / h + f64::MIN_POSITIVE;
                all.set(all.get() + 1);
                if error > 1e-4 * size + nothing {
                    blunt.set(blunt.get() + 1);
                } else {
                    let allowed = 1e-6 * size + 3.0 * error + nothing;
                    prop_assert!(
                        (row[j] - quotient).abs() <= allowed,
                        "output {j} along argument {k}: {} by duals, {quotient} +- {error} by differences",
                        row[j]
                    );
                }
            }
        }
        Ok(())
    });
    result.unwrap_or_else(|failure| panic!("{failure}"));
    if std::env::var("SHOW").is_ok() {
        println!("{} of {} quotients are blunt", blunt.get(), all.get());
    }
    assert!(50 * blunt.get() <= all.get(), "{} of {} quotients are blunt", blunt.get(), all.get());
}

/// Eight points at once, as numbers and as duals along the first directions, to the bit.
fn assert_lanes_are_numbers<M: Submodel>(model: &M, count: u32) {
    const N: usize = 8;
    const FEW: usize = 3;
    let mut runner = TestRunner::new(cases(count));
    let result = runner.run(&proptest::collection::vec(model.arguments(), N), |points| {
        let arguments = points[0].len();
        let lanes = |k: usize| Lanes::<N>(std::array::from_fn(|lane| points[lane][k]));
        let together = model.evaluate(&(0..arguments).map(lanes).collect::<Vec<_>>());
        let first = points[0].len() - FEW;
        let dual = |k: usize| match k.checked_sub(first) {
            Some(direction) => Dual::<Lanes<N>, FEW>::variable(lanes(k), direction),
            None => Dual::from_real(lanes(k)),
        };
        let duals_together = model.evaluate(&(0..arguments).map(dual).collect::<Vec<_>>());
        for (lane, x) in points.iter().enumerate() {
            let alone = model.evaluate(x);
            let dual = |k: usize| match k.checked_sub(first) {
                Some(direction) => Dual::<f64, FEW>::variable(x[k], direction),
                None => Dual::constant(x[k]),
            };
            let dual_alone = model.evaluate(&(0..arguments).map(dual).collect::<Vec<_>>());
            for (j, y) in alone.iter().enumerate() {
                prop_assert_eq!(together[j].0[lane].to_bits(), y.to_bits(), "output {}", j);
                prop_assert_eq!(duals_together[j].re.0[lane].to_bits(), y.to_bits(), "output {}", j);
                for d in 0..FEW {
                    let (a, b) = (duals_together[j].eps[d].0[lane], dual_alone[j].eps[d]);
                    prop_assert_eq!(a.to_bits(), b.to_bits(), "output {} along {}", j, first + d);
                }
            }
        }
        Ok(())
    });
    result.unwrap_or_else(|failure| panic!("{failure}"));
}

macro_rules! submodels {
    ($($module:ident: $model:expr, $cases:literal;)*) => {$(
        mod $module {
            use super::*;

            #[test]
            fn exact_derivatives_are_difference_quotients() {
                assert_duals_are_difference_quotients(&$model, $cases);
            }

            #[test]
            fn a_lane_is_a_number_to_the_bit_and_a_dual_over_lanes_a_dual() {
                assert_lanes_are_numbers(&$model, $cases);
            }
        }
    )*};
}

submodels! {
    viscosity_law: Viscosity, 500;
    bulk_modulus_law: Bulk, 500;
    orifice_flow: Flow, 500;
    area_table: Table, 300;
    proportional_valve: ProportionalValve, 500;
    stiff_valve: StiffValve, 500;
    pressure_compensator: PressureCompensator, 500;
    lugre_friction: Friction, 500;
    pressure_rates: Pressures, 500;
    force_balance: Balance, 300;
    whole_mast_with_every_effect: WholeMast::new(), 25;
}

#[test]
fn dry_friction_at_its_port_opposes_the_motion_and_is_none_at_rest() {
    let truck = truck_with(&[]);
    let (lifts, _) = truck.build([LiftName::Free], 500.0, |_, value| value).unwrap();
    let force = |v: f64, newtons: f64| {
        let ports = Open { dry_friction: newtons, ..Open::quiet() };
        lifts[0].force_and_bristle_rate(v, 0.0, 5e6, &ports).0
    };
    let changed = |v: f64| force(v, 200.0) - force(v, 0.0);
    assert!((changed(-0.3) - 200.0).abs() < 0.2); // lowering: upward
    assert!((changed(0.3) + 200.0).abs() < 0.2);
    assert!((changed(-0.01) - 200.0 * 0.5f64.sqrt()).abs() < 1e-6);
    assert_eq!(changed(0.0), 0.0);
    assert_eq!(force(-0.3, 0.0), lifts[0].force_and_bristle_rate(-0.3, 0.0, 5e6, &Closed).0);
}
