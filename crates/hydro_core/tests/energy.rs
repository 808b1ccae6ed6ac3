//! Nothing in the thesis's model creates energy, but its friction where the bristles' damping is large.

mod common;

use common::space::{cases, values_near_the_thesis};
use common::{truck_with, Lowering, TICK};
use hydro_core::mast::{Lift, LiftName, LiftState, STATES};
use hydro_core::parts::lugre::LuGre;
use hydro_core::parts::viscosity::viscosity;
use hydro_core::ports::Closed;
use hydro_core::run::{simulate, Inputs, Lifts, Solver};
use hydro_core::truck::{Truck, Value};
use proptest::prelude::*;

/// The energy of oil in the cylinder and in the volume, exactly conserved by (3.19) and (3.20).
///
/// With h(p) from h' = 1 + h/E_A(p), h(p_T) = 0, oil that enters at the pressure p brings h per
/// volume; the cylinder holds V(x)·(h(p) − (p − p_T)) and does the work (p − p_T)·A_c·v on its piston,
/// and the volume holds V·∫h/E dp. Both h and the pressure drop have the sign of the flow through an
/// orifice, so that every orifice takes energy.
struct Oil<'a> {
    lift: &'a Lift<f64>,
    volume: f64,
    volume_bulk: f64,
}

impl Oil<'_> {
    /// h(p) and ∫h/E dp from the tank's pressure to `p` [Pa], by the classical Runge–Kutta method.
    fn per_volume(&self, p: f64) -> (f64, f64) {
        const STEPS: usize = 60;
        let start = self.lift.p_tank;
        let step = (p - start) / STEPS as f64;
        let slope = |p: f64, h: f64| 1.0 + h / self.lift.bulk.at(p);
        let (mut h, mut held) = (0.0, 0.0);
        for k in 0..STEPS {
            let p = start + step * k as f64;
            let k1 = slope(p, h);
            let k2 = slope(p + 0.5 * step, h + 0.5 * step * k1);
            let k3 = slope(p + 0.5 * step, h + 0.5 * step * k2);
            let k4 = slope(p + step, h + step * k3);
            let next = h + step / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
            // Simpson's rule; half way h is known to the same order.
            let middle = 0.5 * (h + next) + step / 8.0 * (slope(p, h) - slope(p + step, next));
            held += step / 6.0 * (h + 4.0 * middle + next) / self.volume_bulk;
            h = next;
        }
        (h, held)
    }

    /// Kinetic, potential and compression energy [J].
    fn energy(&self, s: &LiftState<f64>) -> f64 {
        let (lift, balance) = (self.lift, self.lift.balance);
        let (h, _) = self.per_volume(s.p_a);
        let (_, held) = self.per_volume(s.p_b);
        0.5 * balance.inertia * s.v * s.v
            + (balance.weight - lift.p_tank * balance.area) * s.x
            + (lift.v_0 + balance.area * s.x) * (h - (s.p_a - lift.p_tank))
            + self.volume * held
    }

    /// What friction and the two orifices take [W].
    fn losses(&self, s: &LiftState<f64>) -> [f64; 3] {
        let lift = self.lift;
        let (friction, _) = lift.friction.force_and_rate(s.v, s.z, lift.friction.sigma_2);
        let c2 = |orifice: &hydro_core::parts::orifice::Orifice<f64>| orifice.critical_squared(lift.nu);
        let q_a = lift.orifice_a.flow(c2(&lift.orifice_a), lift.opening(s.i, &Closed), s.p_a - s.p_b);
        let q_b = lift.orifice_b.flow(c2(&lift.orifice_b), s.a_comp, s.p_b - lift.p_tank);
        let (h_a, h_b) = (self.per_volume(s.p_a).0, self.per_volume(s.p_b).0);
        [friction * s.v, (h_a - h_b) * q_a, h_b * q_b]
    }
}

fn value(truck: &Truck, name: &str) -> f64 {
    let place = truck.names().iter().position(|known| known == name).unwrap();
    truck.values()[place]
}

/// The states of a lowering every `step` seconds, and what they say of energy.
fn with_oil<T>(truck: &Truck, lowering: &Lowering, step: f64, look: impl FnOnce(&Oil, Vec<LiftState<f64>>) -> T) -> T {
    let time: Vec<f64> = (0..lowering.command.len()).map(|k| k as f64 * TICK).collect();
    let temperature = vec![lowering.oil_temperature_degc; time.len()];
    let command: Vec<[f64; 2]> = lowering.command.iter().map(|&u| [u, u]).collect();
    let wanted: Vec<f64> = (0..(time[time.len() - 1] / step) as usize).map(|k| k as f64 * step).collect();
    let inputs =
        Inputs { time: &time, command: &command, oil_temperature_degc: &temperature, load_kg: lowering.load_kg };
    let solver = Solver::Adaptive { tolerance: 1e-8 };
    let run = simulate(truck, Lifts::One(lowering.lift), &inputs, &wanted, solver, None, &|| false).unwrap();
    let ([mut lift], _) = truck.build([lowering.lift], lowering.load_kg, |_, v| v).unwrap();
    let name = lowering.lift.as_str();
    let of = |parameter: &str| value(truck, &format!("{name}.{parameter}"));
    let (nu_0, lambda, t_0) = (of("viscosity.nu_0"), of("viscosity.lambda"), of("viscosity.T_0"));
    lift.nu = viscosity(nu_0, lambda, t_0, lowering.oil_temperature_degc);
    let oil = Oil { lift: &lift, volume: of("volume.V"), volume_bulk: of("volume.E") };
    look(&oil, run.states.chunks_exact(STATES).map(LiftState::from_slice).collect())
}

#[test]
fn what_a_lowering_loses_is_what_friction_and_the_orifices_take() {
    let truck = truck_with(&[]);
    let mut command = vec![0.0; 10];
    command.extend(vec![0.7; 60]);
    command.extend(vec![0.2; 40]);
    command.extend(vec![0.9; 40]);
    for lift in LiftName::BOTH {
        for load_kg in [0.0, 1500.0] {
            let lowering = Lowering { lift, load_kg, oil_temperature_degc: 40.0, command: &command };
            let step = 5e-4;
            with_oil(&truck, &lowering, step, |oil, states| {
                let energies: Vec<f64> = states.iter().map(|s| oil.energy(s)).collect();
                let losses: Vec<[f64; 3]> = states.iter().map(|s| oil.losses(s)).collect();
                let lost = energies[0] - energies[energies.len() - 1];
                let mut taken = [0.0; 3];
                for pair in losses.windows(2) {
                    for k in 0..3 {
                        taken[k] += 0.5 * step * (pair[0][k] + pair[1][k]);
                    }
                }
                let total: f64 = taken.iter().sum();
                let place = format!("{} {load_kg} kg: lost {lost:.3} J, taken {taken:.3?} J", lift.as_str());
                assert!(lost > 500.0, "{place}");
                assert!((total / lost - 1.0).abs() < 1e-4, "{place}");
                assert!(taken.iter().all(|&share| share > 0.01 * lost), "{place}");
            });
        }
    }
}

/// Trucks within a factor two of the thesis's, with friction that is passive.
fn passive_trucks() -> BoxedStrategy<Truck> {
    (values_near_the_thesis(2.0), 0.0..1.0f64)
        .prop_map(|(mut values, share)| {
            for lift in ["free", "main"] {
                let number = |name: &str| match values[&format!("{lift}.friction.{name}")] {
                    Value::Number(x) => x,
                    Value::Table(_) => unreachable!(),
                };
                let damping = share * number("sigma_2") / (number("K_brk") - 1.0).max(1e-3);
                values.insert(format!("{lift}.friction.sigma_1"), Value::Number(damping));
            }
            Truck::from_values(values).unwrap()
        })
        .boxed()
}

proptest! {
    #![proptest_config(cases(40))]

    #[test]
    fn with_passive_friction_the_energy_never_rises(
        truck in passive_trucks(),
        main in any::<bool>(),
        load_kg in 0.0..2000.0f64,
        oil_temperature_degc in 0.0..80.0f64,
        levels in proptest::collection::vec(0.0..1.2f64, 1..5),
    ) {
        let lift = if main { LiftName::Main } else { LiftName::Free };
        let command: Vec<f64> = levels.iter().flat_map(|&u| vec![u; 25]).collect();
        let lowering = Lowering { lift, load_kg, oil_temperature_degc, command: &command };
        with_oil(&truck, &lowering, 0.005, |oil, states| {
            let sigma_0 = value(&truck, &format!("{}.friction.sigma_0", lift.as_str()));
            let energy = |s: &LiftState<f64>| oil.energy(s) + 0.5 * sigma_0 * s.z * s.z;
            let start = energy(&states[0]).abs();
            for (k, pair) in states.windows(2).enumerate() {
                let rise = energy(&pair[1]) - energy(&pair[0]);
                prop_assert!(rise <= 1e-7 * start, "{rise:e} J of {start:.1} J at step {k}");
            }
            Ok(())
        })?;
    }

    #[test]
    fn the_friction_is_passive_where_sigma_2_exceeds_sigma_1_times_the_excess_of_breakaway(
        coulomb in 1.0..1e4f64,
        k_brk in 1.0..30.0f64,
        c_v in 1.0..1e4f64,
        sigma_0 in 1e2..1e7f64,
        sigma_2 in 0.0..1e5f64,
        share in 0.0..1.0f64,
        speed in -6.0..0.3f64,
        down in any::<bool>(),
        bend in -1.0..1.0f64,
    ) {
        // Barabanov & Ortega (2000): σ2 > σ1·(F_s − F_c)/F_c. The bristles hold ½σ0·z².
        let sigma_1 = share * sigma_2 / (k_brk - 1.0).max(1e-3);
        let friction = LuGre::new(coulomb, k_brk, c_v, sigma_0, sigma_1, sigma_2);
        let v = 10f64.powf(speed) * if down { -1.0 } else { 1.0 };
        let z = bend * coulomb * k_brk / sigma_0;
        let (force, rate) = friction.force_and_rate(v, z, sigma_2);
        let (supplied, stored) = (force * v, sigma_0 * z * rate);
        prop_assert!(supplied - stored >= -1e-9 * (supplied.abs() + stored.abs()), "{supplied} {stored}");
    }
}

/// Work that moving a bristle costs [J]: creeping over `creep` [m], then `pulse` [m] at `speed`, thrice.
fn work_of_cycles(friction: &LuGre<f64>, creep: f64, pulse: f64, speed: f64) -> Vec<f64> {
    let mut z = 0.0;
    let mut over = |v: f64, way: f64| {
        const STEPS: usize = 20_000;
        let dx = way / STEPS as f64;
        let mut work = 0.0;
        for _ in 0..STEPS {
            // Along the way dz/dx = rate/v, by the midpoint rule.
            let half = z + 0.5 * dx * friction.force_and_rate(v, z, friction.sigma_2).1 / v;
            let (force, rate) = friction.force_and_rate(v, half, friction.sigma_2);
            z += dx * rate / v;
            work += force * dx;
        }
        work
    };
    (0..3).map(|_| over(1e-5, creep) + over(speed, pulse)).collect()
}

#[test]
fn the_thesis_friction_with_its_strong_bristle_damping_can_be_made_to_give_energy() {
    // Table 5.1 with 500 kg: σ1·(K_brk − 1) = 39,700 N s/m is ten times σ2. A bristle that is bent
    // slowly to breakaway and then drawn fast springs back with the damper pushing.
    let coulomb = 113.81 + 778.0 * 2.6445;
    let friction = LuGre::new(coulomb, 3.769, 261.2, 2517.2, 14342.0, 4137.8);
    for work in work_of_cycles(&friction, 8.0, 0.8, 20.0) {
        assert!(work < -1e5, "{work} J");
    }
    // With damping within the bound no cycle of any speed does.
    let damping = 4137.8 / 2.769;
    let passive = LuGre::new(coulomb, 3.769, 261.2, 2517.2, damping, 4137.8);
    for speed in [0.1, 1.0, 20.0, 1e3] {
        for work in work_of_cycles(&passive, 8.0, 0.8, speed) {
            assert!(work > 0.0, "{speed} m/s: {work} J");
        }
    }
}
