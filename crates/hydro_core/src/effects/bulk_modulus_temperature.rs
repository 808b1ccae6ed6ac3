//! A bulk modulus that falls as the oil warms up.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// E → E·e^(−k(T − 20 °C)).
#[derive(Debug, Clone)]
pub struct BulkModulusTemperature<S> {
    rate: S,
    place: usize,
}

/// The temperature at which E keeps its value [°C].
const REFERENCE_DEGC: f64 = 20.0;

impl<S: Scalar> Effect<S> for BulkModulusTemperature<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "bulk_modulus_temperature",
        scope: Scope::Lift,
        equation: "E(p_A, T) = E(p_A) exp(-rate (T - 20 degC))",
        source: "Merritt (1967), Hydraulic Control Systems, chapter 2: mineral oil loses about half a percent a kelvin",
        parameters: &[ParameterSpec {
            name: "rate",
            symbol: "k",
            unit: "1/K",
            lower: -0.02,
            upper: 0.03,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.2)",
            meaning: "relative fall of the bulk modulus per kelvin",
            bounds_reason: "six times what oil without air shows; the sign is left open, since air may dissolve when warm",
        }],
        quiet: 0.0,
        plausible: &[[-0.005, 0.015]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], _lifts: &[Lift<S>], place: usize) -> Self {
        BulkModulusTemperature { rate: values[0], place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let warmer = bus.oil_temperature_degc - S::constant(REFERENCE_DEGC);
        let port = &mut ports.lifts[self.place].bulk_modulus;
        *port = *port * (-(self.rate * warmer)).exp();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn at_half_a_percent_a_kelvin_40_kelvin_take_18_percent_of_the_bulk_modulus() {
        // e^(−0.005·40) = e^(−0.2) = 0.8187307530779818.
        let mut bus = bus_at_rest();
        bus.oil_temperature_degc = 60.0;
        let mut ports = MastPorts::quiet();
        ports.lifts[0].bulk_modulus = 2.0;
        BulkModulusTemperature { rate: 0.005, place: 0 }.act(&bus, &[], &mut ports);
        assert!((ports.lifts[0].bulk_modulus - 2.0 * 0.818_730_753_077_981_8).abs() < 1e-15);
        assert_eq!(ports.lifts[1].bulk_modulus, 1.0);
    }
}
