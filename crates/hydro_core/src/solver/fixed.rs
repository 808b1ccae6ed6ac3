//! The fast path: fixed substeps, for ensembles, estimation and closed loops.
//!
//! One evaluation of the physics per substep, over any scalar. What is stiff is solved, what is not
//! is predicted and corrected:
//!
//! 1. Velocity and friction bristle are predicted (Adams–Bashforth 3), the position follows
//!    (Adams–Moulton 4). Ports are read there, at the extrapolated cylinder pressure.
//! 2. The valve depends on its command alone and runs ahead: classical Runge–Kutta for current and
//!    rate, the bristle in closed form, in as many steps as its fastest rate asks for ([`valve_steps`]).
//! 3. Given those and the opening, the pressures and the compensator are one scalar equation in
//!    D = p_A − p_B: p_A by Adams–Moulton 3, p_B and the compensator's opening by BDF3, the opening
//!    explicit in D with its exact ends. It falls strictly with D; a safeguarded Newton iteration
//!    solves it, so the kinks of the compensator cost nothing.
//! 4. Velocity and bristle are corrected (Adams–Moulton 4) with the rates at the prediction, which
//!    also serve as the next substep's history.
//!
//! Predict–evaluate–correct and IMEX multistep methods: Hairer, Nørsett & Wanner I (1993), III.1;
//! Ascher, Ruuth & Wetton (1995). After a reset the order builds up from one; a run starts at rest,
//! where that costs nothing. A lane that has converged is frozen by mask, so its bits do not depend
//! on its neighbours.

use crate::mast::{LiftState, Mast, Physics, STATES};
use crate::parts::compensator::Compensator;
use crate::parts::orifice::Orifice;
use crate::parts::valve::ValveState;
use crate::ports::Ports;
use crate::scalar::{Mask, Scalar};

/// Newton iterations after which a lane is given up; bisection alone would need some 50.
const NEWTON_LIMIT: usize = 60;
/// Relative size of the Newton step that counts as converged: what is left is of the order of its
/// square. From 1e-5 to 1e-3 the trajectories change by less than a micrometre a second, from 1.6 to 1.1
/// iterations a substep. The derivatives are those at the root, and do not take part in what is left.
const CONVERGED: f64 = 1e-3;
/// Pressure drops below this [Pa] count as this large when convergence is judged.
const LEAST_DROP: f64 = 1e2;

/// Past values, the newest first.
type Past<S> = [S; 3];

#[derive(Debug, Clone, Copy)]
struct History<S> {
    v: Past<S>,
    v_rate: Past<S>,
    z_rate: Past<S>,
    p_a: Past<S>,
    p_a_rate: Past<S>,
    p_b: Past<S>,
    a_comp: Past<S>,
    drop: Past<S>,
}

#[inline(always)]
fn push<S: Copy>(past: &mut Past<S>, newest: S) {
    *past = [newest, past[0], past[1]];
}

/// Weights of a method of growing order: rows for the first, second and every later substep.
struct Weights {
    predict: [f64; 3],
    /// Of the new rate and three past ones.
    correct: [f64; 4],
    /// Of the new rate and two past ones.
    pressure: [f64; 3],
    /// BDF: of three past values, and of the new rate.
    past: [f64; 3],
    rate: f64,
}

const WEIGHTS: [Weights; 3] = [
    Weights {
        predict: [1.0, 0.0, 0.0],
        correct: [0.5, 0.5, 0.0, 0.0],
        pressure: [1.0, 0.0, 0.0],
        past: [1.0, 0.0, 0.0],
        rate: 1.0,
    },
    Weights {
        predict: [1.5, -0.5, 0.0],
        correct: [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0, 0.0],
        pressure: [0.5, 0.5, 0.0],
        past: [4.0 / 3.0, -1.0 / 3.0, 0.0],
        rate: 2.0 / 3.0,
    },
    Weights {
        predict: [23.0 / 12.0, -16.0 / 12.0, 5.0 / 12.0],
        correct: [9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0],
        pressure: [5.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0],
        past: [18.0 / 11.0, -9.0 / 11.0, 2.0 / 11.0],
        rate: 6.0 / 11.0,
    },
];

#[inline(always)]
fn weigh<S: Scalar>(past: &Past<S>, weights: [f64; 3]) -> S {
    S::constant(weights[0]) * past[0] + S::constant(weights[1]) * past[1] + S::constant(weights[2]) * past[2]
}

/// One step of `h` with the new rate and three past ones.
#[inline(always)]
fn correct<S: Scalar>(value: S, h: S, rate: S, past: &Past<S>, weights: [f64; 4]) -> S {
    let [new, first, second, third] = weights;
    value + h * (S::constant(new) * rate + weigh(past, [first, second, third]))
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
    compensator: Compensator<S>,
    p_set: S,
    /// The share of D that the compensator senses at once.
    sensed: S,
    /// A = a_past + r·(A_s − A), between the openings that it reaches if A_s stays at either end.
    a_past: S,
    r: S,
    closed: S,
    open: S,
}

/// What the drop determines.
#[derive(Debug, Clone, Copy)]
struct Solved<S> {
    q_a: S,
    p_a: S,
    p_b: S,
    a_comp: S,
}

/// The compensator's opening after the substep: what regulation asks for, and the ends it is held between.
#[derive(Debug, Clone, Copy)]
struct Opening<S> {
    free: S,
    free_slope: S,
    closed: S,
    open: S,
}

impl<S: Scalar> Opening<S> {
    #[inline(always)]
    fn area(&self) -> S {
        self.free.clamp_to(self.closed, self.open)
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

impl<S: Scalar> DropEquation<S> {
    fn real(&self) -> DropEquation<S::Real> {
        let c = &self.compensator;
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
            compensator: Compensator {
                a_max: c.a_max.real(),
                a_leak: c.a_leak.real(),
                slope: c.slope.real(),
                p_set: c.p_set.real(),
                flow_force: c.flow_force.real(),
                inverse_tau: c.inverse_tau.real(),
            },
            p_set: self.p_set.real(),
            sensed: self.sensed.real(),
            a_past: self.a_past.real(),
            r: self.r.real(),
            closed: self.closed.real(),
            open: self.open.real(),
        }
    }

    /// The compensator's opening at the drop, before and after its ends, with slopes in D.
    #[inline(always)]
    fn opening(&self, drop: S, p_cd: S, p_cd_slope: S) -> Opening<S> {
        let c = &self.compensator;
        let feedback = self.r * c.slope * c.flow_force;
        // 1 + r + feedback·p_cd is positive for every drop a truck can have.
        let denominator = (S::one() + self.r + feedback * p_cd).max(S::constant(0.5));
        let inverse = S::one() / denominator;
        let free = (self.a_past + self.r * (c.a_max + c.slope * (self.p_set - self.sensed * drop))) * inverse;
        let free_slope = -(self.r * c.slope * self.sensed + free * feedback * p_cd_slope) * inverse;
        Opening { free, free_slope, closed: self.closed, open: self.open }
    }

    /// p_B − p_b_past − γ(q_A − q_B), its slope in D, and the compensator's opening.
    #[inline(always)]
    fn residual(&self, drop: S) -> (S, S, Opening<S>) {
        let a = self.orifice_a.flow_and_slopes(self.c2_a, self.opening, drop);
        let p_b = self.p_in_free - self.kappa * a.q - drop;
        let p_b_slope = -(self.kappa * a.by_pressure + S::one());
        let p_cd = p_b - self.p_d;
        let opening = self.opening(drop, p_cd, p_b_slope);
        let area_slope = S::select(opening.regulates(opening.free), opening.free_slope, S::zero());
        let b = self.orifice_b.flow_and_slopes(self.c2_b, opening.area(), p_cd);
        let residual = p_b - self.p_b_past - self.gamma * (a.q - b.q);
        let slope = p_b_slope - self.gamma * (a.by_pressure - b.by_pressure * p_b_slope - b.by_area * area_slope);
        (residual, slope, opening)
    }

    #[inline(always)]
    fn solved(&self, drop: S) -> Solved<S> {
        let q_a = self.orifice_a.flow(self.c2_a, self.opening, drop);
        let p_a = self.p_a_free - self.kappa * q_a;
        let p_b = self.p_in_free - self.kappa * q_a - drop;
        let a_comp = self.opening(drop, p_b - self.p_d, S::zero()).area();
        Solved { q_a, p_a, p_b, a_comp }
    }

    /// The root, by Newton's method kept within a bracket, bisecting where it does not halve its
    /// step (Press et al. 2007, section 9.4): real parts only; and how many iterations the slowest
    /// lane took.
    ///
    /// The bracket: a positive drop fills the volume, so p_B is then no lower than the lower one of
    /// its past and the tank's pressure, and p_A no higher than without the flow; and conversely.
    #[inline(always)]
    fn root(&self, guess: S, tolerance: f64) -> (S, usize) {
        let (zero, half) = (S::zero(), S::constant(0.5));
        let mut lower = (self.p_in_free - self.p_b_past.max(self.p_d)).min(zero);
        let mut upper = (self.p_in_free - self.p_b_past.min(self.p_d)).max(zero);
        let mut drop = guess.clamp_to(lower, upper);
        let mut last = upper - lower;
        let mut open = lower.lt(upper);
        for iteration in 1..=NEWTON_LIMIT {
            let (residual, slope, opening) = self.residual(drop);
            let below = zero.lt(residual);
            lower = S::select(below, drop, lower);
            upper = S::select(below, upper, drop);
            let step = -(residual / slope);
            let newton = drop + step;
            let small = step.abs().lt(S::constant(tolerance) * drop.abs().max(S::constant(LEAST_DROP)));
            // A small step on the steep side of a kink may be far from the root on the flat one.
            let settled = small.and(opening.same_side(step));
            let inside = lower.lt(newton).and(newton.lt(upper)).and(step.abs().lt(half * last));
            let next = S::select(inside.or(small), newton, half * (lower + upper));
            last = (next - drop).abs();
            drop = S::select(open, next, drop);
            open = open.and(settled.not());
            if !open.any() {
                return (drop, iteration);
            }
        }
        (drop, NEWTON_LIMIT)
    }
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
    own_rates: Vec<Past<S>>,
    history: [History<S>; L],
    /// What a substep leaves of the compensator's distance from an end: e^(−h/τ).
    decay: [S; L],
    h: f64,
    valve_steps: usize,
    substeps: usize,
}

/// Largest product of step and fastest rate that the valve's Runge–Kutta steps are given.
const VALVE_REACH: f64 = 2.0;

/// How many Runge–Kutta steps the valve takes in a substep of `h` [s] if its fastest rate is `rate`
/// [1/s]. An ensemble takes the largest number over all its members, or a member's bits would
/// depend on its neighbours.
pub fn valve_steps(rate: f64, h: f64) -> usize {
    ((rate * h / VALVE_REACH).ceil() as usize).max(1)
}

impl<S: Scalar, X: Physics<S>, const L: usize> Fixed<S, X, L> {
    /// Starts in `start` with substeps of `h` [s], the valve moving in `valve_steps` parts of each.
    pub fn new(mast: Mast<S, X, L>, start: &[S], h: f64, valve_steps: usize) -> Self {
        let lifts = std::array::from_fn(|k| LiftState::from_slice(&start[k * STATES..(k + 1) * STATES]));
        let own = start[L * STATES..].to_vec();
        let history = lifts.map(|s: LiftState<S>| {
            let zero = [S::zero(); 3];
            History {
                v: [s.v; 3],
                v_rate: zero,
                z_rate: zero,
                p_a: [s.p_a; 3],
                p_a_rate: zero,
                p_b: [s.p_b; 3],
                a_comp: [s.a_comp; 3],
                drop: [s.p_a - s.p_b; 3],
            }
        });
        let own_rates = vec![[S::zero(); 3]; own.len()];
        let decay = std::array::from_fn(|k| (-(S::constant(h) * mast.lifts[k].compensator.inverse_tau)).exp());
        let mut fixed = Fixed {
            mast,
            pair_iterations: 0,
            tolerance: CONVERGED,
            lifts,
            own,
            own_rates,
            history,
            decay,
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
        let weights = &WEIGHTS[self.substeps.min(2)];
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
        for k in 0..L {
            self.advance_oil(k, &mut moved[k], &ports[k], weights);
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
            let v_rate = S::select(stop.blocks(s.x, acceleration[k]), S::zero(), acceleration[k]);
            s.z = correct(old.z, h, z_rate[k], &past.z_rate, weights.correct);
            let v = correct(old.v, h, v_rate, &past.v_rate, weights.correct);
            let lands = stop.blocks(s.x, v);
            (s.x, s.v) = stop.limit(s.x, v);
            push(&mut past.v, s.v);
            push(&mut past.v_rate, v_rate);
            // The motion before a stop was met says nothing of that after.
            for j in 0..3 {
                past.v[j] = S::select(lands, S::zero(), past.v[j]);
                past.v_rate[j] = S::select(lands, S::zero(), past.v_rate[j]);
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
    fn advance_oil(&mut self, k: usize, s: &mut LiftState<S>, ports: &X::Ports, weights: &Weights) {
        let (lift, past, h) = (&self.mast.lifts[k], &mut self.history[k], S::constant(self.h));
        let mut valve = ValveState { i: s.i, rate: s.i_rate, bristle: s.i_bristle };
        let command = ports.current(self.mast.command[k]);
        let part = self.h / self.valve_steps as f64;
        for _ in 0..self.valve_steps {
            valve = lift.valve.step(valve, command, part);
        }
        (s.i, s.i_rate, s.i_bristle) = (valve.i, valve.rate, valve.bristle);

        // E/V at the extrapolated pressure: it changes by less than a percent per substep.
        let stiffness = lift.cylinder_stiffness(s.p_a, s.x, ports);
        let implicit = h * S::constant(weights.pressure[0]);
        let rest =
            S::constant(weights.pressure[1]) * past.p_a_rate[0] + S::constant(weights.pressure[2]) * past.p_a_rate[1];
        let displaced = ports.cylinder_flow(-(lift.balance.area * s.v));
        let kappa = implicit * stiffness;
        let nu = ports.viscosity(lift.nu);
        let step = h * S::constant(weights.rate);
        let r = step * lift.compensator.inverse_tau;
        let p_a_free = past.p_a[0] + h * rest + kappa * displaced;
        let equation = DropEquation {
            orifice_a: lift.orifice_a,
            orifice_b: lift.orifice_b,
            c2_a: lift.orifice_a.critical_squared(nu),
            c2_b: lift.orifice_b.critical_squared(nu),
            opening: lift.opening(s.i, ports),
            p_a_free,
            p_in_free: ports.inlet_pressure(p_a_free),
            kappa,
            p_b_past: weigh(&past.p_b, weights.past),
            gamma: step * lift.volume_stiffness,
            p_d: ports.return_pressure(lift.p_tank),
            compensator: lift.compensator,
            p_set: ports.preset_pressure(lift.compensator.p_set),
            sensed: ports.sensed_drop(S::one()),
            a_past: weigh(&past.a_comp, weights.past),
            r,
            closed: lift.compensator.a_leak + (s.a_comp - lift.compensator.a_leak) * self.decay[k],
            open: lift.compensator.a_max + (s.a_comp - lift.compensator.a_max) * self.decay[k],
        };
        let real = equation.real();
        let (last, before) = (past.drop[0].real(), past.drop[1].real());
        let (root, iterations) = real.root(last + last - before, self.tolerance);
        let (_, slope, _) = real.residual(root);
        let drop = S::implicit(root, equation.residual(S::from_real(root)).0, slope);
        let solved = equation.solved(drop);
        self.pair_iterations += iterations;
        (s.p_a, s.p_b, s.a_comp) = (solved.p_a, solved.p_b, solved.a_comp);
        push(&mut past.p_a, s.p_a);
        push(&mut past.p_a_rate, stiffness * (displaced - solved.q_a));
        push(&mut past.p_b, s.p_b);
        push(&mut past.a_comp, s.a_comp);
        push(&mut past.drop, drop);
    }
}
