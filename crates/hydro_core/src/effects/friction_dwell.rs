//! Friction that grows the longer the lift has rested.

use super::{decayed, Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// g_s → g_s·(1 + a·ln(1 + θ/1 s)); θ, the age of the contacts, grows with time, and the way D_c renews them:
/// dθ/dt = 1 − |v|·θ/D_c.
#[derive(Debug, Clone)]
pub struct FrictionDwell<S> {
    growth: S,
    inverse_way: S,
    place: usize,
}

impl<S: Scalar> FrictionDwell<S> {
    /// How often a second the contacts are renewed at the velocity `v`.
    #[inline(always)]
    fn renewal(&self, v: S) -> S {
        v.abs() * self.inverse_way
    }
}

impl<S: Scalar> Effect<S> for FrictionDwell<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "friction_dwell",
        scope: Scope::Lift,
        equation: "g_s(v, theta) = g_s(v) (1 + growth ln(1 + theta / 1 s)),  d theta/dt = 1 - |v| theta / way",
        source: "Dieterich (1979), Modeling of rock friction 1, Journal of Geophysical Research 84: the ageing law",
        parameters: &[
            ParameterSpec {
                name: "growth",
                symbol: "a",
                unit: "1",
                lower: 0.0,
                upper: 2.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.4)",
                meaning: "relative growth of Coulomb and breakaway friction with the logarithm of the time at rest",
                bounds_reason: "a day at rest would multiply friction by 24",
            },
            ParameterSpec {
                name: "way",
                symbol: "D_c",
                unit: "m",
                lower: 1e-5,
                upper: 1.0,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.4)",
                meaning: "way over which contacts are renewed",
                bounds_reason: "from the size of asperities to the seals' way through their first oil film",
            },
        ],
        quiet: 0.0,
        plausible: &[[0.05, 0.5], [1e-3, 0.1]],
        states: &[StateSpec { name: "age", unit: "s", scale: 1.0, meaning: "age of the contacts" }],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        FrictionDwell { growth: values[0], inverse_way: S::one() / values[1], place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let port = &mut ports.lifts[self.place].coulomb_friction;
        *port = *port * (S::one() + self.growth * (S::one() + own[0].max(S::zero())).ln());
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        rates[0] = S::one() - self.renewal(bus.lifts[self.place].v) * own[0];
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let (before, after) = (self.renewal(from.lifts[self.place].v), self.renewal(to.lifts[self.place].v));
        own[0] = decayed(own[0], S::one(), S::constant(0.5) * (before + after), h);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    const DWELL: FrictionDwell<f64> = FrictionDwell { growth: 0.1, inverse_way: 100.0, place: 0 };

    #[test]
    fn after_e_minus_1_seconds_at_rest_friction_has_grown_by_its_growth() {
        let bus = bus_at_rest();
        let mut own = [0.0];
        DWELL.relax(&bus, &bus, std::f64::consts::E - 1.0, &mut own);
        let mut ports = MastPorts::quiet();
        DWELL.act(&bus, &own, &mut ports);
        assert!((ports.lifts[0].coulomb_friction - 1.1).abs() < 1e-14);
        assert_eq!(ports.lifts[1].coulomb_friction, 1.0);
    }

    #[test]
    fn moving_at_2_decimetres_a_second_over_a_centimetre_the_contacts_end_50_milliseconds_old() {
        // θ = D_c/|v| = 0.01/0.2, there with the rate |v|/D_c = 20/s: e^(−1) of the rest is left after 50 ms.
        let mut bus = bus_at_rest();
        bus.lifts[0].v = -0.2;
        let mut rate = [f64::NAN];
        DWELL.rates(&bus, &[0.05], &mut rate);
        assert!(rate[0].abs() < 1e-15);
        let mut own = [1.05];
        DWELL.relax(&bus, &bus, 0.05, &mut own);
        assert!((own[0] - (0.05 + (-1.0f64).exp())).abs() < 1e-14);
        for _ in 0..100 {
            DWELL.relax(&bus, &bus, 0.05, &mut own);
        }
        assert!((own[0] - 0.05).abs() < 1e-15);
    }
}
