//! Friction of cylinder and mast: LuGre with a load-dependent steady curve.

use crate::scalar::Scalar;

/// dz/dt = v − σ0·z·|v|/g_s(v), F = σ0·z + σ1·dz/dt + σ2·v,
/// g_s(v) = (F_pr + m·f_cfr)(1 + (K_brk − 1)·e^(−c_v|v|)) > 0
/// (Fri & Fahlén 2017, (3.4), (3.5), (3.34) without its sign; m is the moving mass with load).
///
/// Not passive where σ1·(K_brk − 1) exceeds σ2 by far: see Barabanov & Ortega (2000).
#[derive(Debug, Clone, Copy)]
pub struct LuGre<S> {
    coulomb: S,
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
        self.coulomb * (S::one() + self.breakaway_less_one * (self.minus_c_v * speed).exp())
    }

    /// The friction force [N], positive with positive `v`, and dz/dt [m/s]; `sigma_2` is the
    /// viscous coefficient that acts.
    #[inline(always)]
    pub fn force_and_rate(&self, v: S, z: S, sigma_2: S) -> (S, S) {
        let speed = v.abs();
        let dz = v - self.sigma_0 * z * speed / self.steady(speed);
        (self.sigma_0 * z + self.sigma_1 * dz + sigma_2 * v, dz)
    }
}
