//! Force balance of a lift: a cylinder, and through a chain what moves twice as fast.

use crate::scalar::Scalar;

/// (m_c + 4m)·dv/dt = p_A·A_c − (m_c + 2m)·g − F_LuGre with m the moving mass with its load
/// (Fri & Fahlén 2017, (3.27) for the free lift, (3.33) for the main lift, whose m_c carries the
/// first stage and whose m is the second stage with all it carries).
#[derive(Debug, Clone, Copy)]
pub struct ForceBalance<S> {
    /// m_c + 4m [kg], seen at the cylinder.
    pub inertia: S,
    /// (m_c + 2m)·g [N].
    pub weight: S,
    pub area: S,
}

impl<S: Scalar> ForceBalance<S> {
    pub fn new(m_c: S, m: S, g: S, area: S) -> Self {
        let two_m = m + m;
        ForceBalance { inertia: m_c + (two_m + two_m), weight: (m_c + two_m) * g, area }
    }

    /// Net upward force on the cylinder [N].
    #[inline(always)]
    pub fn net_force(&self, p_a: S, friction: S) -> S {
        p_a * self.area - self.weight - friction
    }

    /// p_A [Pa] at which the lift stands still without friction.
    pub fn equilibrium_pressure(&self) -> S {
        self.weight / self.area
    }
}
