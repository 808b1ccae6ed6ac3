//! The return line that both lifts share: its pressure rises with what they let through together.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// p_D → p_D + k·q² at both lifts, q = Σ −A_c·v, none where the lifts rise.
#[derive(Debug, Clone)]
pub struct ReturnBackPressure<S> {
    coefficient: S,
    area: [S; 2],
}

impl<S: Scalar> Effect<S> for ReturnBackPressure<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "return_back_pressure",
        scope: Scope::Mast,
        equation: "p_D = p_T + coefficient q^2 at both lifts,  q = sum of -A_c v where positive",
        source: "Merritt (1967), Hydraulic Control Systems, section 3-3: turbulent flow through pipes and fittings",
        parameters: &[ParameterSpec {
            name: "coefficient",
            symbol: "k",
            unit: "Pa s2/m6",
            lower: 0.0,
            upper: 5e12,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.16), (3.18)",
            meaning: "pressure drop of the return line with its filter over the flow squared",
            bounds_reason: "at 5e12 the thesis's lifts would lose 50 bar at half of the speed of one of them",
        }],
        quiet: 0.0,
        plausible: &[[1e11, 2e12]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], _place: usize) -> Self {
        ReturnBackPressure { coefficient: values[0], area: std::array::from_fn(|k| lifts[k].balance.area) }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        let mut flow = S::zero();
        for k in 0..L {
            flow = flow - self.area[k] * bus.lifts[k].v;
        }
        let flow = flow.max(S::zero());
        for k in 0..L {
            let port = &mut ports.lifts[k].return_pressure;
            *port = *port + self.coefficient * flow * flow;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn both_lifts_feel_the_square_of_their_flows_together() {
        // 2e-3·0.2 + 3e-3·0.2 = 1e-3 m³/s; 3e11·1e-6 = 3 bar. One that rises takes its share away.
        let line = ReturnBackPressure { coefficient: 3e11, area: [2e-3, 3e-3] };
        for (v, pressure) in [([-0.2, -0.2], 3e5), ([0.3, -0.2], 0.0), ([0.2, 0.1], 0.0)] {
            let mut bus = bus_at_rest();
            (bus.lifts[0].v, bus.lifts[1].v) = (v[0], v[1]);
            let mut ports = MastPorts::quiet();
            line.act(&bus, &[], &mut ports);
            for k in 0..2 {
                assert!((ports.lifts[k].return_pressure - pressure).abs() < 1e-9, "{v:?}");
            }
        }
    }
}
