//! The truck on its tyres: it yields as the lifts gather speed.

use super::{Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// M·y″ + d·y′ + k·y = −Σμ·dv/dt, and each lift feels −μ·y″; μ is what a lift's masses are worth to the ground,
/// m_c + 2m.
///
/// Written with 1/k and with the natural frequency ω² = k/M_t and damping ratio ζ that the truck has without its mast
/// and load, so that at 1/k = 0 nothing moves; M is M_t with what the main lift moves and carries. With
/// w = y′ + Σμ·v/M in place of y′:
///
/// dy/dt = w − Σμ·v/M,  dw/dt = −(k·y + d·dy/dt)/M.
///
/// No acceleration is needed then, and at a stop the momentum is kept. In the balances,
/// y″ = dw/dt − Σμ·(dv/dt)/M leaves a force −μ·dw/dt and an inertia −μ·μ/M.
#[derive(Debug, Clone)]
pub struct ChassisCompliance<S> {
    inverse_mass: S,
    /// k/M.
    stiffness: S,
    /// d/M.
    damping: S,
    /// m_c + 2m of both lifts [kg].
    worth: [S; 2],
}

/// No truck that carries another's load on a mast weighs less [kg].
const LEAST_TRUCK: f64 = 1000.0;
/// M is at least so many times what both lifts move: with less the masses would lose their sign, and long before
/// the load would tip the truck.
const LEAST_MASS: f64 = 1.2;

impl<S: Scalar> ChassisCompliance<S> {
    /// `lifts`: m_c and m of both.
    fn with(compliance: S, frequency: S, damping_ratio: S, lifts: [(S, S); 2]) -> Self {
        let omega = S::constant(std::f64::consts::TAU) * frequency;
        let inverse_truck = (compliance * omega * omega).min(S::constant(1.0 / LEAST_TRUCK));
        let moved = lifts.iter().fold(S::zero(), |sum, &(m_c, m)| sum + m_c + m);
        let carried = lifts[1].0 + lifts[1].1;
        // M_t/M; k/M = ω²·M_t/M.
        let share = S::one() / (S::one() + inverse_truck * carried);
        ChassisCompliance {
            inverse_mass: (inverse_truck * share).min(S::one() / (S::constant(LEAST_MASS) * moved)),
            stiffness: omega * omega * share,
            damping: S::constant(2.0) * damping_ratio * omega * share,
            worth: lifts.map(|(m_c, m)| m_c + m + m),
        }
    }

    /// dy/dt and dw/dt.
    #[inline(always)]
    fn motion<const L: usize>(&self, bus: &Bus<S, L>, own: &[S]) -> (S, S) {
        let mut momentum = S::zero();
        for k in 0..L {
            momentum = momentum + self.worth[k] * bus.lifts[k].v;
        }
        let rate = own[1] - momentum * self.inverse_mass;
        (rate, -(self.stiffness * own[0]) - self.damping * rate)
    }
}

impl<S: Scalar> Effect<S> for ChassisCompliance<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "chassis_compliance",
        scope: Scope::Mast,
        equation: "M y'' + d y' + y / compliance = -sum of mu_k a_k,  each lift feels -mu_k y'',  mu = m_c + 2 m, \
                   M = M_t + m_c,main + m_main,  M_t = 1 / (compliance omega^2),  d = 2 ratio omega M_t,  \
                   omega = 2 pi frequency",
        source: "Wong (2008), Theory of Ground Vehicles, chapter 7: mass on tyres; Lagrange's equations for the mast on it",
        parameters: &[
            ParameterSpec {
                name: "compliance",
                symbol: "1/k",
                unit: "m/N",
                lower: 0.0,
                upper: 2e-5,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "how far the truck sinks into its tyres per force; the stiffness of both axles, inverted",
                bounds_reason: "at 2e-5 a tonne would press it down by two decimetres; a truck that would be lighter than \
                                a tonne, or than what its mast moves, counts as that",
            },
            ParameterSpec {
                name: "frequency",
                symbol: "f",
                unit: "Hz",
                lower: 0.5,
                upper: 10.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "natural frequency of the truck on its tyres, without what its main lift moves and carries",
                bounds_reason: "from sprung axles to solid tyres under a light truck; above it swings faster than fixed steps follow",
            },
            ParameterSpec {
                name: "damping_ratio",
                symbol: "ζ",
                unit: "1",
                lower: 0.005,
                upper: 0.3,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "damping of that swing",
                bounds_reason: "rubber has 0.02 to 0.1; more is stiffer than fixed steps follow",
            },
        ],
        quiet: 0.0,
        plausible: &[[1e-7, 1.5e-6], [1.5, 4.5], [0.02, 0.15]],
        states: &[
            StateSpec { name: "height", unit: "m", scale: 0.01, meaning: "height of the truck over its rest" },
            StateSpec { name: "swing", unit: "m/s", scale: 0.1, meaning: "its rate and the lifts' momentum over its mass" },
        ],
        shows: &[(0, "fork_height_m", 1.0)],
    };

    fn new(values: &[S], lifts: &[Lift<S>], _place: usize) -> Self {
        let masses = std::array::from_fn(|k| (lifts[k].m_c, lifts[k].m));
        ChassisCompliance::with(values[0], values[1], values[2], masses)
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let (_, pull) = self.motion(bus, own);
        for k in 0..L {
            let port = &mut ports.lifts[k];
            port.force = port.force - self.worth[k] * pull;
            port.inertia = port.inertia - self.worth[k] * self.worth[k] * self.inverse_mass;
        }
        ports.joint_inertia = ports.joint_inertia - self.worth[0] * self.worth[1] * self.inverse_mass;
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        (rates[0], rates[1]) = self.motion(bus, own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    /// 4 t and 300 + 1500 kg on 1 MN/m; the free lift moves 200 + 1000 kg. Mass [kg] and damping [N s/m].
    fn truck() -> (ChassisCompliance<f64>, f64, f64) {
        let omega: f64 = (1e6f64 / 4000.0).sqrt();
        let frequency = omega / std::f64::consts::TAU;
        let chassis = ChassisCompliance::with(1e-6, frequency, 0.05, [(200.0, 1000.0), (300.0, 1500.0)]);
        (chassis, 5800.0, 2.0 * 0.05 * omega * 4000.0)
    }

    #[test]
    fn forces_and_inertias_in_the_balances_are_those_of_the_joint_equations() {
        // Accelerations a, b of the cylinders and y″ of the truck from the ports, then all three balances.
        let (chassis, mass, damping) = truck();
        let (mu, inertia, force) = ([2200.0, 3300.0], [4200.0, 6300.0], [-900.0, 400.0]);
        let mut bus = bus_at_rest();
        (bus.lifts[0].v, bus.lifts[1].v) = (-0.3, -0.1);
        let own = [0.004, 0.01];
        let mut ports = MastPorts::quiet();
        chassis.act(&bus, &own, &mut ports);
        let m = [0, 1].map(|k| inertia[k] + ports.lifts[k].inertia);
        let (f, j) = ([0, 1].map(|k| force[k] + ports.lifts[k].force), ports.joint_inertia);
        let determinant = m[0] * m[1] - j * j;
        let a = [(f[0] * m[1] - j * f[1]) / determinant, (f[1] * m[0] - j * f[0]) / determinant];
        let mut rates = [0.0; 2];
        chassis.rates(&bus, &own, &mut rates);
        let y_rate = own[1] - (mu[0] * -0.3 + mu[1] * -0.1) / mass;
        assert!((rates[0] - y_rate).abs() < 1e-15);
        let y_acceleration = rates[1] - (mu[0] * a[0] + mu[1] * a[1]) / mass;
        let tyres = -1e6 * own[0] - damping * y_rate;
        assert!((mass * y_acceleration + mu[0] * a[0] + mu[1] * a[1] - tyres).abs() < 1e-9);
        for k in 0..2 {
            assert!((inertia[k] * a[k] + mu[k] * y_acceleration - force[k]).abs() < 1e-9);
        }
    }

    #[test]
    fn lighter_than_what_it_lifts_it_cannot_be() {
        let soft = ChassisCompliance::with(1e-5, 8.0, 0.05, [(200.0, 1000.0), (300.0, 1500.0)]);
        assert_eq!(soft.inverse_mass, 1.0 / 3600.0);
    }
}
