//! Oil that leaks from the cylinder past its seals to the tank.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// q = k·(p_A − p_T), laminar, leaves the cylinder.
#[derive(Debug, Clone)]
pub struct Leakage<S> {
    coefficient: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for Leakage<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "leakage",
        scope: Scope::Lift,
        equation: "q_leak = coefficient (p_A - p_T), out of the cylinder",
        source: "Merritt (1967), Hydraulic Control Systems, chapter 2: laminar flow through an annular gap",
        parameters: &[ParameterSpec {
            name: "coefficient",
            symbol: "k",
            unit: "m3/(s Pa)",
            lower: 0.0,
            upper: 1e-10,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.20)",
            meaning: "leakage flow per pressure over the tank's",
            bounds_reason: "at 1e-10 a loaded lift would sink half a metre a second",
        }],
        quiet: 0.0,
        plausible: &[[1e-13, 1e-11]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        Leakage { coefficient: values[0], place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let over_tank = bus.lifts[self.place].p_a - bus.p_tank[self.place];
        let port = &mut ports.lifts[self.place].cylinder_flow;
        *port = *port - self.coefficient * over_tank;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn nine_megapascals_over_the_tank_press_18_cubic_millimetres_a_second_through_a_gap_of_2e_15() {
        // 2e-15 m³/(s·Pa)·(9.1 MPa − 0.1 MPa) = 1.8e-8 m³/s, out of the cylinder.
        let mut bus = bus_at_rest();
        (bus.lifts[1].p_a, bus.p_tank[1]) = (9.1e6, 1e5);
        let mut ports = MastPorts::quiet();
        Leakage { coefficient: 2e-15, place: 1 }.act(&bus, &[], &mut ports);
        assert!((ports.lifts[1].cylinder_flow + 1.8e-8).abs() < 1e-22);
        assert_eq!(ports.lifts[0].cylinder_flow, 0.0);
    }

    #[test]
    fn a_cylinder_below_the_tanks_pressure_draws_oil_in() {
        // 2e-15·(0.04 MPa − 0.1 MPa) = −1.2e-10 m³/s.
        let mut bus = bus_at_rest();
        (bus.lifts[0].p_a, bus.p_tank[0]) = (4e4, 1e5);
        let mut ports = MastPorts::quiet();
        Leakage { coefficient: 2e-15, place: 0 }.act(&bus, &[], &mut ports);
        assert!((ports.lifts[0].cylinder_flow - 1.2e-10).abs() < 1e-24);
    }
}
