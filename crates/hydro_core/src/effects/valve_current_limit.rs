//! A coil that does not get the current that is asked for: its driver's voltage limits it, the sooner the warmer it is.

use super::{relaxed, Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// u → u − s·⌈u − i_max/(1 + αw)⌉₊, dw/dt = (u² − w)/τ; ⌈x⌉₊ = ½(x + √(x² + ε²)) is a ramp with a rounded corner.
#[derive(Debug, Clone)]
pub struct ValveCurrentLimit<S> {
    share: S,
    limit: S,
    warming: S,
    rate: S,
    place: usize,
}

/// Width of the ramp's corner [A]: three steps of the ECU.
const CORNER: f64 = 0.02;

impl<S: Scalar> Effect<S> for ValveCurrentLimit<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "valve_current_limit",
        scope: Scope::Lift,
        equation: "u at the valve = u - share ramp(u - limit / (1 + warming w)),  time dw/dt = u^2 - w,  \
                   ramp(x) = (x + sqrt(x^2 + (20 mA)^2)) / 2",
        source: "Ohm's law with the resistance of copper rising by 0.39 percent a kelvin; heat balance of a coil",
        parameters: &[
            ParameterSpec {
                name: "share",
                symbol: "s",
                unit: "1",
                lower: 0.0,
                upper: 1.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.13)",
                meaning: "share that is lost of what exceeds the limit; one is a hard limit",
                bounds_reason: "more current never gives less",
            },
            ParameterSpec {
                name: "limit",
                symbol: "i_max",
                unit: "A",
                lower: 0.2,
                upper: 2.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.13)",
                meaning: "largest current through the cold coil",
                bounds_reason: "at 0.2 A no valve opens; the ECU commands up to 1.75 A",
            },
            ParameterSpec {
                name: "warming",
                symbol: "α",
                unit: "1/A2",
                lower: 0.0,
                upper: 2.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.13)",
                meaning: "relative rise of the coil's resistance by an ampere squared at length",
                bounds_reason: "0.4 is a coil that an ampere heats by 100 K",
            },
            ParameterSpec {
                name: "time",
                symbol: "τ",
                unit: "s",
                lower: 0.1,
                upper: 1e4,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.13)",
                meaning: "time constant of the coil's warming",
                bounds_reason: "from its wire alone to the whole block",
            },
        ],
        quiet: 0.0,
        plausible: &[[0.2, 1.0], [0.4, 1.0], [0.05, 0.5], [5.0, 300.0]],
        states: &[StateSpec { name: "heat", unit: "A2", scale: 1.0, meaning: "current squared, smoothed" }],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        ValveCurrentLimit {
            share: values[0],
            limit: values[1],
            warming: values[2],
            rate: S::one() / values[3],
            place,
        }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let limit = self.limit / (S::one() + self.warming * own[0].max(S::zero()));
        let excess = bus.command[self.place] - limit;
        let ramp = S::constant(0.5) * (excess + (excess * excess + S::constant(CORNER * CORNER)).sqrt());
        let port = &mut ports.lifts[self.place].current;
        *port = *port - self.share * ramp;
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        let command = bus.command[self.place];
        rates[0] = (command * command - own[0]) * self.rate;
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, _from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let command = to.command[self.place];
        own[0] = relaxed(own[0], command * command, self.rate, h);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn half_an_ampere_over_the_limit_of_a_warm_coil_is_lost_and_far_below_it_nothing() {
        // 1.2 A/(1 + 0.5·0.4) = 1 A; ramp(0.5) = ½(0.5 + √(0.25 + 0.0004)).
        let coil = ValveCurrentLimit { share: 1.0, limit: 1.2, warming: 0.5, rate: 0.1, place: 0 };
        let mut bus = bus_at_rest();
        bus.command = [1.5, 0.0];
        let mut ports = MastPorts::quiet();
        coil.act(&bus, &[0.4], &mut ports);
        assert!((ports.lifts[0].current + 0.5 * (0.5 + 0.2504f64.sqrt())).abs() < 1e-15);
        assert_eq!(ports.lifts[1].current, 0.0);
        bus.command[0] = 0.2;
        let mut ports = MastPorts::quiet();
        coil.act(&bus, &[0.4], &mut ports);
        assert!((-2e-4..0.0).contains(&ports.lifts[0].current));
    }

    #[test]
    fn it_warms_towards_the_current_squared() {
        let coil = ValveCurrentLimit { share: 1.0, limit: 1.2, warming: 0.5, rate: 0.1, place: 1 };
        let mut bus = bus_at_rest();
        bus.command = [0.0, 2.0];
        let (mut own, mut rate) = ([1.0], [0.0]);
        coil.rates(&bus, &own, &mut rate);
        assert!((rate[0] - 0.3).abs() < 1e-15);
        coil.relax(&bus, &bus, 10.0, &mut own);
        assert!((own[0] - (4.0 - 3.0 * (-1.0f64).exp())).abs() < 1e-14);
    }
}
