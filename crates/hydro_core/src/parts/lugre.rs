//! Friction of cylinder and mast: LuGre with a load-dependent steady curve.

use crate::scalar::Scalar;

/// dz/dt = v − σ0·z·|v|/g_s(v), F = σ0·z + σ1·dz/dt + σ2·v,
/// g_s(v) = (F_pr + m·f_cfr)(1 + (K_brk − 1)·e^(−c_v|v|)) > 0
/// (Fri & Fahlén 2017, (3.4), (3.5), (3.34) without its sign; m is the moving mass with load).
///
/// Not passive where σ1·(K_brk − 1) exceeds σ2 by far: see Barabanov & Ortega (2000).
#[derive(Debug, Clone, Copy)]
pub struct LuGre<S> {
    /// F_pr + m·f_cfr [N].
    pub coulomb: S,
    breakaway_less_one: S,
    minus_c_v: S,
    sigma_0: S,
    sigma_1: S,
    pub sigma_2: S,
}

impl<S: Scalar> LuGre<S> {
    /// `coulomb` is F_pr + m·f_cfr [N]; it is held above 1 mN, since g_s divides.
    pub fn new(coulomb: S, k_brk: S, c_v: S, sigma_0: S, sigma_1: S, sigma_2: S) -> Self {
        LuGre {
            coulomb: coulomb.max(S::constant(1e-3)),
            breakaway_less_one: k_brk - S::one(),
            minus_c_v: -c_v,
            sigma_0,
            sigma_1,
            sigma_2,
        }
    }

    /// g_s(v) [N].
    #[inline(always)]
    pub fn steady(&self, speed: S) -> S {
        self.steady_at(self.coulomb, speed)
    }

    /// g_s(v) [N] where the Coulomb friction is `coulomb`.
    #[inline(always)]
    fn steady_at(&self, coulomb: S, speed: S) -> S {
        coulomb * (S::one() + self.breakaway_less_one * (self.minus_c_v * speed).exp())
    }

    /// The bristle [m] at which dz/dt is zero while sliding at `v`.
    #[inline(always)]
    pub fn settled_bristle(&self, v: S) -> S {
        let most = self.steady(v.abs()) / self.sigma_0;
        S::select(v.lt(S::zero()), -most, most)
    }

    /// The friction force [N], positive with positive `v`, and dz/dt [m/s]; `sigma_2` is the
    /// viscous coefficient that acts.
    #[inline(always)]
    pub fn force_and_rate(&self, v: S, z: S, sigma_2: S) -> (S, S) {
        self.force_and_rate_at(v, z, self.coulomb, sigma_2)
    }

    /// The same where the Coulomb friction is `coulomb` > 0 [N].
    #[inline(always)]
    pub fn force_and_rate_at(&self, v: S, z: S, coulomb: S, sigma_2: S) -> (S, S) {
        let speed = v.abs();
        let dz = v - self.sigma_0 * z * speed / self.steady_at(coulomb, speed);
        (self.sigma_0 * z + self.sigma_1 * dz + sigma_2 * v, dz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The free lift's of Table 5.1 with 500 kg.
    fn thesis() -> LuGre<f64> {
        LuGre::new(113.81 + 778.0 * 2.6445, 3.769, 261.2, 2517.2, 14342.0, 4137.8)
    }

    #[test]
    fn sliding_steadily_the_friction_is_the_stribeck_curve_and_the_viscous_share() {
        let friction = thesis();
        for v in [-0.5f64, -1e-3, 1e-4, 0.02, 0.6] {
            let z = friction.settled_bristle(v);
            let (force, rate) = friction.force_and_rate(v, z, friction.sigma_2);
            assert!(rate.abs() < 1e-15, "{v}: {rate}");
            assert!((force - (v.signum() * friction.steady(v.abs()) + 4137.8 * v)).abs() < 1e-9, "{v}");
        }
    }

    #[test]
    fn the_stribeck_curve_falls_from_breakaway_to_coulomb_friction() {
        let friction = thesis();
        let coulomb = 113.81 + 778.0 * 2.6445;
        assert!((friction.steady(0.0) - 3.769 * coulomb).abs() < 1e-9);
        assert!((friction.steady(1.0) - coulomb).abs() < 1e-9);
        assert!((1..100).all(|k| friction.steady(f64::from(k) * 1e-3) < friction.steady(f64::from(k - 1) * 1e-3)));
    }

    #[test]
    fn at_rest_the_bristles_are_a_spring() {
        assert_eq!(thesis().force_and_rate(0.0, 1e-3, 4137.8), (2517.2 * 1e-3, 0.0));
    }

    #[test]
    fn without_any_friction_the_curve_still_divides() {
        let (force, rate) = LuGre::new(0.0, 1.0, 100.0, 1e4, 0.0, 0.0).force_and_rate(0.1, 0.0, 0.0);
        assert_eq!((force, rate), (0.0, 0.1));
    }

    proptest! {
        #[test]
        fn a_bristle_never_bends_beyond_breakaway(v in -2.0..2.0f64, up in any::<bool>(), more in 0.0..2.0f64) {
            // At |σ0·z| = F_s and beyond, z moves back or stays.
            let friction = thesis();
            let z = friction.steady(0.0) / 2517.2 * (1.0 + more) * if up { 1.0 } else { -1.0 };
            let (_, rate) = friction.force_and_rate(v, z, friction.sigma_2);
            prop_assert!(rate * z <= 1e-15);
        }
    }
}
