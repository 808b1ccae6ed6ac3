//! Pressure compensator: opening in steady state with flow force, first-order dynamics.

use crate::scalar::Scalar;

/// A_s = A_max − k(p_xy + p_flow − p_set), held in [A_leak, A_max], k = (A_max − A_leak)/p_reg,
/// p_flow = (p_C − p_D)·A·C_D·cos θ/A_spool, dA/dt = (A_s − A)/τ
/// (Fri & Fahlén 2017, (3.15) with the order of Figure A.9, (3.16), (3.17)).
/// p_xy = p_A − p_B is the drop across the proportional valve.
#[derive(Debug, Clone, Copy)]
pub struct Compensator<S> {
    pub a_max: S,
    pub a_leak: S,
    pub slope: S,
    pub p_set: S,
    pub flow_force: S,
    pub inverse_tau: S,
}

impl<S: Scalar> Compensator<S> {
    #[allow(clippy::too_many_arguments)] // the parameters of (3.15) to (3.17)
    pub fn new(a_max: S, a_leak: S, a_spool: S, p_reg: S, p_set: S, tau: S, c_d: S, theta: S) -> Self {
        Compensator {
            a_max,
            a_leak,
            slope: (a_max - a_leak) / p_reg,
            p_set,
            flow_force: c_d * theta.cos() / a_spool,
            inverse_tau: S::one() / tau,
        }
    }

    /// A_s [m²] at the drops across valve and compensator [Pa] and the present opening [m²].
    #[inline(always)]
    pub fn steady_area(&self, p_xy: S, p_cd: S, area: S, p_set: S) -> S {
        let p_flow = p_cd * area * self.flow_force;
        (self.a_max - self.slope * (p_xy + p_flow - p_set)).clamp_to(self.a_leak, self.a_max)
    }

    /// dA/dt [m²/s].
    #[inline(always)]
    pub fn rate(&self, p_xy: S, p_cd: S, area: S, p_set: S) -> S {
        (self.steady_area(p_xy, p_cd, area, p_set) - area) * self.inverse_tau
    }
}
