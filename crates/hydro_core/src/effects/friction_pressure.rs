//! Seals that the oil's pressure presses against the rod: their friction grows with it.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// F_pr + m·f_cfr → F_pr + m·f_cfr + k·p_A.
#[derive(Debug, Clone)]
pub struct FrictionPressure<S> {
    coefficient: S,
    coulomb: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for FrictionPressure<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "friction_pressure",
        scope: Scope::Lift,
        equation: "F_C = F_pr + m f_cfr + coefficient p_A, in place of F_pr + m f_cfr",
        source: "Bonchis, Corke & Rye (1999), A pressure-based, velocity independent, friction model for asymmetric \
                 hydraulic cylinders",
        parameters: &[ParameterSpec {
            name: "coefficient",
            symbol: "k",
            unit: "m2",
            lower: 0.0,
            upper: 5e-4,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.34)",
            meaning: "Coulomb friction per pressure: friction coefficient times the area of the seals' contact",
            bounds_reason: "a fifth of the thesis's pistons: seals that hold more than that are stuck",
        }],
        quiet: 0.0,
        plausible: &[[1e-5, 1.5e-4]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        FrictionPressure { coefficient: values[0], coulomb: lifts[place].friction.coulomb, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let pressure = bus.lifts[self.place].p_a.max(S::zero());
        let port = &mut ports.lifts[self.place].coulomb_friction;
        *port = *port * (S::one() + self.coefficient * pressure / self.coulomb);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn eight_megapascals_on_a_square_millimetre_of_seal_add_8_newtons_to_coulomb_friction() {
        // 8 N on top of 200 N are a factor of 1.04.
        let mut bus = bus_at_rest();
        bus.lifts[0].p_a = 8e6;
        let mut ports = MastPorts::quiet();
        let seals = FrictionPressure { coefficient: 1e-6, coulomb: 200.0, place: 0 };
        seals.act(&bus, &[], &mut ports);
        assert!((ports.lifts[0].coulomb_friction - 1.04).abs() < 1e-15);
        assert_eq!(ports.lifts[1].coulomb_friction, 1.0);
    }

    #[test]
    fn suction_does_not_pull_the_seals_off() {
        let mut bus = bus_at_rest();
        bus.lifts[1].p_a = -5e4;
        let mut ports = MastPorts::quiet();
        FrictionPressure { coefficient: 1e-6, coulomb: 200.0, place: 1 }.act(&bus, &[], &mut ports);
        assert_eq!(ports.lifts[1].coulomb_friction, 1.0);
    }
}
