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
        states: &[],
    };

    fn new(values: &[S], lifts: &[Lift<S>], _place: usize) -> Self {
        let free = &lifts[0];
        let two = S::constant(2.0);
        MastCoupling { joint_inertia: values[0] * (two * free.m_c + (two + two) * free.m) }
    }

    #[inline(always)]
    fn act<const L: usize>(&self, _bus: &Bus<S, L>, _own: &[S], ports: &mut MastPorts<S, L>) {
        ports.joint_inertia = ports.joint_inertia + self.joint_inertia;
    }
}
