//! The lifts joined mechanically: the free lift's cylinder, carriage and load ride on the second stage.

use super::{Effect, EffectSpec, MastPorts, Scope};
use crate::mast::{Bus, Lift};
use crate::parameters::{Origin, ParameterSpec, Scale};
use crate::scalar::Scalar;

/// The kinetic energy of what rides at 2ẋ_M + ẋ_F (cylinder) and 2ẋ_M + 2ẋ_F (carriage, load)
/// couples the cylinder accelerations by M₁₂ = 2m_c,free + 4(m_f + m_L), in both balances.
#[derive(Debug, Clone)]
pub struct MastCoupling<S> {
    joint_inertia: S,
}

impl<S: Scalar> MastCoupling<S> {
    /// The share `factor` of M₁₂ [kg], from the free lift's masses.
    fn joint_inertia(factor: S, m_c: S, m: S) -> S {
        let two = S::constant(2.0);
        factor * (two * m_c + (two + two) * m)
    }
}

impl<S: Scalar> Effect<S> for MastCoupling<S> {
    const SPEC: EffectSpec = EffectSpec {
        id: "mast_coupling",
        scope: Scope::Mast,
        equation: "M_F a_F + M_12 a_M = F_F,  M_12 a_F + M_M a_M = F_M,  M_12 = factor (2 m_c,free + 4 (m_f + m_L))",
        source: "Fri & Fahlén (2017), section 6.3; Lagrange's equations for the mast of section 2.1",
        parameters: &[ParameterSpec {
            name: "factor",
            symbol: "k",
            unit: "1",
            lower: 0.0,
            upper: 1.0,
            scale: Scale::Linear,
            origin: Origin::Chosen,
            equation: "(3.27), (3.33)",
            meaning: "share of the joint inertia that acts",
            bounds_reason: "zero is the thesis, one a rigid mast; above it the mass matrix may lose its sign",
        }],
        quiet: 0.0,
        plausible: &[[0.2, 1.0]],
        states: &[],
        shows: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], _place: usize) -> Self {
        MastCoupling { joint_inertia: MastCoupling::joint_inertia(values[0], lifts[0].m_c, lifts[0].m) }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        ports.joint_inertia = ports.joint_inertia + self.joint_inertia;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::bus_at_rest;

    #[test]
    fn half_the_joint_inertia_of_a_cylinder_of_12_6_kg_and_800_kg_above_it_is_1612_6_kg() {
        // M₁₂ = 2·12.6 + 4·800 = 3225.2 kg, of which half acts; it adds to what was there.
        let joint_inertia = MastCoupling::joint_inertia(0.5, 12.6, 800.0);
        let mut ports = MastPorts::quiet();
        ports.joint_inertia = 100.0;
        MastCoupling { joint_inertia }.act(&bus_at_rest(), &[], &mut ports);
        assert!((ports.joint_inertia - 1712.6).abs() < 1e-12);
    }

    #[test]
    fn it_is_what_the_kinetic_energy_holds_of_both_velocities_together() {
        // ½·m_c(2v_M + v_F)² + ½·m(2v_M + 2v_F)² holds (2m_c + 4m)·v_F·v_M: with v = 1 both, 9/2·m_c + 8m,
        // less ½·m_c + 2m of v_F alone and 2m_c + 2m of v_M alone.
        let (m_c, m) = (12.6, 800.0);
        let both = 4.5 * m_c + 8.0 * m;
        let mixed = both - (0.5 * m_c + 2.0 * m) - (2.0 * m_c + 2.0 * m);
        assert!((MastCoupling::joint_inertia(1.0, m_c, m) - mixed).abs() < 1e-12 * mixed);
    }
}
