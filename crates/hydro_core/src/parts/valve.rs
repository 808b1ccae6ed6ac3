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
        let along = |k: ValveState<S>, h: f64| {
            let h = S::constant(h);
            ValveState { i: x.i + h * k.i, rate: x.rate + h * k.rate, bristle: x.bristle + h * k.bristle }
        };
        let k1 = self.rates(x, u);
        let k2 = self.rates(along(k1, 0.5 * h), u);
        let k3 = self.rates(along(k2, 0.5 * h), u);
        let k4 = self.rates(along(k3, h), u);
        let sixth = S::constant(h / 6.0);
        let two = S::constant(2.0);
        let mean = |a: S, b: S, c: S, d: S| sixth * (a + two * (b + c) + d);
        ValveState {
            i: x.i + mean(k1.i, k2.i, k3.i, k4.i),
            rate: x.rate + mean(k1.rate, k2.rate, k3.rate, k4.rate),
            bristle: x.bristle + mean(k1.bristle, k2.bristle, k3.bristle, k4.bristle),
        }
    }
}
