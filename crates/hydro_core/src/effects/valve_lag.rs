//! A share of the command that arrives late: an opening that creeps after it.

use super::{relaxed, Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// u → (1 − s)·u + s·y, dy/dt = (u − y)/τ.
///
/// The fast path gives the valve the mean of y over its substep, as [`super::valve_delay`] does.
#[derive(Debug, Clone)]
pub struct ValveLag<S> {
    share: S,
    time: S,
    rate: S,
    place: usize,
}

impl<S: Scalar> ValveLag<S> {
    fn with(share: S, time: S, place: usize) -> Self {
        ValveLag { share, time, rate: S::one() / time, place }
    }
}

impl<S: Scalar> Effect<S> for ValveLag<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "valve_lag",
        scope: Scope::Lift,
        equation: "u at the valve = (1 - share) u + share y,  time dy/dt = u - y",
        source: "Merritt (1967), Hydraulic Control Systems, chapter 5: a pilot stage or a coil's eddy currents as a \
                 first-order lag",
        parameters: &[
            ParameterSpec {
                name: "share",
                symbol: "s",
                unit: "1",
                lower: -1.0,
                upper: 1.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.13)",
                meaning: "share of the command that arrives late; negative where the valve overshoots and settles",
                bounds_reason: "the whole command",
            },
            ParameterSpec {
                name: "time",
                symbol: "τ",
                unit: "s",
                lower: 1e-3,
                upper: 20.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.13)",
                meaning: "time constant of that share",
                bounds_reason: "from a fraction of the controller's period to longer than a lowering",
            },
        ],
        quiet: 0.0,
        plausible: &[[-0.1, 0.5], [0.03, 1.0]],
        states: &[
            StateSpec { name: "lagged", unit: "A", scale: 1.0, meaning: "command after the lag" },
            StateSpec { name: "late", unit: "A", scale: 1.0, meaning: "what the valve is given of it: its mean" },
        ],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        ValveLag::with(values[0], values[1], place)
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let port = &mut ports.lifts[self.place].current;
        *port = *port + self.share * (own[1] - bus.command[self.place]);
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        rates[0] = (bus.command[self.place] - own[0]) * self.rate;
        // In continuous time the mean over no time is the value; the second term only says so again.
        rates[1] = rates[0] + (own[0] - own[1]) * self.rate;
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, _from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let command = to.command[self.place];
        let after = relaxed(own[0], command, self.rate, h);
        own[1] = command - self.time * (after - own[0]) / h;
        own[0] = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn a_third_of_a_step_arrives_late_and_63_percent_of_it_after_the_time_constant() {
        let lag = ValveLag::with(0.3, 0.1, 1);
        let mut bus = bus_at_rest();
        bus.command = [0.0, 1.0];
        let mut own = [0.0; 2];
        lag.relax(&bus, &bus, 0.1, &mut own);
        assert!((own[0] - (1.0 - (-1.0f64).exp())).abs() < 1e-15);
        // Its mean meanwhile: 1 − (1 − e^(−1)) = e^(−1).
        assert!((own[1] - (-1.0f64).exp()).abs() < 1e-15);
        let mut ports = MastPorts::quiet();
        lag.act(&bus, &own, &mut ports);
        assert!((ports.lifts[1].current - 0.3 * ((-1.0f64).exp() - 1.0)).abs() < 1e-15);
        assert_eq!(ports.lifts[0].current, 0.0);
        let mut rates = [0.0; 2];
        lag.rates(&bus, &[0.4, 0.4], &mut rates);
        assert!((rates[0] - 6.0).abs() < 1e-12 && rates[0] == rates[1]);
    }
}
