//! The mast as the adaptive integrator sees it.

use crate::dual::Dual;
use crate::mast::{Mast, Physics, Resting, POSITION, STATES, VELOCITY};
use crate::scalar::Scalar;
use crate::solver::radau::System;

/// Derivatives are taken along a few states at once; nine is one lift.
pub(super) type Columns = Dual<f64, STATES>;

/// The mast as the adaptive integrator sees it: rates in `f64`, Jacobians through dual numbers.
pub(super) struct Differentiable<X, Y, const L: usize> {
    plain: Mast<f64, X, L>,
    dual: Mast<Columns, Y, L>,
    /// Whether a lift rests at an end of its stroke.
    held: [Held; L],
    scale: Vec<f64>,
    names: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    Free,
    Lower,
    Upper,
}

/// An acceleration away from a stop [m/s²] that releases a lift is compared with a depth [m] times this.
const RELEASE_PER_DEPTH: f64 = 1e4;

impl<X: Physics<f64>, Y: Physics<Columns>, const L: usize> Differentiable<X, Y, L> {
    /// `plain` and `dual` are the same mast over two scalars.
    pub fn new(plain: Mast<f64, X, L>, dual: Mast<Columns, Y, L>, scale: Vec<f64>, names: Vec<String>) -> Self {
        Differentiable { plain, dual, held: [Held::Free; L], scale, names }
    }

    pub fn names(&self) -> &[String] {
        &self.names
    }

    pub fn set_inputs(&mut self, command: [f64; L], oil_temperature_degc: f64) {
        self.plain.set_inputs(command, oil_temperature_degc);
        self.dual.set_inputs(command.map(Columns::constant), Columns::constant(oil_temperature_degc));
    }
}

impl<X: Physics<f64>, Y: Physics<Columns>, const L: usize> System for Differentiable<X, Y, L> {
    fn dim(&self) -> usize {
        self.plain.dim()
    }
    fn rates(&self, _t: f64, x: &[f64], dx: &mut [f64]) {
        self.plain.rates_resting(x, dx, &self.resting());
        for k in (0..L).filter(|&k| self.held[k] != Held::Free) {
            dx[k * STATES + POSITION] = 0.0;
            dx[k * STATES + VELOCITY] = 0.0;
        }
    }
    fn jacobian(&self, _t: f64, x: &[f64], jacobian: &mut [f64]) {
        let resting = self.resting();
        jacobian_by_duals::<STATES>(x, jacobian, |x, dx| self.dual.rates_resting(x, dx, &resting));
        let n = x.len();
        for k in (0..L).filter(|&k| self.held[k] != Held::Free) {
            for row in [POSITION, VELOCITY] {
                jacobian[(k * STATES + row) * n..(k * STATES + row + 1) * n].fill(0.0);
            }
        }
    }
    fn scale(&self) -> &[f64] {
        &self.scale
    }
    fn state_name(&self, k: usize) -> String {
        self.names[k].clone()
    }
    fn frozen(&self, k: usize) -> bool {
        let (lift, state) = (k / STATES, k % STATES);
        lift < L && self.held[lift] != Held::Free && (state == POSITION || state == VELOCITY)
    }
    fn past_event(&self, x: &[f64]) -> f64 {
        let mut past = 0.0f64;
        for k in 0..L {
            let (stop, position) = (&self.plain.lifts[k].stop, x[k * STATES + POSITION]);
            past = past.max(match self.held[k] {
                Held::Free => (stop.lower - position).max(position - stop.upper),
                Held::Lower => self.acceleration(x, k) / RELEASE_PER_DEPTH,
                Held::Upper => -self.acceleration(x, k) / RELEASE_PER_DEPTH,
            });
        }
        past
    }
    /// A lift that meets a stop loses its velocity, and stays there while it is pressed onto it.
    fn switch(&mut self, x: &mut [f64]) {
        for k in 0..L {
            let stop = self.plain.lifts[k].stop;
            let at = k * STATES;
            let end = match (x[at + POSITION] <= stop.lower, x[at + POSITION] >= stop.upper) {
                (true, _) => Held::Lower,
                (_, true) => Held::Upper,
                _ => continue,
            };
            if self.held[k] == Held::Free {
                (x[at + POSITION], x[at + VELOCITY]) = stop.limit(x[at + POSITION], x[at + VELOCITY]);
            }
            let acceleration = self.acceleration(x, k);
            let pressed = if end == Held::Lower { acceleration <= 0.0 } else { acceleration >= 0.0 };
            let moves = x[at + VELOCITY] != 0.0;
            self.held[k] = if pressed && !moves { end } else { Held::Free };
        }
    }
}

impl<X: Physics<f64>, Y: Physics<Columns>, const L: usize> Differentiable<X, Y, L> {
    fn resting<S: Scalar<Mask = bool>>(&self) -> Resting<S, L> {
        Resting::Held(self.held.map(|held| held != Held::Free))
    }

    /// The acceleration lift `k` would have without its stop [m/s²], the other as it is held.
    fn acceleration(&self, x: &[f64], k: usize) -> f64 {
        let mut dx = vec![0.0; x.len()];
        let others = std::array::from_fn(|other| other != k && self.held[other] != Held::Free);
        self.plain.rates_resting(x, &mut dx, &Resting::Held(others));
        dx[k * STATES + VELOCITY]
    }
}

/// The Jacobian of `rates`, row by row, P columns at a time.
pub fn jacobian_by_duals<const P: usize>(
    x: &[f64],
    jacobian: &mut [f64],
    rates: impl Fn(&[Dual<f64, P>], &mut [Dual<f64, P>]),
) {
    let n = x.len();
    let mut point: Vec<Dual<f64, P>> = x.iter().map(|&x| Dual::constant(x)).collect();
    let mut dx = point.clone();
    for first in (0..n).step_by(P) {
        let columns = P.min(n - first);
        for k in 0..columns {
            point[first + k] = Dual::variable(x[first + k], k);
        }
        rates(&point, &mut dx);
        for (row, d) in dx.iter().enumerate() {
            jacobian[row * n + first..row * n + first + columns].copy_from_slice(&d.eps[..columns]);
        }
        for k in 0..columns {
            point[first + k] = Dual::constant(x[first + k]);
        }
    }
}
