//! Oil that is warmer at the valve than in the tank: what it loses in pressure there heats it.

use super::{relaxed, Effect, EffectSpec, MastPorts, Scope, StateSpec};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// ν → ν·e^(−λRP): P, the power that is throttled, −p_A·A_c·v while lowering, smoothed by dP/dt = (p_A·q − P)/τ,
/// heats the valve by R·P over the tank.
#[derive(Debug, Clone)]
pub struct OilTemperatureAtValve<S> {
    resistance: S,
    rate: S,
    lambda: S,
    area: S,
    place: usize,
}

impl<S: Scalar> OilTemperatureAtValve<S> {
    /// The power that is throttled now [W].
    #[inline(always)]
    fn throttled<const L: usize>(&self, bus: &Bus<S, L>) -> S {
        let s = &bus.lifts[self.place];
        (-(s.p_a * self.area * s.v)).max(S::zero())
    }
}

impl<S: Scalar> Effect<S> for OilTemperatureAtValve<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "oil_temperature_at_valve",
        scope: Scope::Lift,
        equation: "nu = nu(T) exp(-lambda resistance P),  time dP/dt = max(-p_A A_c v, 0) - P",
        source: "Merritt (1967), Hydraulic Control Systems, chapter 2: the energy that oil loses in an orifice heats \
                 it; a heat balance with one heat capacity",
        parameters: &[
            ParameterSpec {
                name: "resistance",
                symbol: "R",
                unit: "K/W",
                lower: 0.0,
                upper: 0.02,
                scale: Scale::Linear,
                origin: Origin::Chosen,
                equation: "(3.1)",
                meaning: "kelvin over the tank per watt that is throttled at length",
                bounds_reason: "at 0.02 the 5 kW of a loaded lowering would heat the valve by 100 K",
            },
            ParameterSpec {
                name: "time",
                symbol: "τ",
                unit: "s",
                lower: 0.05,
                upper: 1e3,
                scale: Scale::Log,
                origin: Origin::Chosen,
                equation: "(3.1)",
                meaning: "time constant of the warming",
                bounds_reason: "from the oil in the valve alone to its whole block of iron",
            },
        ],
        quiet: 0.0,
        plausible: &[[2e-4, 5e-3], [0.5, 60.0]],
        states: &[StateSpec { name: "power", unit: "W", scale: 1e3, meaning: "throttled power, smoothed" }],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], place: usize) -> Self {
        let (lambda, area) = (lifts[place].lambda, lifts[place].balance.area);
        OilTemperatureAtValve { resistance: values[0], rate: S::one() / values[1], lambda, area, place }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, own: &[S], ports: &mut MastPorts<S, L>) {
        let port = &mut ports.lifts[self.place].viscosity;
        *port = *port * (-(self.lambda * self.resistance * own[0])).exp();
    }

    #[inline(always)]
    fn rates<const L: usize>(&self, bus: &Bus<S, L>, own: &[S], rates: &mut [S]) {
        rates[0] = (self.throttled(bus) - own[0]) * self.rate;
    }

    const RELAXES: bool = true;

    #[inline(always)]
    fn relax<const L: usize>(&self, from: &Bus<S, L>, to: &Bus<S, L>, h: S, own: &mut [S]) {
        let power = S::constant(0.5) * (self.throttled(from) + self.throttled(to));
        own[0] = relaxed(own[0], power, self.rate, h);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn four_kilowatts_warm_the_valve_by_4_kelvin_at_length_and_by_63_percent_of_it_after_its_time() {
        // 8e6 Pa·2e-3 m²·0.25 m/s = 4 kW; 4000·0.001 K/W = 4 K, and λ = 0.03/K thins the oil by e^(−0.12).
        let valve = OilTemperatureAtValve { resistance: 1e-3, rate: 0.1, lambda: 0.03, area: 2e-3, place: 0 };
        let mut bus = bus_at_rest();
        (bus.lifts[0].p_a, bus.lifts[0].v) = (8e6, -0.25);
        let mut own = [0.0];
        valve.relax(&bus, &bus, 10.0, &mut own);
        assert!((own[0] - 4000.0 * (1.0 - (-1.0f64).exp())).abs() < 1e-9);
        let mut rate = [0.0];
        valve.rates(&bus, &[4000.0], &mut rate);
        assert!(rate[0].abs() < 1e-9);
        let mut ports = MastPorts::quiet();
        valve.act(&bus, &[4000.0], &mut ports);
        assert!((ports.lifts[0].viscosity - (-0.12f64).exp()).abs() < 1e-15);
        assert_eq!(ports.lifts[1].viscosity, 1.0);
        // Rising it throttles nothing.
        bus.lifts[0].v = 0.25;
        valve.rates(&bus, &[0.0], &mut rate);
        assert_eq!(rate[0], 0.0);
    }
}
