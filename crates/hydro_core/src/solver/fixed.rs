//! The fast path: fixed substeps, for ensembles, estimation and closed loops.
//!
//! One evaluation of the physics per substep, over any scalar. What is stiff is solved, what is not
//! is predicted and corrected:
//!
//! 1. Velocity and friction bristle are predicted (Adams–Bashforth 3), the position follows
//!    (Adams–Moulton 4). Ports are read there, at the extrapolated cylinder pressure.
//! 2. The valve depends on its command alone and runs ahead, one linearly implicit step a substep
//!    unless its fastest rate asks for more ([`valve_steps`]); its bristle is in closed form, and a
//!    step in which the current turns is cut there.
//! 3. Given those and the opening, the pressures and the compensator are one scalar equation in
//!    D = p_A − p_B: p_A by Adams–Moulton 4, p_B by BDF2, the compensator's opening by BDF3, explicit
//!    in D with its exact ends. It falls strictly with D. Newton's method takes D and p_B together
//!    from where the past extrapolates them to, so that nothing in it waits for the motion of this
//!    substep; where one small step does not settle it, a search within a bracket does, so the kinks
//!    of the compensator cost nothing.
//! 4. Velocity and bristle are corrected (Adams–Moulton 4) with the rates at the prediction, which
//!    also serve as the next substep's history.
//!
//! Predict–evaluate–correct and IMEX multistep methods: Hairer, Nørsett & Wanner I (1993), III.1;
//! Ascher, Ruuth & Wetton (1995). After a reset the order builds up from one; a run starts at rest,
//! where that costs nothing. A lane that has converged is frozen by mask, so its bits do not depend
//! on its neighbours. A closure within the physics must not be large: one that is not inlined is
//! compiled without the vectors of [`super::vectors`].

use crate::mast::{Lift, LiftState, Mast, Physics, STATES};
use crate::parts::orifice::Orifice;
use crate::parts::valve::{ValveState, ValveStep};
use crate::ports::Ports;
use crate::scalar::{Mask, Scalar};

/// Newton iterations after which a lane is given up; bisection alone would need some 50.
const NEWTON_LIMIT: usize = 60;
/// Relative size of the Newton step that counts as converged: what is left is of the order of its
/// square. The derivatives are those at the root, and do not take part in what is left.
const CONVERGED: f64 = 2e-3;
/// How many times as much p_B may move, which enters as its root.
const LOOSER_FOR_P_B: f64 = 5.0;
/// Newton steps in the drop and p_B together before a lane is searched for.
const NEAR_LIMIT: usize = 2;
/// Pressure drops below this [Pa] count as this large when convergence is judged.
const LEAST_DROP: f64 = 1e2;

/// Past values, the newest first.
type Past<S, const N: usize> = [S; N];

#[derive(Debug, Clone, Copy)]
struct History<S> {
    v: Past<S, 3>,
    v_rate: Past<S, 3>,
    z_rate: Past<S, 3>,
    p_a: Past<S, 2>,
    p_a_rate: Past<S, 3>,
    p_b: Past<S, 2>,
    a_comp: Past<S, 3>,
    drop: Past<S, 2>,
}

#[inline(always)]
fn push<S: Copy, const N: usize>(past: &mut Past<S, N>, newest: S) {
    for k in (1..N).rev() {
        past[k] = past[k - 1];
    }
    past[0] = newest;
}

/// Weights of a method of growing order: a row for each of the first substeps, the last for all later ones.
struct Weights {
    /// Adams–Bashforth, of past rates.
    predict: [f64; 3],
    /// Adams–Moulton, of the new rate and past ones.
    correct: [f64; 4],
    /// The same for p_A.
    pressure: [f64; 4],
    /// Adams–Bashforth for the p_A from which the iteration starts.
    ahead: [f64; 3],
    /// BDF for p_B, of past values and of the new rate.
    volume: [f64; 2],
    volume_rate: f64,
    /// BDF for the compensator's opening.
    opening: [f64; 3],
    opening_rate: f64,
}

const WEIGHTS: [Weights; 4] = [
    Weights {
        predict: [1.0, 0.0, 0.0],
        correct: [1.0 / 2.0, 1.0 / 2.0, 0.0, 0.0],
        pressure: [1.0, 0.0, 0.0, 0.0],
        ahead: [1.0, 0.0, 0.0],
        volume: [1.0, 0.0],
        volume_rate: 1.0,
        opening: [1.0, 0.0, 0.0],
        opening_rate: 1.0,
    },
    Weights {
        predict: [3.0 / 2.0, -1.0 / 2.0, 0.0],
        correct: [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0, 0.0],
        pressure: [1.0 / 2.0, 1.0 / 2.0, 0.0, 0.0],
        ahead: [3.0 / 2.0, -1.0 / 2.0, 0.0],
        volume: [4.0 / 3.0, -1.0 / 3.0],
        volume_rate: 2.0 / 3.0,
        opening: [4.0 / 3.0, -1.0 / 3.0, 0.0],
        opening_rate: 2.0 / 3.0,
    },
    Weights {
        predict: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        correct: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        pressure: [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0, 0.0],
        ahead: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        volume: [4.0 / 3.0, -1.0 / 3.0],
        volume_rate: 2.0 / 3.0,
        opening: [18.0 / 11.0, -9.0 / 11.0, 2.0 / 11.0],
        opening_rate: 6.0 / 11.0,
    },
    Weights {
        predict: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        correct: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        pressure: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        ahead: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        volume: [4.0 / 3.0, -1.0 / 3.0],
        volume_rate: 2.0 / 3.0,
        opening: [18.0 / 11.0, -9.0 / 11.0, 2.0 / 11.0],
        opening_rate: 6.0 / 11.0,
    },
];

/// The sum in pairs, so that the additions do not wait for each other.
#[inline(always)]
fn weigh<S: Scalar, const N: usize>(past: &[S], weights: [f64; N]) -> S {
    let term = |k: usize| S::constant(weights[k]) * past[k];
    match N {
        2 => term(0) + term(1),
        3 => term(0) + (term(1) + term(2)),
        _ => (term(0) + term(1)) + (term(2) + term(3)),
    }
}

/// One step of `h` with the new rate and three past ones.
#[inline(always)]
fn correct<S: Scalar>(value: S, h: S, rate: S, past: &[S], weights: [f64; 4]) -> S {
    let [new, first, second, third] = weights;
    value + h * (weigh(past, [first, second, third]) + S::constant(new) * rate)
}

/// What stays the same in the pressure equations from one substep to the next.
#[derive(Debug, Clone, Copy)]
struct Gains<S> {
    /// Of the drop, on the opening times its denominator: r·k.
    regulation: S,
    /// Of the pressure across the compensator, on that denominator.
    feedback: S,
    /// r·A_max.
    wide: S,
    one_plus_r: S,
    gamma: S,
    /// What a substep leaves of the compensator's distance from an end: e^(−h/τ).
    decay: S,
}

impl<S: Scalar> Gains<S> {
    fn new(lift: &Lift<S>, h: f64, weights: &Weights) -> Self {
        let c = &lift.compensator;
        let r = S::constant(h * weights.opening_rate) * c.inverse_tau;
        Gains {
            regulation: r * c.slope,
            feedback: r * c.slope * c.flow_force,
            wide: r * c.a_max,
            one_plus_r: S::one() + r,
            gamma: S::constant(h * weights.volume_rate) * lift.volume_stiffness,
            decay: (-(S::constant(h) * c.inverse_tau)).exp(),
        }
    }
}

/// The scalar equation for the pressure drop D across the proportional valve.
#[derive(Debug, Clone, Copy)]
struct DropEquation<S> {
    orifice_a: Orifice<S>,
    orifice_b: Orifice<S>,
    c2_a: S,
    c2_b: S,
    opening: S,
    /// p_A = p_a_free − kappa·q_A.
    p_a_free: S,
    /// p_a_free with what lies between cylinder and valve: D = p_in_free − kappa·q_A − p_B.
    p_in_free: S,
    kappa: S,
    /// p_B = p_b_past + gamma·(q_A − q_B).
    p_b_past: S,
    gamma: S,
    p_d: S,
    /// The compensator's opening A = a_past + r·(A_s − A), which is (numerator − regulation·D)/
    /// (1 + r + feedback·(p_B − p_D)), between the openings that it reaches if A_s stays at either end.
    numerator: S,
    /// With the share of D that the compensator senses at once.
    regulation: S,
    one_plus_r: S,
    feedback: S,
    closed: S,
    open: S,
}

/// What the drop determines.
#[derive(Debug, Clone, Copy)]
struct Solved<S> {
    drop: S,
    q_a: S,
    a_comp: S,
}

impl<S: Scalar> Solved<S> {
    #[inline(always)]
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        Solved {
            drop: S::select(mask, yes.drop, no.drop),
            q_a: S::select(mask, yes.q_a, no.q_a),
            a_comp: S::select(mask, yes.a_comp, no.a_comp),
        }
    }
}

/// Where a Newton step has gone, and whether it was a small one.
#[derive(Debug, Clone, Copy)]
struct Near<S: Scalar> {
    drop: S,
    p_cd: S,
    settled: S::Mask,
}

/// The compensator's opening after the substep: what regulation asks for, and the ends it is held between.
#[derive(Debug, Clone, Copy)]
struct Opening<S> {
    free: S,
    free_slope: S,
    closed: S,
    open: S,
}

/// The equation at a drop.
#[derive(Debug, Clone, Copy)]
struct At<S> {
    /// p_B − p_b_past − γ(q_A − q_B), and its slope in D.
    residual: S,
    slope: S,
    q_a: S,
    q_a_slope: S,
    opening: Opening<S>,
}

impl<S: Scalar> Opening<S> {
    /// The opening where the drop has moved by `step`, as far as the slope tells.
    #[inline(always)]
    fn after(&self, step: S) -> S {
        (self.free + self.free_slope * step).clamp_to(self.closed, self.open)
    }

    /// True where `free` lies between the ends.
    #[inline(always)]
    fn regulates(&self, free: S) -> S::Mask {
        self.closed.lt(free).and(free.lt(self.open))
    }

    /// True where a move of the drop by `step` crosses no kink, as far as the slope tells.
    #[inline(always)]
    fn same_side(&self, step: S) -> S::Mask {
        let (now, then) = (self.regulates(self.free), self.regulates(self.free + self.free_slope * step));
        now.and(then).or(now.or(then).not())
    }
}

/// True where a step is less than this share of the drop it is added to.
#[inline(always)]
fn is_share<S: Scalar>(step: S, drop: S, share: f64) -> S::Mask {
    step.abs().lt(S::constant(share) * drop.abs().max(S::constant(LEAST_DROP)))
}

impl<S: Scalar> DropEquation<S> {
    fn real(&self) -> DropEquation<S::Real> {
        DropEquation {
            orifice_a: self.orifice_a.real(),
            orifice_b: self.orifice_b.real(),
            c2_a: self.c2_a.real(),
            c2_b: self.c2_b.real(),
            opening: self.opening.real(),
            p_a_free: self.p_a_free.real(),
            p_in_free: self.p_in_free.real(),
            kappa: self.kappa.real(),
            p_b_past: self.p_b_past.real(),
            gamma: self.gamma.real(),
            p_d: self.p_d.real(),
            numerator: self.numerator.real(),
            regulation: self.regulation.real(),
            one_plus_r: self.one_plus_r.real(),
            feedback: self.feedback.real(),
            closed: self.closed.real(),
            open: self.open.real(),
        }
    }

    #[inline(always)]
    fn at(&self, drop: S) -> At<S> {
        let a = self.orifice_a.flow_and_slopes(self.c2_a, self.opening, drop);
        let p_b = self.p_in_free - self.kappa * a.q - drop;
        let p_b_slope = -(self.kappa * a.by_pressure + S::one());
        let p_cd = p_b - self.p_d;
        // The denominator is positive for every drop a truck can have.
        let inverse = S::one() / (self.one_plus_r + self.feedback * p_cd).max(S::constant(0.5));
        let free = (self.numerator - self.regulation * drop) * inverse;
        let free_slope = -(self.regulation + free * self.feedback * p_b_slope) * inverse;
        let opening = Opening { free, free_slope, closed: self.closed, open: self.open };
        let area_slope = S::select(opening.regulates(free), free_slope, S::zero());
        let b = self.orifice_b.flow_and_slopes(self.c2_b, opening.after(S::zero()), p_cd);
        At {
            residual: p_b - self.p_b_past - self.gamma * (a.q - b.q),
            slope: p_b_slope - self.gamma * (a.by_pressure - b.by_pressure * p_b_slope - b.by_area * area_slope),
            q_a: a.q,
            q_a_slope: a.by_pressure,
            opening,
        }
    }

    /// The root and what follows from it: real parts only; and how many iterations the slowest lane took.
    ///
    /// Newton's method, in the drop and p_B together, from where both are extrapolated to; a lane that
    /// is not there at once is [searched for](Self::searched).
    #[inline(always)]
    fn root(&self, drop: S, p_b: S, tolerance: f64) -> (Solved<S>, usize) {
        let (mut found, mut near) = self.newton(drop, p_b - self.p_d, tolerance);
        let mut missed = near.settled.not();
        for iteration in 1..NEAR_LIMIT {
            if !missed.any() {
                return (found, iteration);
            }
            let (next, after) = self.newton(near.drop, near.p_cd, tolerance);
            found = Solved::select(missed, next, found);
            missed = missed.and(after.settled.not());
            near = after;
        }
        if !missed.any() {
            return (found, NEAR_LIMIT);
        }
        let (far, iterations) = self.searched(drop, tolerance);
        (Solved::select(missed, far, found), NEAR_LIMIT + iterations)
    }

    /// One Newton step from the drops `drop` across the valve and `p_cd` across the compensator, and
    /// what follows from it to the first order.
    #[inline(always)]
    fn newton(&self, drop: S, p_cd: S, tolerance: f64) -> (Solved<S>, Near<S>) {
        let (zero, one) = (S::zero(), S::one());
        let a = self.orifice_a.flow_and_slopes(self.c2_a, self.opening, drop);
        let inverse = one / (self.one_plus_r + self.feedback * p_cd).max(S::constant(0.5));
        let free = (self.numerator - self.regulation * drop) * inverse;
        let (by_drop, by_p_cd) = (-(self.regulation * inverse), -(free * self.feedback * inverse));
        let opening = Opening { free, free_slope: zero, closed: self.closed, open: self.open };
        let regulates = opening.regulates(free);
        let b = self.orifice_b.flow_and_slopes(self.c2_b, opening.after(zero), p_cd);
        let area_slope = S::select(regulates, b.by_area, zero);
        let b_by_p_cd = one + self.gamma * (b.by_pressure + area_slope * by_p_cd);
        let residual = (p_cd + self.p_d - self.p_b_past) - self.gamma * (a.q - b.q);
        let gain = one + self.kappa * a.by_pressure;
        // By how much the p_B that p_A leaves differs from the one that was assumed.
        let gap = (self.p_in_free - self.kappa * a.q) - (drop + (p_cd + self.p_d));
        let slope = b_by_p_cd * gain + self.gamma * (a.by_pressure - area_slope * by_drop);
        let step = (b_by_p_cd * gap + residual) / slope;
        let p_cd_step = gap - gain * step;
        let after = free + (by_drop * step + by_p_cd * p_cd_step);
        let then = opening.regulates(after);
        let same_side = regulates.and(then).or(regulates.or(then).not());
        let small = is_share(step, drop, tolerance).and(is_share(p_cd_step, p_cd, LOOSER_FOR_P_B * tolerance));
        let settled = small.and(same_side);
        let solved = Solved {
            drop: drop + step,
            q_a: a.q + a.by_pressure * step,
            a_comp: after.clamp_to(self.closed, self.open),
        };
        (solved, Near { drop: solved.drop, p_cd: p_cd + p_cd_step, settled })
    }

    /// The root, by Newton's method kept within a bracket, bisecting where it does not halve its
    /// step (Press et al. 2007, section 9.4), and what follows from it, to the first order in the
    /// last step: real parts only; and how many iterations the slowest lane took.
    ///
    /// The bracket: a positive drop fills the volume, so p_B is then no lower than the lower one of
    /// its past and the tank's pressure, and p_A no higher than without the flow; and conversely.
    #[inline(always)]
    fn searched(&self, guess: S, tolerance: f64) -> (Solved<S>, usize) {
        let (zero, half) = (S::zero(), S::constant(0.5));
        let mut lower = (self.p_in_free - self.p_b_past.max(self.p_d)).min(zero);
        let mut upper = (self.p_in_free - self.p_b_past.min(self.p_d)).max(zero);
        let mut found = Solved { drop: guess.clamp_to(lower, upper), q_a: zero, a_comp: zero };
        let mut last = upper - lower;
        let (wide, mut open) = (lower.lt(upper), zero.lt(S::one()));
        for iteration in 1..=NEWTON_LIMIT {
            let drop = found.drop;
            let at = self.at(drop);
            let below = zero.lt(at.residual);
            lower = S::select(below, drop, lower);
            upper = S::select(below, upper, drop);
            let newton = drop - at.residual / at.slope;
            let step = newton - drop;
            let small = is_share(step, drop, tolerance);
            // A small step on the steep side of a kink may be far from the root on the flat one.
            let settled = small.and(at.opening.same_side(step));
            let inside = lower.lt(newton).and(newton.lt(upper)).and(step.abs().lt(half * last));
            let next = S::select(inside.or(small), newton, half * (lower + upper));
            let step = next - drop;
            last = step.abs();
            let solved = Solved { drop: next, q_a: at.q_a + at.q_a_slope * step, a_comp: at.opening.after(step) };
            found = Solved::select(open, solved, found);
            open = open.and(wide).and(settled.not());
            if !open.any() {
                return (found, iteration);
            }
        }
        (found, NEWTON_LIMIT)
    }

    /// The root with its derivatives, by the implicit function theorem.
    #[inline(always)]
    fn solve(&self, drop: S::Real, p_b: S::Real, tolerance: f64) -> (Solved<S>, usize) {
        let real = self.real();
        let (found, iterations) = real.root(drop, p_b, tolerance);
        let at = self.at(S::from_real(found.drop));
        let drop = S::implicit(found.drop, at.residual, real.at(found.drop).slope);
        let at = self.at(drop);
        let minus_one = S::Real::constant(-1.0);
        let solved = Solved {
            drop,
            q_a: S::implicit(found.q_a, at.q_a, minus_one),
            a_comp: S::implicit(found.a_comp, at.opening.after(S::zero()), minus_one),
        };
        (solved, iterations)
    }
}

/// What the rate of p_A, which is history to later substeps, is made of besides the ports.
#[derive(Debug, Clone, Copy)]
struct Oil<S> {
    /// E/V [Pa/m³].
    stiffness: S,
    q_a: S,
}

/// The mast on its way, substep after substep.
#[derive(Debug, Clone)]
pub struct Fixed<S, X, const L: usize> {
    pub mast: Mast<S, X, L>,
    /// Newton iterations of the pressure equations so far.
    pub pair_iterations: usize,
    /// Relative size of the Newton step that counts as converged.
    pub tolerance: f64,
    lifts: [LiftState<S>; L],
    own: Vec<S>,
    own_rates: Vec<Past<S, 3>>,
    history: [History<S>; L],
    valve: [ValveStep<S>; L],
    gains: [Gains<S>; L],
    h: f64,
    valve_steps: usize,
    substeps: usize,
}

/// Largest product of step and fastest rate that the valve's steps are given.
const VALVE_REACH: f64 = 4.0;

/// How many steps the valve takes in a substep of `h` [s] if its fastest rate is `rate` [1/s]. An
/// ensemble takes the largest number over all its members, or a member's bits would depend on its
/// neighbours.
pub fn valve_steps(rate: f64, h: f64) -> usize {
    ((rate * h / VALVE_REACH).ceil() as usize).max(1)
}

impl<S: Scalar, X: Physics<S>, const L: usize> Fixed<S, X, L> {
    /// Starts in `start` with substeps of `h` [s], the valve moving in `valve_steps` parts of each.
    pub fn new(mast: Mast<S, X, L>, start: &[S], h: f64, valve_steps: usize) -> Self {
        let lifts = std::array::from_fn(|k| LiftState::from_slice(&start[k * STATES..(k + 1) * STATES]));
        let own = start[L * STATES..].to_vec();
        let zero = S::zero();
        let history = lifts.map(|s: LiftState<S>| History {
            v: [s.v; 3],
            v_rate: [zero; 3],
            z_rate: [zero; 3],
            p_a: [s.p_a; 2],
            p_a_rate: [zero; 3],
            p_b: [s.p_b; 2],
            a_comp: [s.a_comp; 3],
            drop: [s.p_a - s.p_b; 2],
        });
        let own_rates = vec![[zero; 3]; own.len()];
        let part = S::constant(h / valve_steps as f64);
        let valve = std::array::from_fn(|k| mast.lifts[k].valve.over(part));
        let gains = std::array::from_fn(|k| Gains::new(&mast.lifts[k], h, &WEIGHTS[0]));
        let mut fixed = Fixed {
            mast,
            pair_iterations: 0,
            tolerance: CONVERGED,
            lifts,
            own,
            own_rates,
            history,
            valve,
            gains,
            h,
            valve_steps,
            substeps: 0,
        };
        fixed.first_rates();
        fixed
    }

    /// The states of lift `k`.
    pub fn lift(&self, k: usize) -> &LiftState<S> {
        &self.lifts[k]
    }

    /// Writes the whole state vector.
    pub fn write(&self, x: &mut [S]) {
        for (k, s) in self.lifts.iter().enumerate() {
            s.write(&mut x[k * STATES..(k + 1) * STATES]);
        }
        x[L * STATES..].copy_from_slice(&self.own);
    }

    /// Rates at the start, so that the first prediction knows where it goes.
    fn first_rates(&mut self) {
        let mut x = vec![S::zero(); self.mast.dim()];
        let mut dx = x.clone();
        self.write(&mut x);
        self.mast.rates(&x, &mut dx);
        for (k, history) in self.history.iter_mut().enumerate() {
            let rates = LiftState::from_slice(&dx[k * STATES..(k + 1) * STATES]);
            let (stop, x) = (self.mast.lifts[k].stop, self.lifts[k].x);
            history.v_rate = [S::select(stop.blocks(x, rates.v), S::zero(), rates.v); 3];
            history.z_rate = [rates.z; 3];
            history.p_a_rate = [rates.p_a; 3];
        }
        let mut own = vec![S::zero(); self.own.len()];
        self.mast.physics.explicit_rates(&self.mast.bus(self.lifts), &self.own, &mut own);
        for (past, rate) in self.own_rates.iter_mut().zip(own) {
            *past = [rate; 3];
        }
    }

    /// One substep under the mast's present inputs.
    #[inline(always)]
    pub fn substep(&mut self) {
        let row = self.substeps.min(WEIGHTS.len() - 1);
        let weights = &WEIGHTS[row];
        if self.substeps == row {
            self.gains = std::array::from_fn(|k| Gains::new(&self.mast.lifts[k], self.h, weights));
        }
        let h = S::constant(self.h);
        let mut moved = self.lifts;
        for k in 0..L {
            self.predict_motion(k, &mut moved[k], weights);
        }
        for (own, past) in self.own.iter_mut().zip(&self.own_rates) {
            *own = *own + h * weigh(past, weights.predict);
        }
        // What effects see of the substep's end; the valve itself has yet to move.
        let mut ahead = self.mast.bus(moved);
        for s in &mut ahead.lifts {
            s.i = s.i + h * s.i_rate;
        }
        self.mast.physics.relax(&self.mast.bus(self.lifts), &ahead, h, &mut self.own);
        let (ports, _) = self.mast.physics.ports(&ahead, &self.own);
        let mut oil = [Oil { stiffness: S::zero(), q_a: S::zero() }; L];
        for k in 0..L {
            oil[k] = self.advance_oil(k, &mut moved[k], &ports[k], weights);
        }
        // The rates at the prediction, and the correction with them.
        let bus = self.mast.bus(moved);
        let (ports, joint) = self.mast.physics.ports(&bus, &self.own);
        let mut force = [S::zero(); L];
        let mut z_rate = [S::zero(); L];
        for k in 0..L {
            let s = &moved[k];
            (force[k], z_rate[k]) = self.mast.lifts[k].force_and_bristle_rate(s.v, s.z, s.p_a, &ports[k]);
        }
        let acceleration = self.mast.accelerations(force, &ports, joint);
        for k in 0..L {
            let (stop, old, past) = (self.mast.lifts[k].stop, &self.lifts[k], &mut self.history[k]);
            let s = &mut moved[k];
            let displaced = ports[k].cylinder_flow(-(self.mast.lifts[k].balance.area * s.v));
            push(&mut past.p_a_rate, oil[k].stiffness * (displaced - oil[k].q_a));
            let v_rate = S::select(stop.blocks(s.x, acceleration[k]), S::zero(), acceleration[k]);
            s.z = correct(old.z, h, z_rate[k], &past.z_rate, weights.correct);
            let v = correct(old.v, h, v_rate, &past.v_rate, weights.correct);
            let lands = stop.blocks(s.x, v);
            (s.x, s.v) = stop.limit(s.x, v);
            push(&mut past.v, s.v);
            push(&mut past.v_rate, v_rate);
            // The motion before a stop was met says nothing of that after.
            if lands.any() {
                past.v = past.v.map(|v| S::select(lands, S::zero(), v));
                past.v_rate = past.v_rate.map(|rate| S::select(lands, S::zero(), rate));
            }
            push(&mut past.z_rate, z_rate[k]);
        }
        self.lifts = moved;
        if !self.own.is_empty() {
            let mut rates = vec![S::zero(); self.own.len()];
            self.mast.physics.explicit_rates(&bus, &self.own, &mut rates);
            for (past, rate) in self.own_rates.iter_mut().zip(rates) {
                push(past, rate);
            }
        }
        self.substeps += 1;
    }

    /// Predicted motion of lift `k`, from `s` at the start of the substep, and its pressures
    /// extrapolated, which is what the oil's ports and E/V are taken at: ones that lagged by the
    /// substep would leave an effect of the pressures at first order.
    #[inline(always)]
    fn predict_motion(&self, k: usize, s: &mut LiftState<S>, weights: &Weights) {
        let (lift, past, h) = (&self.mast.lifts[k], &self.history[k], S::constant(self.h));
        s.z = s.z + h * weigh(&past.z_rate, weights.predict);
        let v = s.v + h * weigh(&past.v_rate, weights.predict);
        let x = correct(s.x, h, v, &past.v, weights.correct);
        (s.x, s.v) = lift.stop.limit(x, v);
        s.p_a = past.p_a[0] + past.p_a[0] - past.p_a[1];
        s.p_b = past.p_b[0] + past.p_b[0] - past.p_b[1];
    }

    /// Valve and pressures of lift `k` after its predicted motion.
    #[inline(always)]
    fn advance_oil(&mut self, k: usize, s: &mut LiftState<S>, ports: &X::Ports, weights: &Weights) -> Oil<S> {
        let (lift, past, h) = (&self.mast.lifts[k], &mut self.history[k], S::constant(self.h));
        let (gains, command) = (&self.gains[k], ports.current(self.mast.command[k]));
        let mut valve = ValveState { i: s.i, rate: s.i_rate, bristle: s.i_bristle };
        for _ in 0..self.valve_steps {
            valve = self.valve[k].advance(valve, command);
        }
        (s.i, s.i_rate, s.i_bristle) = (valve.i, valve.rate, valve.bristle);

        // E/V at the extrapolated pressure: it changes by less than a percent per substep.
        let stiffness = lift.cylinder_stiffness(s.p_a, s.x, ports);
        let [implicit, first, second, third] = weights.pressure;
        let rest = weigh(&past.p_a_rate, [first, second, third]);
        let displaced = ports.cylinder_flow(-(lift.balance.area * s.v));
        let kappa = h * S::constant(implicit) * stiffness;
        let nu = ports.viscosity(lift.nu);
        let (orifice_a, orifice_b) = lift.orifices(ports);
        let a_past = weigh(&past.a_comp, weights.opening);
        let (least, most) = (lift.compensator.a_leak, lift.compensator.a_max);
        let p_a_free = past.p_a[0] + h * rest + kappa * displaced;
        let equation = DropEquation {
            orifice_a,
            orifice_b,
            c2_a: orifice_a.critical_squared(nu),
            c2_b: orifice_b.critical_squared(nu),
            opening: lift.opening(s.i, ports),
            p_a_free,
            p_in_free: ports.inlet_pressure(p_a_free),
            kappa,
            p_b_past: weigh(&past.p_b, weights.volume),
            gamma: gains.gamma,
            p_d: ports.return_pressure(lift.p_tank),
            numerator: a_past + gains.wide + gains.regulation * ports.preset_pressure(lift.compensator.p_set),
            regulation: gains.regulation * ports.sensed_drop(S::one()),
            one_plus_r: gains.one_plus_r,
            feedback: gains.feedback,
            closed: least + (s.a_comp - least) * gains.decay,
            open: most + (s.a_comp - most) * gains.decay,
        };
        let drop = past.drop[0].real() + past.drop[0].real() - past.drop[1].real();
        let p_a = past.p_a[0] + h * weigh(&past.p_a_rate, weights.ahead);
        let p_b = ports.inlet_pressure(p_a).real() - drop;
        let (solved, iterations) = equation.solve(drop, p_b, self.tolerance);
        self.pair_iterations += iterations;
        s.p_a = equation.p_a_free - kappa * solved.q_a;
        s.p_b = equation.p_in_free - kappa * solved.q_a - solved.drop;
        s.a_comp = solved.a_comp;
        push(&mut past.p_a, s.p_a);
        push(&mut past.p_b, s.p_b);
        push(&mut past.a_comp, s.a_comp);
        push(&mut past.drop, solved.drop);
        Oil { stiffness, q_a: solved.q_a }
    }
}
