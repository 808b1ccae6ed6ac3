//! Bubbles of air in the cylinder's oil.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::parts::bulk_modulus::BulkModulus;
use crate::scalar::Scalar;

/// 1/E → 1/E + α/(n·p_A)·(p₀/p_A)^(1/n): the share α of the volume at p₀ is air that keeps p·V^n.
#[derive(Debug, Clone)]
pub struct EntrainedAir<S> {
    fraction: S,
    inverse_exponent: S,
    bulk: BulkModulus<S>,
    place: usize,
}

/// Atmospheric pressure, at which the share of air is told [Pa].
const ATMOSPHERE: f64 = 1e5;
/// Below this the air is held as it is [Pa].
const LEAST_PRESSURE: f64 = 2e4;

impl<S: Scalar> EntrainedAir<S> {
    /// What the air adds to 1/E [1/Pa] at the pressure `p` [Pa].
    #[inline(always)]
    fn compliance(&self, p: S) -> S {
        let p = p.max(S::constant(LEAST_PRESSURE));
        let squeezed = (self.inverse_exponent * (S::constant(ATMOSPHERE) / p).ln()).exp();
        self.fraction * self.inverse_exponent * squeezed / p
    }
}

impl<S: Scalar> Effect<S> for EntrainedAir<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "entrained_air",
        scope: Scope::Lift,
        equation: "1/E_eff = 1/E + fraction / (exponent p_A) (1 bar / p_A)^(1/exponent)",
        source: "Gholizadeh, Burton & Schoenau (2011), Fluid bulk modulus: a literature survey, International Journal \
                 of Fluid Power 12",
        parameters: &[
            ParameterSpec {
                name: "fraction",
                symbol: "α",
                unit: "1",
                lower: 0.0,
                upper: 0.2,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.2)",
                meaning: "share of the volume that is air, at atmospheric pressure",
                bounds_reason: "a fifth is foam",
            },
            ParameterSpec {
                name: "exponent",
                symbol: "n",
                unit: "1",
                lower: 1.0,
                upper: 1.7,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.2)",
                meaning: "polytropic exponent of the air",
                bounds_reason: "1 is isothermal, 1.4 adiabatic air, more is seen at high pressure",
            },
        ],
        quiet: 0.0,
        plausible: &[[0.002, 0.05], [1.0, 1.4]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        EntrainedAir { fraction: values[0], inverse_exponent: S::one() / values[1], bulk: lifts[place].bulk, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let p_a = bus.lifts[self.place].p_a;
        // What is in series adds up: with E·f for E, 1/(E·f) + s is 1/E times (1 + E·f·s)/f.
        let port = &mut ports.lifts[self.place].bulk_modulus;
        *port = *port / (S::one() + *port * self.bulk.at(p_a) * self.compliance(p_a));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    fn oil_of_one_gigapascal() -> BulkModulus<f64> {
        BulkModulus::new(1e9, 1e6, 1.0, 0.0, std::f64::consts::E)
    }

    #[test]
    fn a_percent_of_isothermal_air_at_ten_bar_halves_the_stiffness_of_one_gigapascal() {
        // α·p₀/p² = 0.01·1e5/1e12 = 1e-9 /Pa, as much as the oil's.
        let mut bus = bus_at_rest();
        bus.lifts[0].p_a = 1e6;
        let mut ports = MastPorts::quiet();
        let air = EntrainedAir { fraction: 0.01, inverse_exponent: 1.0, bulk: oil_of_one_gigapascal(), place: 0 };
        air.act(&bus, &[], &mut ports);
        assert!((ports.lifts[0].bulk_modulus - 0.5).abs() < 1e-12);
        // As much air again: 1/E_eff = 3/E.
        air.act(&bus, &[], &mut ports);
        assert!((ports.lifts[0].bulk_modulus - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(ports.lifts[1].bulk_modulus, 1.0);
    }

    #[test]
    fn it_is_the_slope_of_the_polytropic_law() {
        // V = α(p₀/p)^(1/n); −dV/dp by a central difference.
        let air = EntrainedAir { fraction: 0.03, inverse_exponent: 1.0 / 1.3, bulk: oil_of_one_gigapascal(), place: 0 };
        let volume = |p: f64| 0.03 * (1e5 / p).powf(1.0 / 1.3);
        for p in [1e5, 2e6, 1e7] {
            let slope = (volume(p * 0.999) - volume(p * 1.001)) / (0.002 * p);
            assert!((air.compliance(p) / slope - 1.0).abs() < 1e-5, "{p}");
        }
        assert!(air.compliance(-1e6).is_finite());
    }
}
