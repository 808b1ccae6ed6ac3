//! Pressure in the cylinder.

use crate::scalar::Scalar;

/// dp_A/dt = E(p_A)/V(x)·(Q − A_c·v) [Pa/s] with V(x) = V0 + A_c·x
/// (Fri & Fahlén 2017, (3.20), (3.21)). `flow_in` is Q, into the cylinder: −q_A while lowering.
#[inline(always)]
pub fn pressure_rate<S: Scalar>(bulk_modulus: S, v_0: S, area: S, x: S, v: S, flow_in: S) -> S {
    stiffness(bulk_modulus, v_0, area, x) * (flow_in - area * v)
}

/// E/V(x) [Pa/m³]. The volume is held above a tenth of V0: a cylinder below its bottom by more is outside the law.
#[inline(always)]
pub fn stiffness<S: Scalar>(bulk_modulus: S, v_0: S, area: S, x: S) -> S {
    bulk_modulus / (v_0 + area * x).max(S::constant(0.1) * v_0)
}
