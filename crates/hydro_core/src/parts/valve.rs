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
    fastest_rate: S,
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
            fastest_rate: omega
                * (S::constant(2.0) * damping + omega * (sigma_1 + sigma_1) + (S::one() + sigma_0).sqrt()),
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

    /// At rest under the command `u` [A], the bristle bent by the share `bend` of its most: 1 where the
    /// current rose last, −1 where it fell. Then i = u − bend·f_hs.
    pub fn settled(&self, u: S, bend: S) -> ValveState<S> {
        let bristle = bend / self.sigma_0_over_f_hs;
        ValveState { i: u - self.sigma_0 * bristle, rate: S::zero(), bristle }
    }

    /// No disturbance of the current decays or swings faster than this [1/s]: 2Dω + 2ω²σ1 + ω√(1 + σ0),
    /// where σ1 counts twice because a bristle that is bent against the motion doubles it. An explicit
    /// step must stay below 2.5 times its inverse.
    pub fn fastest_rate(&self) -> S {
        self.fastest_rate
    }

    /// The bristle after the current has moved by `travel` [A] without turning: dz/di = ±1 − σ0·z/f_hs
    /// in closed form, with 1/(1 + s + s²/2 + s³/6 + s⁴/24) for e^(−s).
    #[inline(always)]
    fn bend(&self, bristle: S, travel: S) -> S {
        let (second, third, fourth) = (S::constant(1.0 / 2.0), S::constant(1.0 / 6.0), S::constant(1.0 / 24.0));
        let s = self.sigma_0_over_f_hs * travel.abs();
        let mean = S::one() + s * (second + s * (third + s * fourth));
        bristle + mean * (travel - bristle * s) / (S::one() + s * mean)
    }

    /// Acceleration where the current has moved by `travel` from `x` and has the rate `rate`.
    #[inline(always)]
    fn after(&self, x: ValveState<S>, travel: S, rate: S, u: S) -> S {
        self.rates(ValveState { i: x.i + travel, rate, bristle: self.bend(x.bristle, travel) }, u).rate
    }

    /// One step of length `h` [s] with `u` held. The valve depends on the command alone, so it can
    /// run ahead of the oil.
    ///
    /// Current and rate take the classical fourth-order Runge–Kutta method (Kutta 1901). The bristle
    /// knows no time, only the way of the current, so it follows in closed form: however narrow the
    /// hysteresis, it asks for no shorter step. A way that turns is cut where it turns.
    #[inline(always)]
    pub fn step(&self, x: ValveState<S>, u: S, h: f64) -> ValveState<S> {
        let (whole, half, sixth) = (S::constant(h), S::constant(0.5 * h), S::constant(h / 6.0));
        let (v1, a1) = (x.rate, self.rates(x, u).rate);
        let v2 = x.rate + half * a1;
        let a2 = self.after(x, half * v1, v2, u);
        let v3 = x.rate + half * a2;
        let a3 = self.after(x, half * v2, v3, u);
        let v4 = x.rate + whole * a3;
        let a4 = self.after(x, whole * v3, v4, u);
        let two = S::constant(2.0);
        let travel = sixth * (v1 + two * (v2 + v3) + v4);
        let rate = x.rate + sixth * (a1 + two * (a2 + a3) + a4);
        // The rate falls to zero nearly straight before the current turns.
        let turns = (x.rate * rate).lt(S::zero());
        let brake = S::select(turns, x.rate - rate, S::one());
        let forth = S::select(turns, half * x.rate * x.rate / brake, travel);
        let bristle = self.bend(self.bend(x.bristle, forth), travel - forth);
        ValveState { i: x.i + travel, rate, bristle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: ValveState<f64> = ValveState { i: 0.0, rate: 0.0, bristle: 0.0 };
    const F_HS: f64 = 0.018723;

    /// The free lift's of Table 5.1.
    fn thesis() -> Valve<f64> {
        Valve::new(34.327, 1.0, F_HS, 0.5, 0.1)
    }

    fn run(
        valve: &Valve<f64>,
        mut x: ValveState<f64>,
        command: impl Fn(f64) -> f64,
        h: f64,
        steps: usize,
    ) -> ValveState<f64> {
        for k in 0..steps {
            x = valve.step(x, command(k as f64 * h), h);
        }
        x
    }

    #[test]
    fn halved_steps_show_order_four() {
        // During the first 40 ms of a step of the command the current only rises, so nothing kinks.
        let at = |steps: usize| run(&thesis(), REST, |_| 1.0, 0.04 / steps as f64, steps).i;
        let exact = at(4096);
        let errors = [32, 64, 128, 256].map(|steps| (at(steps) - exact).abs());
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 4.0).abs() < 0.3, "{order:.2}, {errors:?}");
        }
    }

    #[test]
    fn without_hysteresis_a_critically_damped_valve_answers_as_the_textbook_says() {
        // i = 1 − (1 + ωt)e^(−ωt).
        let valve = Valve::new(34.327, 1.0, F_HS, 0.0, 0.0);
        let wt: f64 = 34.327 * 0.05;
        let i = run(&valve, REST, |_| 1.0, 1e-4, 500).i;
        assert!((i - (1.0 - (1.0 + wt) * (-wt).exp())).abs() < 1e-9, "{i}");
    }

    #[test]
    fn swept_slowly_up_and_down_the_current_lags_by_the_hysteresis() {
        // 40 s up to 1 A and 40 s down again; at 0.5 A the bristle is fully bent both times.
        let sweep = |t: f64| if t < 40.0 { t / 40.0 } else { (80.0 - t) / 40.0 };
        let up = run(&thesis(), REST, sweep, 1e-3, 20_000);
        let down = run(&thesis(), up, |t| sweep(t + 20.0), 1e-3, 40_000);
        // 2D/ω and σ1 make it lag by another some milliseconds of the sweep.
        let lag = 0.025 * (2.0 / 34.327 + 0.1);
        assert!(((0.5 - up.i) - F_HS).abs() < lag, "{}", 0.5 - up.i);
        assert!(((down.i - 0.5) - F_HS).abs() < lag, "{}", down.i - 0.5);
    }

    #[test]
    fn settled_it_rests_beside_the_command_by_the_bent_share_of_the_hysteresis() {
        for bend in [-1.0, -0.3, 0.0, 1.0] {
            let x = thesis().settled(0.8, bend);
            assert!((0.8 - x.i - bend * F_HS).abs() < 1e-15);
            let rates = thesis().rates(x, 0.8);
            assert!(rates.i == 0.0 && rates.bristle == 0.0 && rates.rate.abs() < 1e-12, "{rates:?}");
        }
    }

    #[test]
    fn the_bristle_never_bends_beyond_the_hysteresis() {
        let valve = thesis();
        let mut x = REST;
        for k in 0..20_000 {
            let command = 0.7 + 0.7 * (k as f64 * 1e-3 * 7.0).sin();
            x = valve.step(x, command, 1e-3);
            assert!((0.5 * x.bristle).abs() <= F_HS * (1.0 + 1e-6), "{k}: {x:?}");
        }
    }

    #[test]
    fn steps_as_long_as_two_over_the_fastest_rate_stay_stable() {
        for (omega, damping, sigma_1) in [(34.327, 1.0, 0.1), (500.0, 0.1, 0.0), (100.0, 5.0, 1.0)] {
            let valve = Valve::new(omega, damping, 0.3, 0.1, sigma_1);
            let h = 2.0 / valve.fastest_rate();
            let x = run(&valve, REST, |_| 1.0, h, 20_000 + (20.0 / (omega * h)) as usize);
            assert!((x.i - 1.0).abs() < 0.31, "{omega} {damping} {sigma_1}: {x:?}");
        }
    }
}
