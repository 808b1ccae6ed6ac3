//! Viscous friction that falls as the oil and the grease warm up.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// σ2 → σ2·e^(−k(T − 20 °C)).
#[derive(Debug, Clone)]
pub struct FrictionTemperature<S> {
    rate: S,
    place: usize,
}

/// The temperature at which σ2 keeps its value [°C].
const REFERENCE_DEGC: f64 = 20.0;

impl<S: Scalar> Effect<S> for FrictionTemperature<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "friction_temperature",
        scope: Scope::Lift,
        equation: "sigma_2(T) = sigma_2 exp(-rate (T - 20 degC))",
        source: "Fri & Fahlén (2017), section 6.3; viscosity law (3.1) applied to the lubricating film",
        parameters: &[ParameterSpec {
            name: "rate",
            symbol: "k",
            unit: "1/K",
            lower: -0.03,
            upper: 0.04,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.5)",
            meaning: "relative fall of the viscous friction per kelvin",
            bounds_reason: "greases and oils thin by some percent a kelvin; beyond, friction at a truck's temperatures \
                            is stiffer than fixed steps follow; the sign is left open",
        }],
        quiet: 0.0,
        plausible: &[[-0.01, 0.03]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        FrictionTemperature { rate: values[0], place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let warmer = bus.oil_temperature_degc - S::constant(REFERENCE_DEGC);
        let port = &mut ports.lifts[self.place].viscous_friction;
        *port = *port * (-(self.rate * warmer)).exp();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn at_5_percent_a_kelvin_60_kelvin_warmer_leave_a_twentieth_of_the_friction() {
        // e^(−0.05·60) = e^(−3) = 0.049787068367863943.
        let mut bus = bus_at_rest();
        bus.oil_temperature_degc = 80.0;
        let mut ports = MastPorts::quiet();
        FrictionTemperature { rate: 0.05, place: 0 }.act(&bus, &[], &mut ports);
        assert!((ports.lifts[0].viscous_friction - 0.049_787_068_367_863_943).abs() < 1e-15);
        assert_eq!(ports.lifts[1].viscous_friction, 1.0);
        // Ten kelvin below 20 °C: e^(0.5) = 1.6487212707001282, and it multiplies what was there.
        bus.oil_temperature_degc = 10.0;
        ports.lifts[1].viscous_friction = 2.0;
        FrictionTemperature { rate: 0.05, place: 1 }.act(&bus, &[], &mut ports);
        assert!((ports.lifts[1].viscous_friction - 2.0 * 1.648_721_270_700_128_2).abs() < 1e-14);
    }
}
