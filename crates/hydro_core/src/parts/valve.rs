//! Dynamics of the proportional valve: second order with hysteresis.

use crate::scalar::Scalar;

/// d²i/dt² = ω²(u − 2D/ω·di/dt − i − F_hs) with the hysteresis as a LuGre bristle,
/// dz/dt = di/dt − σ0·z·|di/dt|/f_hs, F_hs = σ0·z + σ1·dz/dt
/// (Fri & Fahlén 2017, (3.11)–(3.13); 2D/ω as in Figure A.4).
#[derive(Debug, Clone, Copy)]
pub struct Valve<S> {
    omega_squared: S,
    two_d_over_omega: S,
    sigma_0: S,
    sigma_1: S,
    sigma_0_over_f_hs: S,
}

/// The valve's effective current, its rate and the hysteresis bristle.
#[derive(Debug, Clone, Copy)]
pub struct ValveState<S> {
    /// i [A].
    pub i: S,
    /// di/dt [A/s].
    pub rate: S,
    /// z.
    pub bristle: S,
}

impl<S: Scalar> ValveState<S> {
    /// The state after moving along `rates` for `h` [s].
    #[inline(always)]
    fn along(self, rates: ValveState<S>, h: f64) -> Self {
        let h = S::constant(h);
        ValveState {
            i: self.i + h * rates.i,
            rate: self.rate + h * rates.rate,
            bristle: self.bristle + h * rates.bristle,
        }
    }
}

impl<S: Scalar> Valve<S> {
    pub fn new(omega: S, damping: S, f_hs: S, sigma_0: S, sigma_1: S) -> Self {
        Valve {
            omega_squared: omega * omega,
            two_d_over_omega: S::constant(2.0) * damping / omega,
            sigma_0,
            sigma_1,
            sigma_0_over_f_hs: sigma_0 / f_hs,
        }
    }

    /// Time derivatives of the three states under the command `u` [A].
    #[inline(always)]
    pub fn rates(&self, x: ValveState<S>, u: S) -> ValveState<S> {
        let dz = x.rate - self.sigma_0_over_f_hs * x.bristle * x.rate.abs();
        let hysteresis = self.sigma_0 * x.bristle + self.sigma_1 * dz;
        ValveState {
            i: x.rate,
            rate: self.omega_squared * (u - self.two_d_over_omega * x.rate - x.i - hysteresis),
            bristle: dz,
        }
    }

    /// Fastest rate [1/s] at which a disturbance of the current's rate decays, 2Dω + ω²σ1: an
    /// explicit step must stay well below 2.8 times its inverse.
    pub fn fastest_rate(&self) -> S {
        self.omega_squared * (self.two_d_over_omega + self.sigma_1)
    }

    /// One step of length `h` [s] of the classical fourth-order Runge–Kutta method (Kutta 1901)
    /// with `u` held. The valve depends on the command alone, so it can run ahead of the oil.
    #[inline(always)]
    pub fn step(&self, x: ValveState<S>, u: S, h: f64) -> ValveState<S> {
        let k1 = self.rates(x, u);
        let k2 = self.rates(x.along(k1, 0.5 * h), u);
        let k3 = self.rates(x.along(k2, 0.5 * h), u);
        let k4 = self.rates(x.along(k3, h), u);
        x.along(k1, h / 6.0).along(k2, h / 3.0).along(k3, h / 3.0).along(k4, h / 6.0)
    }
}
