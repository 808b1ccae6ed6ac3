//! A cushion that brakes the last of the way down.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// F = c·v²·r upward while the lift sinks, r rising from 0 to 1 over the last `length` before the lower stop.
#[derive(Debug, Clone)]
pub struct EndCushion<S> {
    coefficient: S,
    inverse_length: S,
    stroke_lower: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for EndCushion<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "end_cushion",
        scope: Scope::Lift,
        equation: "F = coefficient v^2 (1 - (x - x_min) / length), upward, where v < 0 and 0 < x - x_min < length",
        source: "Merritt (1967), Hydraulic Control Systems, section 3-2: turbulent flow through the orifice that a \
                 cushion leaves, whose drop rises with the speed squared",
        parameters: &[
            ParameterSpec {
                name: "coefficient",
                symbol: "c",
                unit: "N s2/m2",
                lower: 0.0,
                upper: 1e5,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "force at the stop over the cylinder's speed squared",
                bounds_reason: "at 0.5 m/s four times an empty lift's weight; more brakes faster than fixed steps follow",
            },
            ParameterSpec {
                name: "length",
                symbol: "l",
                unit: "m",
                lower: 0.005,
                upper: 0.5,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.27), (3.33)",
                meaning: "way before the lower stop over which the force rises",
                bounds_reason: "half a centimetre to the length of a valve that slows the lift before its stop",
            },
        ],
        quiet: 0.0,
        plausible: &[[2e3, 5e4], [0.02, 0.1]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        let stroke_lower = lifts[place].stop.lower;
        EndCushion { coefficient: values[0], inverse_length: S::one() / values[1], stroke_lower, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let s = &bus.lifts[self.place];
        let (zero, one) = (S::zero(), S::one());
        let ramp = (one - (s.x - self.stroke_lower) * self.inverse_length).clamp_to(zero, one);
        let sinking = s.v.min(zero);
        let port = &mut ports.lifts[self.place].force;
        *port = *port + self.coefficient * sinking * sinking * ramp;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn half_way_into_the_cushion_half_the_force_brakes_what_sinks_and_nothing_what_rises() {
        // 20 000 N s²/m²·(0.3 m/s)² = 1800 N at the stop.
        let cushion = EndCushion { coefficient: 2e4, inverse_length: 20.0, stroke_lower: 0.1, place: 0 };
        for (x, v, force) in
            [(0.125, -0.3, 900.0), (0.1, -0.3, 1800.0), (0.15, -0.3, 0.0), (0.7, -0.3, 0.0), (0.125, 0.3, 0.0)]
        {
            let mut bus = bus_at_rest();
            (bus.lifts[0].x, bus.lifts[0].v) = (x, v);
            let mut ports = MastPorts::quiet();
            cushion.act(&bus, &[], &mut ports);
            assert!((ports.lifts[0].force - force).abs() < 1e-10, "{x} {v}");
            assert_eq!(ports.lifts[1].force, 0.0);
        }
    }
}
