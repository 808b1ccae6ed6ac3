//! Chains that stretch under their load.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::parts::bulk_modulus::BulkModulus;
use crate::parts::cylinder;
use crate::scalar::Scalar;

/// V/E → V/E + A_c²/(4k).
///
/// Without the small mass of the cylinder a chain of stiffness k carries half of p_A·A_c; what it stretches, the
/// cylinder yields by half. Per pressure that is the volume A_c²/(4k), in series with the oil's V/E. Written so,
/// the stiff swing of the cylinder between oil and chain is left out. x is then the cylinder's position under a
/// chain that does not stretch: half of the forks'.
#[derive(Debug, Clone)]
pub struct ChainElasticity<S> {
    /// A_c²/4 times the compliance [m³/Pa].
    volume_per_pressure: S,
    bulk: BulkModulus<S>,
    v_0: S,
    area: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for ChainElasticity<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "chain_elasticity",
        scope: Scope::Lift,
        equation: "V/E_eff = V/E + compliance A_c^2 / 4",
        source: "Merritt (1967), Hydraulic Control Systems, section 6-2: structural compliance in series with the oil's",
        parameters: &[ParameterSpec {
            name: "compliance",
            symbol: "1/k",
            unit: "m/N",
            lower: 0.0,
            upper: 2e-5,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.20)",
            meaning: "elongation of the lift's chains, all together, per force in them",
            bounds_reason: "at 2e-5 a tonne would stretch them by two decimetres",
        }],
        quiet: 0.0,
        plausible: &[[2e-7, 4e-6]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        let lift = &lifts[place];
        let area = lift.balance.area;
        let volume_per_pressure = S::constant(0.25) * area * area * values[0];
        ChainElasticity { volume_per_pressure, bulk: lift.bulk, v_0: lift.v_0, area, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let s = &bus.lifts[self.place];
        let stiffness = cylinder::stiffness(self.bulk.at(s.p_a), self.v_0, self.area, s.x);
        let port = &mut ports.lifts[self.place].bulk_modulus;
        *port = *port / (S::one() + *port * stiffness * self.volume_per_pressure);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn a_chain_of_half_a_meganewton_a_metre_yields_as_much_as_eight_litres_of_oil() {
        // A_c = 4e-3 m²: A_c²/(4k) = 1.6e-5/2e6 = 8e-12 m³/Pa. Oil of 1 GPa in 2 l + 4e-3 m²·1.5 m = 8 l: as much.
        let bulk = BulkModulus::new(1e9, 1e6, 1.0, 0.0, std::f64::consts::E);
        let chain =
            ChainElasticity { volume_per_pressure: 0.25 * 1.6e-5 * 2e-6, bulk, v_0: 2e-3, area: 4e-3, place: 1 };
        let mut bus = bus_at_rest();
        (bus.lifts[1].x, bus.lifts[1].p_a) = (1.5, 5e6);
        let mut ports = MastPorts::quiet();
        chain.act(&bus, &[], &mut ports);
        assert!((ports.lifts[1].bulk_modulus - 0.5).abs() < 1e-12);
        // Oil half as stiff to begin with: 1/(2 + 1).
        ports.lifts[1].bulk_modulus = 0.5;
        chain.act(&bus, &[], &mut ports);
        assert!((ports.lifts[1].bulk_modulus - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(ports.lifts[0].bulk_modulus, 1.0);
    }
}
