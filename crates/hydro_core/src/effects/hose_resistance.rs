//! Pressure that the hose between cylinder and valve takes.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// p_in = p_A − k·q|q| with q = −A_c·v, the oil that the sinking piston displaces.
#[derive(Debug, Clone)]
pub struct HoseResistance<S> {
    coefficient: S,
    area: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for HoseResistance<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "hose_resistance",
        scope: Scope::Lift,
        equation: "p_in = p_A - coefficient q |q|,  q = -A_c v, in place of p_A before the proportional valve",
        source: "Merritt (1967), Hydraulic Control Systems, section 3-3: turbulent flow through pipes and fittings",
        parameters: &[ParameterSpec {
            name: "coefficient",
            symbol: "k",
            unit: "Pa s2/m6",
            lower: 0.0,
            upper: 5e12,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.14), (3.15)",
            meaning: "pressure drop of hose and fittings over the flow squared",
            bounds_reason: "at 5e12 the thesis's lifts would lose 50 bar at half of their speed",
        }],
        quiet: 0.0,
        plausible: &[[1e11, 2e12]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        HoseResistance { coefficient: values[0], area: lifts[place].balance.area, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let flow = -(self.area * bus.lifts[self.place].v);
        let port = &mut ports.lifts[self.place].inlet_pressure;
        *port = *port - self.coefficient * flow * flow.abs();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn half_a_litre_a_second_loses_a_quarter_of_a_bar_in_a_hose_of_1e11_and_gains_it_backwards() {
        // 2e-3 m²·0.25 m/s = 5e-4 m³/s; 1e11·25e-8 = 25 kPa.
        for (v, pressure) in [(-0.25, -25e3), (0.25, 25e3)] {
            let mut bus = bus_at_rest();
            bus.lifts[1].v = v;
            let mut ports = MastPorts::quiet();
            HoseResistance { coefficient: 1e11, area: 2e-3, place: 1 }.act(&bus, &[], &mut ports);
            assert!((ports.lifts[1].inlet_pressure - pressure).abs() < 1e-9);
            assert_eq!(ports.lifts[0].inlet_pressure, 0.0);
        }
    }
}
