//! A compensator that senses the drop late: through a damping bore, or because its spool is heavy.

use super::{relaxed, Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// p_xy → (1 − s)·p_xy + s·y in (3.15), dy/dt = (p_xy − y)/τ.
#[derive(Debug, Clone)]
pub struct CompensatorDynamics<S> {
    share: S,
    rate: S,
    place: usize,
}

impl<S: Scalar> CompensatorDynamics<S> {
    #[inline(always)]
    fn drop<const L: usize>(&self, bus: &Bus<S, L>) -> S {
        bus.lifts[self.place].p_a - bus.lifts[self.place].p_b
    }
}

impl<S: Scalar> Effect<S> for CompensatorDynamics<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "compensator_dynamics",
        scope: Scope::Lift,
        equation: "p_xy sensed = (1 - share) p_xy + share y,  time dy/dt = p_xy - y",
        source: "Merritt (1967), Hydraulic Control Systems, chapter 5: a spool's chamber filled through a bore follows \
                 the pressure with a first-order lag",
        parameters: &[
            ParameterSpec {
                name: "share",
                symbol: "s",
                unit: "1",
                lower: 0.0,
                upper: 0.8,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.15)",
                meaning: "share of the drop that is sensed late",
                bounds_reason: "with all of it late the loop of valve and compensator hunts",
            },
            ParameterSpec {
                name: "time",
                symbol: "τ",
                unit: "s",
                lower: 5e-3,
                upper: 1.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.15)",
                meaning: "time constant of that share",
                bounds_reason: "below, the compensator's own time constant says it; above, what it still senses of the \
                                closed valve would keep the lift from starting",
            },
        ],
        quiet: 0.0,
        plausible: &[[0.2, 0.7], [0.02, 0.3]],
        states: &[StateSpec { name: "sensed", unit: "Pa", scale: 1e6, meaning: "drop after the lag" }],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        CompensatorDynamics { share: values[0], rate: S::one() / values[1], place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let ports = &mut ports.lifts[self.place];
        ports.sensed_drop = ports.sensed_drop * (S::one() - self.share);
        // What it senses late counts in (3.15) like a lower preset.
        ports.preset_pressure = ports.preset_pressure - self.share * own[0];
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        rates[0] = (self.drop(bus) - own[0]) * self.rate;
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let drop = S::constant(0.5) * (self.drop(from) + self.drop(to));
        own[0] = relaxed(own[0], drop, self.rate, h);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn a_third_sensed_late_leaves_two_thirds_at_once_and_the_rest_as_it_was() {
        let spool = CompensatorDynamics { share: 0.3, rate: 20.0, place: 0 };
        let mut bus = bus_at_rest();
        (bus.lifts[0].p_a, bus.lifts[0].p_b) = (8e6, 7.5e6);
        let mut ports = MastPorts::quiet();
        spool.act(&bus, &[4e5], &mut ports);
        assert!((ports.lifts[0].sensed_drop - 0.7).abs() < 1e-15);
        assert!((ports.lifts[0].preset_pressure + 1.2e5).abs() < 1e-9);
        assert_eq!((ports.lifts[1].sensed_drop, ports.lifts[1].preset_pressure), (1.0, 0.0));
        // 1e5 Pa to go at 20/s, 63 % of it after 50 ms.
        let (mut rate, mut own) = ([0.0], [4e5]);
        spool.rates(&bus, &own, &mut rate);
        assert!((rate[0] - 2e6).abs() < 1e-6);
        spool.relax(&bus, &bus, 0.05, &mut own);
        assert!((own[0] - (5e5 - 1e5 * (-1.0f64).exp())).abs() < 1e-6);
    }
}
