//! A viscosity that thickens faster when cold, and thins slower when hot, than the exponential of (3.1).

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// ln ν = ln ν₀ − λΔ·(1 − s + s·(T₀ − T_V)/(T − T_V)), Δ = T − T₀: between the exponential (s = 0) and Vogel's law
/// e^(B/(T − T_V)) with the same value and slope at T₀ (s = 1), so that ν is multiplied by e^(sλΔ²/(T − T_V)).
/// With it the density falls by the share sβΔ: what flows through an orifice grows with its inverse square root.
#[derive(Debug, Clone)]
pub struct ViscosityLaw<S> {
    share: S,
    vogel: S,
    expansion: S,
    lambda: S,
    t_0: S,
    place: usize,
}

impl<S: Scalar> Effect<S> for ViscosityLaw<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "viscosity_law",
        scope: Scope::Lift,
        equation: "nu = nu_0 exp(-lambda D (1 - share D / (T - vogel))),  D = T - T_0;  rho = rho_0 (1 - share expansion D)",
        source: "Vogel (1921), Das Temperaturabhängigkeitsgesetz der Viskosität von Flüssigkeiten, Physikalische \
                 Zeitschrift 22; within a percent of Walther's double logarithm between 0 and 100 degC",
        parameters: &[
            ParameterSpec {
                name: "share",
                symbol: "s",
                unit: "1",
                lower: 0.0,
                upper: 2.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.1)",
                meaning: "0 is the exponential, 1 is Vogel's law",
                bounds_reason: "twice the curvature of Vogel's law, which no oil has",
            },
            ParameterSpec {
                name: "vogel",
                symbol: "T_V",
                unit: "K",
                lower: 100.0,
                upper: 200.0,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.1)",
                meaning: "temperature at which the law has its pole",
                bounds_reason: "mineral oils have 150 to 190 K; the pole stays below what a truck's oil can have",
            },
            ParameterSpec {
                name: "expansion",
                symbol: "β",
                unit: "1/K",
                lower: 0.0,
                upper: 1.5e-3,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.14)",
                meaning: "relative fall of the density per kelvin",
                bounds_reason: "mineral oils have 7e-4",
            },
        ],
        quiet: 0.0,
        plausible: &[[0.3, 1.5], [160.0, 190.0], [6e-4, 8e-4]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        let (lambda, t_0) = (lifts[place].lambda, lifts[place].t_0);
        ViscosityLaw { share: values[0], vogel: values[1], expansion: values[2], lambda, t_0, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let kelvin = bus.oil_temperature_degc + S::constant(273.0);
        let warmer = kelvin - self.t_0;
        let over_pole = (kelvin - self.vogel).max(S::constant(10.0));
        let density = S::one() - (self.share * self.expansion * warmer).min(S::constant(0.5));
        let ports = &mut ports.lifts[self.place];
        // Critical pressures go with ρν²: the viscosity takes the density's share of them.
        let root = density.sqrt();
        let thicker = (self.share * self.lambda * warmer * warmer / over_pole).exp();
        ports.viscosity = ports.viscosity * thicker * root;
        ports.orifice_gain = ports.orifice_gain / root;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;
    use crate::parts::viscosity::viscosity;

    const LAW: ViscosityLaw<f64> =
        ViscosityLaw { share: 1.0, vogel: 178.0, expansion: 7e-4, lambda: 0.03, t_0: 313.0, place: 1 };

    /// Kinematic viscosity of an oil of 46 cSt at 40 °C, without the density's share, and the orifices' gain.
    fn at(share: f64, celsius: f64) -> (f64, f64) {
        let mut bus = bus_at_rest();
        bus.oil_temperature_degc = celsius;
        let mut ports = MastPorts::quiet();
        ViscosityLaw { share, ..LAW }.act(&bus, &[], &mut ports);
        assert_eq!((ports.lifts[0].viscosity, ports.lifts[0].orifice_gain), (1.0, 1.0));
        let gain = ports.lifts[1].orifice_gain;
        (ports.lifts[1].viscosity * gain * viscosity(46e-6, 0.03, 313.0, celsius), gain)
    }

    #[test]
    fn with_a_full_share_it_is_vogels_law_through_the_same_value_and_slope() {
        // ν = 46 cSt·e^(B/(T − T_V) − B/(T₀ − T_V)), B = λ(T₀ − T_V)².
        let b = 0.03 * 135.0f64 * 135.0;
        for celsius in [-20.0, 0.0, 40.0, 60.0, 100.0] {
            let vogel = 46e-6 * (b / (celsius + 273.0 - 178.0) - b / 135.0).exp();
            assert!((at(1.0, celsius).0 / vogel - 1.0).abs() < 1e-13, "{celsius}");
        }
    }

    #[test]
    fn half_way_the_oil_is_thicker_than_the_exponential_by_the_root_and_light_oil_flows_easier() {
        let exponential = |celsius: f64| viscosity(46e-6, 0.03, 313.0, celsius);
        let (half, full) = (at(0.5, 0.0).0 / exponential(0.0), at(1.0, 0.0).0 / exponential(0.0));
        assert!(full > 1.5 && (half * half / full - 1.0).abs() < 1e-14);
        // 60 K over T₀: 1 − 0.042 of the density.
        assert!((at(1.0, 100.0).1 - 1.0 / 0.958f64.sqrt()).abs() < 1e-15);
    }
}
