//! The mass of the oil in the hose between cylinder and valve.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::parts::end_stop::EndStop;
use crate::parts::force_balance::ForceBalance;
use crate::parts::lugre::LuGre;
use crate::scalar::Scalar;

/// p_in = p_A − I·dq/dt with dq/dt = −A_c·dv/dt, I = ρ·l/A; dv/dt is that of the lift's own balance (3.27), (3.33),
/// without what other effects add to it.
#[derive(Debug, Clone)]
pub struct HoseInertance<S> {
    inertance: S,
    balance: ForceBalance<S>,
    friction: LuGre<S>,
    stop: EndStop<S>,
    place: usize,
}

impl<S: Scalar> Effect<S> for HoseInertance<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "hose_inertance",
        scope: Scope::Lift,
        equation: "p_in = p_A - inertance dq/dt,  dq/dt = -A_c dv/dt, in place of p_A before the proportional valve",
        source: "Watton (2009), Fundamentals of Fluid Power Control, chapter 4: inertance of a line, rho length / area",
        parameters: &[ParameterSpec {
            name: "inertance",
            symbol: "I",
            unit: "kg/m4",
            lower: 0.0,
            upper: 1e8,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.14), (3.15)",
            meaning: "density times length over cross-section of the hose",
            bounds_reason: "13 m of a half-inch hose; with more its oil weighs like the empty free lift, seen at the \
                            piston, and fixed steps no longer follow",
        }],
        quiet: 0.0,
        plausible: &[[5e6, 6e7]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        let lift = &lifts[place];
        let (balance, friction, stop) = (lift.balance, lift.friction, lift.stop);
        HoseInertance { inertance: values[0], balance, friction, stop, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let s = &bus.lifts[self.place];
        let (friction, _) = self.friction.force_and_rate(s.v, s.z, self.friction.sigma_2);
        let acceleration = self.balance.net_force(s.p_a, friction) / self.balance.inertia;
        let acceleration = S::select(self.stop.blocks(s.x, acceleration), S::zero(), acceleration);
        let port = &mut ports.lifts[self.place].inlet_pressure;
        *port = *port + self.inertance * self.balance.area * acceleration;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn to_set_the_oil_off_with_the_lift_takes_a_pressure_that_the_valve_does_not_see() {
        // 1000 kg (m_c 200, m 200) with 600·9.8 N of weight and no pressure fall at 5.88 m/s²;
        // 2e7 kg/m⁴·2e-3 m²·5.88 m/s² = 235.2 kPa. Held by the stop nothing moves.
        let hose = HoseInertance {
            inertance: 2e7,
            balance: ForceBalance::new(200.0, 200.0, 9.8, 2e-3),
            friction: LuGre::new(100.0, 2.0, 100.0, 1e4, 0.0, 0.0),
            stop: EndStop { lower: 0.0, upper: 1.0 },
            place: 0,
        };
        for (x, pressure) in [(0.5, -235.2e3), (0.0, 0.0)] {
            let mut bus = bus_at_rest();
            bus.lifts[0].x = x;
            let mut ports = MastPorts::quiet();
            hose.act(&bus, &[], &mut ports);
            assert!((ports.lifts[0].inlet_pressure - pressure).abs() < 1e-6);
            assert_eq!(ports.lifts[1].inlet_pressure, 0.0);
        }
    }
}
