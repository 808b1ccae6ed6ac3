//! Radau IIA of order 5: implicit, L-stable, with error control and dense output.
//!
//! Hairer & Wanner, *Solving Ordinary Differential Equations II* (2nd ed., 1996), sections IV.5
//! (method), IV.8 (simplified Newton on the transformed stages, error estimate, step control).

use num_complex::Complex64;

use super::linear::Lu;
use super::statistics::Statistics;
use crate::error::Error;

/// What is integrated: dx/dt = f(t, x), with its exact Jacobian.
pub trait System {
    fn dim(&self) -> usize;
    fn rates(&self, t: f64, x: &[f64], dx: &mut [f64]);
    /// ∂f/∂x, row by row.
    fn jacobian(&self, t: f64, x: &[f64], jacobian: &mut [f64]);
    /// Typical size of each state: the absolute tolerance is the tolerance times this.
    fn scale(&self) -> &[f64];
    /// What an error calls the state.
    fn state_name(&self, k: usize) -> String {
        format!("state {k}")
    }
    /// Above zero where the motion has gone past the point at which its kind changes (a stroke's
    /// end reached, or left). The integrator finds that point before it goes on.
    fn past_event(&self, _x: &[f64]) -> f64 {
        0.0
    }
    /// Changes the kind of motion at that point.
    fn switch(&mut self, _x: &mut [f64]) {}
    /// True if the state stands still until the next event: not even rounding may move it.
    fn frozen(&self, _k: usize) -> bool {
        false
    }
}

/// One accepted step, with the collocation polynomial as its dense output.
#[derive(Debug)]
pub struct Step<'a> {
    pub from: f64,
    pub to: f64,
    start: &'a [f64],
    end: &'a [f64],
    /// Coefficients of θ, θ², θ³ for each state.
    polynomial: &'a [[f64; 3]],
}

impl Step<'_> {
    /// The states at `t` within the step, third order between its ends and exact at them.
    pub fn at(&self, t: f64, x: &mut [f64]) {
        if t >= self.to {
            x.copy_from_slice(self.end);
            return;
        }
        let theta = (t - self.from) / (self.to - self.from);
        evaluate(self.start, self.polynomial, theta, x);
    }
}

fn evaluate(start: &[f64], polynomial: &[[f64; 3]], theta: f64, x: &mut [f64]) {
    for ((x, &x0), q) in x.iter_mut().zip(start).zip(polynomial) {
        *x = x0 + theta * (q[0] + theta * (q[1] + theta * q[2]));
    }
}

/// The method's numbers, (IV.5.9) and (IV.8.5) ff.
mod tableau {
    pub const SQRT6: f64 = 2.449_489_742_783_178;
    pub const C: [f64; 3] = [(4.0 - SQRT6) / 10.0, (4.0 + SQRT6) / 10.0, 1.0];
    /// Error estimate.
    pub const E: [f64; 3] = [(-13.0 - 7.0 * SQRT6) / 3.0, (-13.0 + 7.0 * SQRT6) / 3.0, -1.0 / 3.0];
    /// Eigenvalues of the inverse of the Runge–Kutta matrix.
    pub const MU_REAL: f64 = 3.637_834_252_744_496;
    pub const MU_COMPLEX: (f64, f64) = (2.681_082_873_627_752_3, -3.050_430_199_247_410_5);
    pub const T: [[f64; 3]; 3] = [
        [0.094_438_762_488_975_24, -0.141_255_295_020_954_21, 0.030_029_194_105_147_42],
        [0.250_213_122_965_333_32, 0.204_129_352_293_799_94, -0.382_942_112_757_261_92],
        [1.0, 1.0, 0.0],
    ];
    pub const TI: [[f64; 3]; 3] = [
        [4.178_718_591_551_904_28, 0.327_682_820_761_062_37, 0.523_376_445_499_449_51],
        [-4.178_718_591_551_904_28, -0.327_682_820_761_062_37, 0.476_623_554_500_550_44],
        [0.502_872_634_945_786_82, -2.571_926_949_855_605_22, 0.596_039_204_828_224_92],
    ];
    /// From stage values to the coefficients of θ, θ², θ³.
    pub const P: [[f64; 3]; 3] = [
        [13.0 / 3.0 + 7.0 * SQRT6 / 3.0, -23.0 / 3.0 - 22.0 * SQRT6 / 3.0, 10.0 / 3.0 + 5.0 * SQRT6],
        [13.0 / 3.0 - 7.0 * SQRT6 / 3.0, -23.0 / 3.0 + 22.0 * SQRT6 / 3.0, 10.0 / 3.0 - 5.0 * SQRT6],
        [1.0 / 3.0, -8.0 / 3.0, 10.0 / 3.0],
    ];
}
use tableau::{C, E, MU_COMPLEX, MU_REAL, P, T, TI};

const NEWTON_LIMIT: usize = 7;
/// A step may shrink or grow by these factors at once.
const LEAST_FACTOR: f64 = 0.2;
const MOST_FACTOR: f64 = 8.0;
/// An event counts as met if [`System::past_event`] lies between zero and this.
const EVENT_DEPTH: f64 = 1e-10;

/// The integrator between two calls: where it stands and what it remembers.
pub struct Radau {
    pub t: f64,
    pub x: Vec<f64>,
    pub statistics: Statistics,
    tolerance: f64,
    step_limit: usize,
    h: f64,
    longest: f64,
    f: Vec<f64>,
    jacobian: Vec<f64>,
    jacobian_is_current: bool,
    /// An attempt at the present step has failed; the next is no longer than this one.
    retried: bool,
    /// The factors, and the step they were made for.
    factors: Option<(f64, Lu<f64>, Lu<Complex64>)>,
    polynomial: Vec<[f64; 3]>,
    /// Length of the step the polynomial belongs to; none before the first.
    polynomial_step: Option<f64>,
    previous: Option<(f64, f64)>,
    work: Work,
}

/// Storage of one step.
struct Work {
    start: Vec<f64>,
    x_new: Vec<f64>,
    stage: Vec<f64>,
    z: [Vec<f64>; 3],
    w: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
    error: Vec<f64>,
    d_real: Vec<f64>,
    d_complex: Vec<Complex64>,
    weight: Vec<f64>,
}

enum Attempt {
    Accepted,
    Retry,
}

/// Root mean square of `x` in units of `weight`.
fn norm(x: &[f64], weight: &[f64]) -> f64 {
    (x.iter().zip(weight).map(|(x, w)| (x / w) * (x / w)).sum::<f64>() / x.len() as f64).sqrt()
}

impl Radau {
    /// Starts at `t` in `x`. The relative tolerance is `tolerance`, the absolute one `tolerance`
    /// times each state's scale.
    pub fn new<M: System>(system: &M, t: f64, x: &[f64], tolerance: f64, step_limit: usize) -> Self {
        let n = system.dim();
        let zeros = || [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let mut radau = Radau {
            t,
            x: x.to_vec(),
            statistics: Statistics::default(),
            tolerance,
            step_limit,
            h: 0.0,
            longest: f64::INFINITY,
            f: vec![0.0; n],
            jacobian: vec![0.0; n * n],
            jacobian_is_current: false,
            retried: false,
            factors: None,
            polynomial: vec![[0.0; 3]; n],
            polynomial_step: None,
            previous: None,
            work: Work {
                start: vec![0.0; n],
                x_new: vec![0.0; n],
                stage: vec![0.0; n],
                z: zeros(),
                w: zeros(),
                f: zeros(),
                error: vec![0.0; n],
                d_real: vec![0.0; n],
                d_complex: vec![Complex64::new(0.0, 0.0); n],
                weight: vec![0.0; n],
            },
        };
        radau.inputs_changed(system);
        radau.h = radau.first_step(system);
        radau
    }

    /// The next step is tried with length `h`, and none is longer: where the error allows it, all are equal.
    pub fn set_longest_step(&mut self, h: f64) {
        self.longest = h;
        self.h = h;
    }

    /// To be called when the right-hand side has jumped at the present time.
    pub fn inputs_changed<M: System>(&mut self, system: &M) {
        system.rates(self.t, &self.x, &mut self.f);
        self.statistics.rates += 1;
        self.previous = None;
        self.polynomial_step = None;
    }

    /// The step over which the solution moves by a hundredth of its size (Hairer, Nørsett & Wanner I, II.4).
    fn first_step<M: System>(&mut self, system: &M) -> f64 {
        self.set_weights(system);
        let (d0, d1) = (norm(&self.x, &self.work.weight), norm(&self.f, &self.work.weight));
        if d0 < 1e-5 || d1 < 1e-5 {
            1e-6
        } else {
            0.01 * d0 / d1
        }
    }

    fn set_weights<M: System>(&mut self, system: &M) {
        for ((w, x), s) in self.work.weight.iter_mut().zip(&self.x).zip(system.scale()) {
            *w = self.tolerance * (s + x.abs());
        }
    }

    /// Integrates until `end`, showing each accepted step to `watch`.
    ///
    /// # Errors
    /// [`Error::StepTooSmall`], [`Error::TooManySteps`], [`Error::NotFinite`] where the rates are not, or what `watch`
    /// returns.
    pub fn advance<M: System>(
        &mut self,
        system: &mut M,
        end: f64,
        mut watch: impl FnMut(&Step) -> Result<(), Error>,
    ) -> Result<(), Error> {
        while self.t < end {
            let remaining = end - self.t;
            let wanted = self.h;
            // Equal steps to the end leave no sliver, and keep their factors from tick to tick.
            let pieces = (remaining / self.h * (1.0 - 1e-6)).ceil();
            if pieces <= 8.0 {
                self.h = if pieces <= 1.0 { remaining } else { remaining / pieces };
            }
            if let Some(k) = self.f.iter().position(|rate| !rate.is_finite()) {
                return Err(Error::NotFinite { time_s: self.t, worst_state: system.state_name(k) });
            }
            let long_enough = self.h >= 1e-14 * self.t.abs().max(1e-3);
            if !long_enough {
                return Err(self.step_too_small(system));
            }
            if self.statistics.steps >= self.step_limit {
                return Err(Error::TooManySteps { time_s: self.t, limit: self.step_limit, tolerance: self.tolerance });
            }
            let tried = self.h;
            if let Attempt::Accepted = self.attempt(system) {
                let from = self.t;
                self.t = if tried == remaining { end } else { from + tried };
                let w = &self.work;
                watch(&Step { from, to: self.t, start: &w.start, end: &self.x, polynomial: &self.polynomial })?;
                if self.h >= tried {
                    // A step that was cut short says nothing against the longer one.
                    self.h = self.h.max(wanted);
                }
            }
        }
        Ok(())
    }

    fn step_too_small<M: System>(&self, system: &M) -> Error {
        let worst = (0..self.x.len())
            .max_by(|&a, &b| {
                let share = |k: usize| (self.work.error[k] / self.work.weight[k]).abs();
                share(a).total_cmp(&share(b))
            })
            .unwrap_or(0);
        Error::StepTooSmall {
            time_s: self.t,
            step_s: self.h,
            worst_state: system.state_name(worst),
            tolerance: self.tolerance,
        }
    }

    /// One attempt at a step of length `self.h`; sets the length of the next.
    fn attempt<M: System>(&mut self, system: &mut M) -> Attempt {
        self.set_weights(system);
        let h = self.h;
        if self.factors.as_ref().is_none_or(|(made_for, ..)| *made_for != h) && !self.factor(system) {
            self.h *= 0.5;
            return Attempt::Retry;
        }
        let Some((iterations, rate)) = self.newton(system) else {
            self.statistics.rejected_by_newton += 1;
            // Carried on over a longer step the polynomial may have been a bad start.
            self.polynomial_step = None;
            if self.jacobian_is_current {
                self.retried = true;
                self.h *= 0.5;
            } else {
                self.factors = None;
            }
            return Attempt::Retry;
        };
        let error = self.estimate_error(system);
        let safety = 0.9 * (2 * NEWTON_LIMIT + 1) as f64 / (2 * NEWTON_LIMIT + iterations) as f64;
        if error > 1.0 {
            self.statistics.rejected_by_error += 1;
            self.retried = true;
            self.h *= (safety * self.factor_for(h, error)).max(LEAST_FACTOR);
            return Attempt::Retry;
        }
        if let Some(shorter) = self.cut_at_event(system) {
            self.h = shorter;
            return Attempt::Retry;
        }
        self.accept(system, error, iterations, rate, safety);
        Attempt::Accepted
    }

    fn factor<M: System>(&mut self, system: &M) -> bool {
        let n = self.x.len();
        if self.factors.is_none() && !self.jacobian_is_current {
            system.jacobian(self.t, &self.x, &mut self.jacobian);
            self.statistics.jacobians += 1;
            self.jacobian_is_current = true;
        }
        let (real, complex) = (MU_REAL / self.h, Complex64::new(MU_COMPLEX.0, MU_COMPLEX.1) / self.h);
        let mut a: Vec<f64> = self.jacobian.iter().map(|j| -j).collect();
        let mut b: Vec<Complex64> = self.jacobian.iter().map(|&j| Complex64::new(-j, 0.0)).collect();
        for k in 0..n {
            a[k * n + k] += real;
            b[k * n + k] += complex;
        }
        self.statistics.factorisations += 1;
        self.factors = Lu::factor(a, n).zip(Lu::factor(b, n)).map(|(a, b)| (self.h, a, b));
        self.factors.is_some()
    }

    /// Simplified Newton on the transformed stages: iterations taken and last rate, or None.
    fn newton<M: System>(&mut self, system: &M) -> Option<(usize, f64)> {
        let (n, h, t) = (self.x.len(), self.h, self.t);
        let (_, real, complex) = self.factors.as_ref()?;
        let (mu_real, mu_complex) = (MU_REAL / h, Complex64::new(MU_COMPLEX.0, MU_COMPLEX.1) / h);
        let tolerance = (10.0 * f64::EPSILON / self.tolerance).max(0.03f64.min(self.tolerance.sqrt()));
        let w = &mut self.work;
        // Start from the last step's polynomial, carried on.
        for i in 0..3 {
            match self.polynomial_step {
                None => w.z[i].fill(0.0),
                Some(last) => {
                    let theta = 1.0 + C[i] * h / last;
                    evaluate(&w.start, &self.polynomial, theta, &mut w.stage);
                    for k in 0..n {
                        w.z[i][k] = w.stage[k] - self.x[k];
                    }
                }
            }
        }
        for i in 0..3 {
            for k in 0..n {
                w.w[i][k] = TI[i][0] * w.z[0][k] + TI[i][1] * w.z[1][k] + TI[i][2] * w.z[2][k];
            }
        }
        let mut last_size: Option<f64> = None;
        let mut rate = 0.0;
        for iteration in 1..=NEWTON_LIMIT {
            for i in 0..3 {
                for k in 0..n {
                    w.stage[k] = self.x[k] + w.z[i][k];
                }
                system.rates(t + C[i] * h, &w.stage, &mut w.f[i]);
            }
            self.statistics.rates += 3;
            self.statistics.newton_iterations += 1;
            for k in 0..n {
                let f = [w.f[0][k], w.f[1][k], w.f[2][k]];
                let along = |row: &[f64; 3]| row[0] * f[0] + row[1] * f[1] + row[2] * f[2];
                w.d_real[k] = along(&TI[0]) - mu_real * w.w[0][k];
                w.d_complex[k] =
                    Complex64::new(along(&TI[1]), along(&TI[2])) - mu_complex * Complex64::new(w.w[1][k], w.w[2][k]);
            }
            if w.d_real.iter().any(|d| !d.is_finite()) {
                return None;
            }
            real.solve(&mut w.d_real);
            complex.solve(&mut w.d_complex);
            let mut sum = 0.0;
            for k in 0..n {
                if system.frozen(k) {
                    w.d_real[k] = 0.0;
                    w.d_complex[k] = Complex64::new(0.0, 0.0);
                }
                let weight = w.weight[k];
                let (a, b) = (w.d_real[k] / weight, w.d_complex[k] / weight);
                sum += a * a + b.norm_sqr();
            }
            let size = (sum / (3 * n) as f64).sqrt();
            if let Some(last) = last_size {
                rate = size / last;
                let left_to_come = (iteration..NEWTON_LIMIT).fold(1.0, |power, _| power * rate);
                if rate >= 1.0 || left_to_come / (1.0 - rate) * size > tolerance {
                    return None;
                }
            }
            for k in 0..n {
                w.w[0][k] += w.d_real[k];
                w.w[1][k] += w.d_complex[k].re;
                w.w[2][k] += w.d_complex[k].im;
                for i in 0..3 {
                    w.z[i][k] = T[i][0] * w.w[0][k] + T[i][1] * w.w[1][k] + T[i][2] * w.w[2][k];
                }
            }
            if size == 0.0 || (last_size.is_some() && rate / (1.0 - rate) * size < tolerance) {
                for k in 0..n {
                    w.x_new[k] = self.x[k] + w.z[2][k];
                }
                return Some((iteration, rate));
            }
            last_size = Some(size);
        }
        None
    }

    /// Size of the error in units of the tolerance, (IV.8.19) and (IV.8.20).
    fn estimate_error<M: System>(&mut self, system: &M) -> f64 {
        let (n, h) = (self.x.len(), self.h);
        let Some((_, real, _)) = self.factors.as_ref() else { return f64::INFINITY };
        let w = &mut self.work;
        let embedded = |z: &[Vec<f64>; 3], k: usize| (E[0] * z[0][k] + E[1] * z[1][k] + E[2] * z[2][k]) / h;
        for k in 0..n {
            w.error[k] = self.f[k] + embedded(&w.z, k);
        }
        real.solve(&mut w.error);
        for k in 0..n {
            w.weight[k] = w.weight[k].max(self.tolerance * (system.scale()[k] + w.x_new[k].abs()));
        }
        let mut size = norm(&w.error, &w.weight);
        if size > 1.0 {
            for k in 0..n {
                w.stage[k] = self.x[k] + w.error[k];
            }
            system.rates(self.t, &w.stage, &mut w.f[0]);
            self.statistics.rates += 1;
            for k in 0..n {
                w.error[k] = w.f[0][k] + embedded(&w.z, k);
            }
            real.solve(&mut w.error);
            size = norm(&w.error, &w.weight);
        }
        if size.is_finite() {
            size
        } else {
            f64::INFINITY
        }
    }

    /// Gustafsson's predictive control, (IV.8.25).
    fn factor_for(&self, h: f64, error: f64) -> f64 {
        if error == 0.0 {
            return MOST_FACTOR;
        }
        // Square roots round alike on every machine, powers do not.
        let fourth_root = |x: f64| x.sqrt().sqrt();
        let plain = 1.0 / fourth_root(error);
        match self.previous {
            Some((last_h, last_error)) if last_error > 0.0 => {
                plain.min(h / last_h * fourth_root(last_error / error) * plain)
            }
            _ => plain,
        }
    }

    /// If the step went past an event, the length of the step that just meets it.
    fn cut_at_event<M: System>(&mut self, system: &M) -> Option<f64> {
        if system.past_event(&self.work.x_new) <= EVENT_DEPTH {
            return None;
        }
        self.set_polynomial();
        let (mut before, mut after) = (0.0, 1.0);
        let w = &mut self.work;
        for _ in 0..60 {
            let middle = 0.5 * (before + after);
            evaluate(&self.x, &self.polynomial, middle, &mut w.stage);
            if system.past_event(&w.stage) > 0.5 * EVENT_DEPTH {
                after = middle;
            } else {
                before = middle;
            }
        }
        self.polynomial_step = None;
        // The shorter step lies a little elsewhere; halving once in a while makes sure that it ends.
        Some(self.h * if after < 1.0 - 1e-9 { after } else { 0.5 })
    }

    fn set_polynomial(&mut self) {
        let w = &self.work;
        for (k, q) in self.polynomial.iter_mut().enumerate() {
            for (j, q) in q.iter_mut().enumerate() {
                *q = w.z[0][k] * P[0][j] + w.z[1][k] * P[1][j] + w.z[2][k] * P[2][j];
            }
        }
    }

    fn accept<M: System>(&mut self, system: &mut M, error: f64, iterations: usize, rate: f64, safety: f64) {
        self.set_polynomial();
        let h = self.h;
        let most = if self.retried { 1.0 } else { MOST_FACTOR };
        self.retried = false;
        let mut factor = (safety * self.factor_for(h, error)).clamp(LEAST_FACTOR, most);
        let w = &mut self.work;
        w.start.copy_from_slice(&self.x);
        self.x.copy_from_slice(&w.x_new);
        self.polynomial_step = Some(h);
        self.previous = Some((h, error.max(1e-2)));
        self.statistics.steps += 1;
        let event = system.past_event(&self.x) > 0.0;
        if event {
            system.switch(&mut self.x);
            self.statistics.events += 1;
            self.polynomial_step = None;
            self.previous = None;
        }
        system.rates(self.t + h, &self.x, &mut self.f);
        self.statistics.rates += 1;
        self.jacobian_is_current = false;
        // Slow convergence asks for a new Jacobian; else small changes of the step keep the factors.
        if (iterations > 2 && rate > 1e-3) || event {
            self.factors = None;
        } else if (1.0..1.2).contains(&factor) {
            factor = 1.0;
        }
        self.h = (h * factor).min(self.longest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transformation_inverts_the_collocation_matrix_of_the_nodes() {
        // Aᵀ⁻¹ = TΛT⁻¹ maps (cⱼᵏ/k) to (cⱼᵏ⁻¹): the collocation conditions (IV.5.6) for k = 1, 2, 3.
        for k in 1..=3 {
            let integral = C.map(|c| c.powi(k) / f64::from(k));
            let along = |row: [f64; 3]| row[0] * integral[0] + row[1] * integral[1] + row[2] * integral[2];
            let pair = Complex64::new(MU_COMPLEX.0, MU_COMPLEX.1) * Complex64::new(along(TI[1]), along(TI[2]));
            let scaled = [MU_REAL * along(TI[0]), pair.re, pair.im];
            for i in 0..3 {
                let back: f64 = (0..3).map(|j| T[i][j] * scaled[j]).sum();
                assert!((back - C[i].powi(k - 1)).abs() < 1e-13, "{k} {i} {back}");
            }
        }
    }

    #[test]
    fn the_dense_output_meets_the_stages() {
        for i in 0..3 {
            for (j, row) in P.iter().enumerate() {
                let value = C[i] * (row[0] + C[i] * (row[1] + C[i] * row[2]));
                assert!((value - f64::from(u8::from(i == j))).abs() < 1e-13, "{i} {j} {value}");
            }
        }
    }

    #[test]
    fn the_error_estimate_sees_nothing_of_a_cubic() {
        for k in 1..=3 {
            let start_rate = f64::from(u8::from(k == 1));
            let estimate: f64 = start_rate + (0..3).map(|i| E[i] * C[i].powi(k)).sum::<f64>();
            assert!(estimate.abs() < 1e-13, "{k} {estimate}");
        }
        let quartic: f64 = (0..3).map(|i| E[i] * C[i].powi(4)).sum();
        assert!(quartic.abs() > 1e-3);
    }
}
