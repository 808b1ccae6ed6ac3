//! Friction that is higher, or lower, at one place of the stroke: a dent in a rail, a worn roller, a stage's overlap.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// g_s → g_s·(1 + a·e^(−((x − x₀)/w)²)).
#[derive(Debug, Clone)]
pub struct FrictionPosition<S> {
    rise: S,
    centre: S,
    inverse_width: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for FrictionPosition<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "friction_position",
        scope: Scope::Lift,
        equation: "g_s(v, x) = g_s(v) (1 + rise exp(-((x - centre) / width)^2))",
        source: "Armstrong-Hélouvry (1991), Control of Machines with Friction: friction as a function of position",
        parameters: &[
            ParameterSpec {
                name: "rise",
                symbol: "a",
                unit: "1",
                lower: -0.7,
                upper: 10.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.4)",
                meaning: "relative rise of Coulomb and breakaway friction at the place",
                bounds_reason: "a worn rail still has a third of its friction; eleven times as much would hold an empty carriage",
            },
            ParameterSpec {
                name: "centre",
                symbol: "x0",
                unit: "m",
                lower: -0.1,
                upper: 20.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.4)",
                meaning: "cylinder position of the place",
                bounds_reason: "the range of strokes",
            },
            ParameterSpec {
                name: "width",
                symbol: "w",
                unit: "m",
                lower: 0.02,
                upper: 5.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.4)",
                meaning: "distance from the place at which 1/e of the rise is left",
                bounds_reason: "a roller spreads a dent over some centimetres; wider than a stroke is no place",
            },
        ],
        quiet: 0.0,
        plausible: &[[-0.5, 2.0], [0.5, 1.7], [0.05, 0.5]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        FrictionPosition { rise: values[0], centre: values[1], inverse_width: S::one() / values[2], place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let off = (bus.lifts[self.place].x - self.centre) * self.inverse_width;
        let port = &mut ports.lifts[self.place].coulomb_friction;
        *port = *port * (S::one() + self.rise * (-(off * off)).exp());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn a_dent_that_doubles_friction_adds_1_over_e_of_it_one_width_away_and_nothing_far_away() {
        let dent = FrictionPosition { rise: 1.0, centre: 0.8, inverse_width: 5.0, place: 1 };
        for (x, factor) in [(0.8, 2.0), (0.6, 1.367_879_441_171_442_3), (1.0, 1.367_879_441_171_442_3), (5.0, 1.0)] {
            let mut bus = bus_at_rest();
            bus.lifts[1].x = x;
            let mut ports = MastPorts::quiet();
            ports.lifts[1].coulomb_friction = 3.0;
            dent.act(&bus, &[], &mut ports);
            assert!((ports.lifts[1].coulomb_friction - 3.0 * factor).abs() < 1e-14, "{x}");
            assert_eq!(ports.lifts[0].coulomb_friction, 1.0);
        }
    }
}
