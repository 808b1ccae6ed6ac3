//! The jet through the proportional valve that draws its spool shut.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::parts::area_table::AreaTable;
use crate::scalar::Scalar;

/// u → u − k·A(i)·(p_A − p_B).
#[derive(Debug, Clone)]
pub struct ValveFlowForce<S> {
    coefficient: S,
    table: AreaTable<S>,
    place: usize,
}

impl<S: Scalar> Effect<S> for ValveFlowForce<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "valve_flow_force",
        scope: Scope::Lift,
        equation: "u at the valve = u - coefficient A(i) (p_A - p_B)",
        source: "Merritt (1967), Hydraulic Control Systems, section 5-6: steady flow force, 2 C_D C_v cos(69 deg) = \
                 0.43 times opening and drop, over the force of the magnet per ampere",
        parameters: &[ParameterSpec {
            name: "coefficient",
            symbol: "k",
            unit: "A/N",
            lower: 0.0,
            upper: 0.03,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.13)",
            meaning: "current that the jet's force is worth, per opening times drop",
            bounds_reason: "0.43 over 14 N/A, the weakest of magnets; wide open at the regulated drop it is then worth \
                            half an ampere",
        }],
        quiet: 0.0,
        plausible: &[[1e-3, 1e-2]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        ValveFlowForce { coefficient: values[0], table: lifts[place].table, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let s = &bus.lifts[self.place];
        let port = &mut ports.lifts[self.place].current;
        *port = *port - self.coefficient * self.table.at(s.i) * (s.p_a - s.p_b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn twenty_square_millimetres_at_half_a_megapascal_pull_with_10_newtons_and_cost_50_milliamperes() {
        // A(0.6 A) = 0.6·(1/30) cm² = 2e-5 m²; 2e-5·5e5 = 10 N; 10·0.005 = 0.05 A.
        let table = AreaTable::new(&[0.0, 1.0], &[0.0, 2e-5 / 0.6], 1e-9);
        let mut bus = bus_at_rest();
        (bus.lifts[1].i, bus.lifts[1].p_a, bus.lifts[1].p_b) = (0.6, 8.5e6, 8e6);
        let mut ports = MastPorts::quiet();
        ValveFlowForce { coefficient: 0.005, table, place: 1 }.act(&bus, &[], &mut ports);
        assert!((ports.lifts[1].current + 0.05).abs() < 1e-15);
        assert_eq!(ports.lifts[0].current, 0.0);
    }
}
