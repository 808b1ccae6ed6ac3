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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inertia_and_weight_follow_from_the_energies_of_a_mass_that_moves_twice_as_fast() {
        let (m_c, m, g) = (12.6, 778.0, 9.82);
        let balance = ForceBalance::new(m_c, m, g, 0.0024);
        // ½m_c·v² + ½m(2v)² = ½M·v², and lifting by dx does the work (m_c + 2m)·g·dx.
        let v = 0.3;
        let kinetic = 0.5 * m_c * v * v + 0.5 * m * (2.0 * v) * (2.0 * v);
        assert!((0.5 * balance.inertia * v * v - kinetic).abs() < 1e-12 * kinetic);
        assert!((balance.weight - (m_c * g + m * g * 2.0)).abs() < 1e-9);
    }

    #[test]
    fn at_the_equilibrium_pressure_nothing_pulls() {
        let balance = ForceBalance::new(283.0, 1320.0, 9.82, 0.0025);
        assert!(balance.net_force(balance.equilibrium_pressure(), 0.0).abs() < 1e-10 * balance.weight);
        assert!((balance.net_force(balance.equilibrium_pressure(), 50.0) + 50.0).abs() < 1e-10 * balance.weight);
    }
}
