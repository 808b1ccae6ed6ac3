//! Dead time between the command and the proportional valve.

use super::{Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// u reaches the valve through four lags of τ/4 in a row: Erlang's distribution of delays, with the mean τ.
///
/// The fast path gives the valve the mean of what leaves the chain over its substep. That is exact for any τ, so
/// that a delay shorter than a substep counts as well, and so does the derivative at none.
#[derive(Debug, Clone)]
pub struct ValveDelay<S> {
    delay: S,
    rate: S,
    place: usize,
}

/// A link of the chain is not faster than this [s].
const SHORTEST: f64 = 1e-4;
const LINKS: usize = 4;

impl<S: Scalar> ValveDelay<S> {
    fn with(delay: S, place: usize) -> Self {
        let links = S::constant(LINKS as f64);
        ValveDelay { delay, rate: S::one() / (delay / links).max(S::constant(SHORTEST)), place }
    }
}

impl<S: Scalar> Effect<S> for ValveDelay<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "valve_delay",
        scope: Scope::Lift,
        equation: "u at the valve is y_4,  (delay / 4) dy_k/dt = y_(k-1) - y_k,  y_0 = u",
        source: "MacDonald (1978), Time Lags in Biological Models: the linear chain that stands for a delay",
        parameters: &[ParameterSpec {
            name: "delay",
            symbol: "τ",
            unit: "s",
            lower: 0.0,
            upper: 0.5,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.13)",
            meaning: "mean delay of the command",
            bounds_reason: "25 periods of the controller; no valve that still works is later",
        }],
        quiet: 0.0,
        plausible: &[[0.005, 0.1]],
        states: &[
            StateSpec { name: "link_1", unit: "A", scale: 1.0, meaning: "command after the first lag" },
            StateSpec { name: "link_2", unit: "A", scale: 1.0, meaning: "command after the second" },
            StateSpec { name: "link_3", unit: "A", scale: 1.0, meaning: "command after the third" },
            StateSpec { name: "link_4", unit: "A", scale: 1.0, meaning: "command after the fourth" },
            StateSpec { name: "late", unit: "A", scale: 1.0, meaning: "what the valve is given: the fourth's mean" },
        ],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        ValveDelay::with(values[0], place)
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let port = &mut ports.lifts[self.place].current;
        *port = *port + (own[LINKS] - bus.command[self.place]);
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        let mut before = bus.command[self.place];
        for k in 0..LINKS {
            rates[k] = (before - own[k]) * self.rate;
            before = own[k];
        }
        // In continuous time the mean over no time is the value; the second term only says so again.
        rates[LINKS] = rates[LINKS - 1] + (own[LINKS - 1] - own[LINKS]) * self.rate;
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, _from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let command = to.command[self.place];
        let s = self.rate * h;
        let decay = (-s).exp();
        let (mut change, mut after) = (S::zero(), [S::zero(); LINKS]);
        for k in 0..LINKS {
            // e^(−s)·Σ s^j/j!·(y_(k−j) − u), from the far end.
            let mut left = own[0] - command;
            for j in 1..=k {
                left = (own[j] - command) + left * s * S::constant(1.0 / (k - j + 1) as f64);
            }
            after[k] = command + decay * left;
            change = change + (after[k] - own[k]);
        }
        own[..LINKS].copy_from_slice(&after);
        // What went into the chain and has not stayed in it has come out.
        own[LINKS] = command - self.delay * S::constant(1.0 / LINKS as f64) * change / h;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn of_a_step_the_valve_sees_what_erlangs_distribution_has_let_through() {
        // 1 − e^(−s)(1 + s + s²/2 + s³/6) after s = 4t/τ.
        let delay = ValveDelay::with(0.08, 0);
        let mut bus = bus_at_rest();
        bus.command = [1.0, 0.3];
        for steps in [1, 3, 10] {
            let mut own = [0.0; 5];
            let mut area = 0.0;
            for _ in 0..steps {
                delay.relax(&bus, &bus, 0.06 / f64::from(steps), &mut own);
                area += own[4] * 0.06 / f64::from(steps);
            }
            let s = 3.0f64;
            let through = 1.0 - (-s).exp() * (1.0 + s + s * s / 2.0 + s * s * s / 6.0);
            assert!((own[3] - through).abs() < 1e-14, "{steps}: {}", own[3]);
            // ∫ over time: t − τ/4·Σ of the four links.
            let links: f64 = own[..4].iter().sum();
            assert!((area - (0.06 - 0.02 * links)).abs() < 1e-14);
            let mut ports = MastPorts::quiet();
            delay.act(&bus, &own, &mut ports);
            assert_eq!(ports.lifts[0].current, own[4] - 1.0);
            assert_eq!(ports.lifts[1].current, 0.0);
        }
    }

    #[test]
    fn the_closed_form_is_the_chain_of_its_rates() {
        let delay = ValveDelay::with(0.2, 1);
        let mut bus = bus_at_rest();
        bus.command[1] = 0.7;
        let start = [0.4, -0.2, 0.9, 0.1, 0.0];
        let (mut exact, mut x) = (start, start);
        delay.relax(&bus, &bus, 0.05, &mut exact);
        for _ in 0..5000 {
            // Midpoint rule.
            let (mut a, mut b) = ([0.0; 5], [0.0; 5]);
            delay.rates(&bus, &x, &mut a);
            let half: Vec<f64> = x.iter().zip(a).map(|(x, a)| x + 0.5e-5 * a).collect();
            delay.rates(&bus, &half, &mut b);
            x = std::array::from_fn(|k| x[k] + 1e-5 * b[k]);
        }
        for k in 0..4 {
            assert!((x[k] - exact[k]).abs() < 1e-8, "{k}");
        }
    }

    #[test]
    fn without_delay_the_valve_gets_the_command_to_the_bit_and_a_short_one_takes_its_share_of_a_step() {
        let mut bus = bus_at_rest();
        bus.command = [0.7, 0.7];
        let mut own = [0.0; 5];
        ValveDelay::with(0.0, 0).relax(&bus, &bus, 0.005, &mut own);
        assert_eq!(own[4], 0.7);
        // A millisecond of five is missing.
        let mut own = [0.0; 5];
        ValveDelay::with(0.001, 0).relax(&bus, &bus, 0.005, &mut own);
        assert!((own[4] - 0.7 * 0.8).abs() < 1e-6, "{}", own[4]);
    }
}
