//! The fast path: fixed substeps, for ensembles, estimation and closed loops.
//!
//! One evaluation of the physics per substep, over any scalar. What is stiff is solved, what is not
//! is predicted and corrected:
//!
//! 1. Velocity and friction bristle are predicted (Adams–Bashforth 3), the position follows
//!    (Adams–Moulton 4). Ports are read there, at the extrapolated cylinder pressure.
//! 2. The valve depends on its command alone and runs ahead, one linearly implicit step a substep
//!    unless its fastest rate asks for more ([`ValveSteps`]); its bristle is in closed form, and a
//!    step in which the current turns is cut there. Where damping would ask for many, few nonlinearly
//!    implicit ones take their place.
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

use crate::mast::{Lift, LiftState, Mast, Physics, Resting, STATES};
use crate::parts::stiff_valve::StiffValveStep;
use crate::parts::valve::{Begun, Valve, ValveState, ValveStep};
use crate::ports::Ports;
use crate::scalar::{Mask, Scalar};
use crate::solver::drop::DropEquation;
use crate::solver::multistep::{next, Past, Weights, WEIGHTS};

/// Relative size of the Newton step that counts as converged: what is left is of the order of its
/// square. The derivatives are those at the root, and do not take part in what is left.
const CONVERGED: f64 = 2e-3;

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

/// What the rate of p_A, which is history to later substeps, is made of besides the ports.
#[derive(Debug, Clone, Copy)]
struct Oil<S> {
    /// E/V [Pa/m³].
    stiffness: S,
    q_a: S,
}

/// Where the valve of a lift stands at the end of a substep.
#[derive(Debug, Clone, Copy)]
struct Opened<S> {
    state: ValveState<S>,
    /// By its table [m²].
    area: S,
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
    valve: [ValveStep<S>; L],
    stiff_valve: [StiffValveStep<S>; L],
    /// The valves at the end of the coming substep, if its commands were known in time.
    ahead: Option<[Opened<S>; L]>,
    gains: [Gains<S>; L],
    h: f64,
    valve_steps: ValveSteps,
    /// Which place of the history holds the newest values.
    newest: usize,
    substeps: usize,
}

/// How many past rates a substep weighs.
const RATES: usize = 3;
/// Of a lift, how many numbers a substep depends on that earlier ones have left: see [`Fixed::each_remembered`].
const LIFT_MEMORY: usize = 3 + 2 + 2 + 3 + 5 + 3 * RATES;

/// How many numbers there are that earlier substeps have left and a substep depends on, beside the mast's inputs: of
/// lifts, and of effects with so many states.
pub fn memory(lifts: usize, states: usize) -> usize {
    lifts * LIFT_MEMORY + states * (1 + RATES)
}

/// Largest product of step and fastest rate that linearly implicit steps of the valve are given.
const LINEAR_REACH: f64 = 4.0;
/// Largest product of step and swing's rate that nonlinearly implicit ones are given: some thirteen steps a swing.
const IMPLICIT_REACH: f64 = 0.5;
/// What a nonlinearly implicit step costs in linearly implicit ones, counted in evaluations of the bristle: about eight
/// (in two stages, some three iterations and the end of each) against two.
const COST: usize = 4;

/// The rates [1/s] that decide how a valve is stepped, the largest of several valves.
#[derive(Debug, Clone, Copy, Default)]
pub struct ValveRates {
    fastest: f64,
    swing: f64,
}

impl ValveRates {
    /// These, or faster ones of `valve` in any lane.
    pub fn with<S: Scalar>(self, valve: &Valve<S>) -> Self {
        ValveRates {
            fastest: self.fastest.max(valve.fastest_rate().largest()),
            swing: self.swing.max(valve.swing_rate().largest()),
        }
    }
}

/// How many steps the valve takes in a substep, and by which method.
///
/// An ensemble takes side by side only members that are stepped alike, or a member's bits would depend
/// on its neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ValveSteps {
    /// [`ValveStep`].
    Linear(usize),
    /// [`StiffValveStep`].
    Implicit(usize),
}

impl ValveSteps {
    /// In a substep of `h` [s].
    pub fn of(rates: ValveRates, h: f64) -> Self {
        let number = |rate: f64, reach: f64| ((rate * h / reach).ceil() as usize).max(1);
        let linear = number(rates.fastest, LINEAR_REACH);
        let implicit = number(rates.swing, IMPLICIT_REACH);
        match linear > COST * implicit {
            true => ValveSteps::Implicit(implicit),
            false => ValveSteps::Linear(linear),
        }
    }

    fn number(self) -> usize {
        match self {
            ValveSteps::Linear(number) | ValveSteps::Implicit(number) => number,
        }
    }
}

impl<S: Scalar, X: Physics<S>, const L: usize> Fixed<S, X, L> {
    /// Starts in `start` with substeps of `h` [s], the valve moving in `valve_steps` of each.
    #[inline(always)]
    pub fn new(mast: Mast<S, X, L>, start: &[S], h: f64, valve_steps: ValveSteps) -> Self {
        let lifts = std::array::from_fn(|k| LiftState::from_slice(&start[k * STATES..(k + 1) * STATES]));
        let own = start[L * STATES..].to_vec();
        let zero = S::zero();
        let history = lifts.map(|s: LiftState<S>| History {
            v: Past::always(s.v),
            v_rate: Past::always(zero),
            z_rate: Past::always(zero),
            p_a: Past::always(s.p_a),
            p_a_rate: Past::always(zero),
            p_b: Past::always(s.p_b),
            a_comp: Past::always(s.a_comp),
            drop: Past::always(s.p_a - s.p_b),
        });
        let own_rates = vec![Past::always(zero); own.len()];
        let part = S::constant(h / valve_steps.number() as f64);
        let valve: [ValveStep<S>; L] = std::array::from_fn(|k| mast.lifts[k].valve.over(part));
        let stiff_valve = valve.map(StiffValveStep::new);
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
            stiff_valve,
            ahead: None,
            gains,
            h,
            valve_steps,
            newest: 0,
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

    /// Shows each number that earlier substeps have left and a substep depends on, with its place among them. What is kept twice is shown twice, at one place: a
    /// state and the newest of its past. The drop from which an iteration starts decides nothing, and is left out;
    /// so are valves that have moved ahead, which only a single number's do.
    pub fn each_remembered(&mut self, mut show: impl FnMut(usize, &mut S)) {
        let newest = self.newest;
        for (k, (s, past)) in self.lifts.iter_mut().zip(&mut self.history).enumerate() {
            let first = k * LIFT_MEMORY;
            let states = [&mut s.v, &mut s.p_a, &mut s.p_b, &mut s.a_comp];
            let pasts = [(&mut past.v, 3), (&mut past.p_a, 2), (&mut past.p_b, 2), (&mut past.a_comp, 3)];
            let mut place = first;
            for (state, (past, depth)) in states.into_iter().zip(pasts) {
                show(place, state);
                for back in 0..depth {
                    show(place + back, past.before_mut(newest, back));
                }
                place += depth;
            }
            for state in [&mut s.i, &mut s.i_rate, &mut s.i_bristle, &mut s.x, &mut s.z] {
                show(place, state);
                place += 1;
            }
            for past in [&mut past.v_rate, &mut past.z_rate, &mut past.p_a_rate] {
                for back in 0..RATES {
                    show(place + back, past.before_mut(newest, back));
                }
                place += RATES;
            }
            debug_assert_eq!(place, first + LIFT_MEMORY);
        }
        for (k, (state, rates)) in self.own.iter_mut().zip(&mut self.own_rates).enumerate() {
            let place = L * LIFT_MEMORY + k * (1 + RATES);
            show(place, state);
            for back in 0..RATES {
                show(place + 1 + back, rates.before_mut(newest, back));
            }
        }
    }

    /// Rates at the start, so that the first prediction knows where it goes.
    #[inline(always)]
    fn first_rates(&mut self) {
        let mut x = vec![S::zero(); self.mast.dim()];
        let mut dx = x.clone();
        self.write(&mut x);
        self.mast.rates_resting(&x, &mut dx, &Resting::At(self.lifts.map(|s| s.x)));
        for (k, history) in self.history.iter_mut().enumerate() {
            let rates = LiftState::from_slice(&dx[k * STATES..(k + 1) * STATES]);
            let (stop, x) = (self.mast.lifts[k].stop, self.lifts[k].x);
            history.v_rate = Past::always(S::select(stop.blocks(x, rates.v), S::zero(), rates.v));
            history.z_rate = Past::always(rates.z);
            history.p_a_rate = Past::always(rates.p_a);
        }
        let mut own = vec![S::zero(); self.own.len()];
        self.mast.physics.explicit_rates(&self.mast.bus(self.lifts), &self.own, &mut own);
        for (past, rate) in self.own_rates.iter_mut().zip(own) {
            *past = Past::always(rate);
        }
    }

    /// One substep under the mast's present inputs. `after` are the commands of the one that follows, if they are
    /// known; the mast must then have them. Where nothing comes between a command and its valve, a single number's
    /// valve moves on while this substep's pressures and accelerations are awaited, half a step each, which saves
    /// time and changes no bit.
    #[inline(always)]
    pub fn substep(&mut self, after: Option<[S; L]>) {
        let row = self.substeps.min(WEIGHTS.len() - 1);
        let weights = &WEIGHTS[row];
        if self.substeps == row {
            self.gains = std::array::from_fn(|k| Gains::new(&self.mast.lifts[k], self.h, weights));
        }
        let h = self.h;
        let mut moved = self.lifts;
        for k in 0..L {
            self.predict_motion(k, &mut moved[k], weights);
        }
        for (own, past) in self.own.iter_mut().zip(&self.own_rates) {
            *own = *own + past.weigh(self.newest, weights.predict).scaled(h);
        }
        // What effects see of the substep's end; the valve itself has yet to move.
        let mut ahead = self.mast.bus(moved);
        for s in &mut ahead.lifts {
            s.i = s.i + s.i_rate.scaled(h);
        }
        self.mast.physics.relax(&self.mast.bus(self.lifts), &ahead, S::constant(h), &mut self.own);
        let (ports, _) = self.mast.physics.ports(&ahead, &self.own);
        let known = self.ahead.take();
        let ahead_of_time = X::COMMAND_AS_GIVEN && S::NUMBERS == 1 && matches!(self.valve_steps, ValveSteps::Linear(_));
        let after = if ahead_of_time { after } else { None };
        let mut begun = [None; L];
        let mut opened = [Opened { state: self.lifts[0].valve(), area: S::zero() }; L];
        for k in 0..L {
            opened[k] = match &known {
                Some(ahead) => ahead[k],
                None => self.opened(k, self.lifts[k].valve(), ports[k].current(self.mast.command[k])),
            };
        }
        let mut oil = [Oil { stiffness: S::zero(), q_a: S::zero() }; L];
        for k in 0..L {
            if let Some(after) = after {
                begun[k] = Some(self.valve[k].begin(opened[k].state, after[k]));
            }
            oil[k] = self.advance_oil(k, &mut moved[k], opened[k], &ports[k], weights);
        }
        // The rates at the prediction, and the correction with them.
        let bus = self.mast.bus(moved);
        let (ports, joint) = self.mast.physics.ports(&bus, &self.own);
        let (newest, new) = (self.newest, next(self.newest));
        let mut force = [S::zero(); L];
        let mut z_rate = [S::zero(); L];
        for k in 0..L {
            let s = &moved[k];
            (force[k], z_rate[k]) = self.mast.lifts[k].force_and_bristle_rate(s.v, s.z, s.p_a, &ports[k]);
        }
        let resting = Resting::At(std::array::from_fn(|k| moved[k].x));
        let acceleration = self.mast.accelerations(force, &ports, joint, &resting);
        if let Some(after) = after {
            let mut ahead = opened;
            for k in 0..L {
                if let Some(begun) = &begun[k] {
                    ahead[k] = self.ended(k, begun, after[k]);
                }
            }
            self.ahead = Some(ahead);
        }
        for k in 0..L {
            let (stop, old, past) = (self.mast.lifts[k].stop, &self.lifts[k], &mut self.history[k]);
            let s = &mut moved[k];
            let displaced = ports[k].cylinder_flow(-(self.mast.lifts[k].balance.area * s.v));
            past.p_a_rate.set(new, oil[k].stiffness * (displaced - oil[k].q_a));
            let v_rate = S::select(stop.blocks(s.x, acceleration[k]), S::zero(), acceleration[k]);
            s.z = past.z_rate.correct(newest, old.z, h, z_rate[k], weights.correct);
            let v = past.v_rate.correct(newest, old.v, h, v_rate, weights.correct);
            let lands = stop.blocks(s.x, v);
            (s.x, s.v) = stop.limit(s.x, v);
            past.v.set(new, s.v);
            past.v_rate.set(new, v_rate);
            // The motion before a stop was met says nothing of that after.
            if lands.any() {
                past.v.forget(lands);
                past.v_rate.forget(lands);
            }
            past.z_rate.set(new, z_rate[k]);
        }
        self.lifts = moved;
        if !self.own.is_empty() {
            let mut rates = vec![S::zero(); self.own.len()];
            self.mast.physics.explicit_rates(&bus, &self.own, &mut rates);
            for (past, rate) in self.own_rates.iter_mut().zip(rates) {
                past.set(new, rate);
            }
        }
        self.newest = new;
        self.substeps += 1;
    }

    /// Predicted motion of lift `k`, from `s` at the start of the substep, and its pressures
    /// extrapolated, which is what the oil's ports and E/V are taken at: ones that lagged by the
    /// substep would leave an effect of the pressures at first order.
    #[inline(always)]
    fn predict_motion(&self, k: usize, s: &mut LiftState<S>, weights: &Weights) {
        let (lift, past, h) = (&self.mast.lifts[k], &self.history[k], self.h);
        s.z = s.z + past.z_rate.weigh(self.newest, weights.predict).scaled(h);
        let v = s.v + past.v_rate.weigh(self.newest, weights.predict).scaled(h);
        let x = past.v.correct(self.newest, s.x, h, v, weights.correct);
        (s.x, s.v) = lift.stop.limit(x, v);
        s.p_a = past.p_a.onward(self.newest);
        s.p_b = past.p_b.onward(self.newest);
    }

    /// The valve of lift `k` a substep after `from`, under a command [A].
    #[inline(always)]
    fn opened(&self, k: usize, from: ValveState<S>, command: S) -> Opened<S> {
        let mut state = from;
        match self.valve_steps {
            ValveSteps::Linear(number) => {
                for _ in 0..number {
                    state = self.valve[k].advance(state, command);
                }
            }
            ValveSteps::Implicit(number) => {
                for _ in 0..number {
                    state = self.stiff_valve[k].advance(state, command);
                }
            }
        }
        Opened { state, area: self.mast.lifts[k].table.at(state.i) }
    }

    /// The same where the first linearly implicit step is half done.
    #[inline(always)]
    fn ended(&self, k: usize, begun: &Begun<S>, command: S) -> Opened<S> {
        let mut state = self.valve[k].end(begun);
        for _ in 1..self.valve_steps.number() {
            state = self.valve[k].advance(state, command);
        }
        Opened { state, area: self.mast.lifts[k].table.at(state.i) }
    }

    /// Pressures of lift `k` after its predicted motion and that of its valve.
    #[inline(always)]
    fn advance_oil(
        &mut self,
        k: usize,
        s: &mut LiftState<S>,
        opened: Opened<S>,
        ports: &X::Ports,
        weights: &Weights,
    ) -> Oil<S> {
        let (lift, past, h) = (&self.mast.lifts[k], &mut self.history[k], self.h);
        let (newest, new) = (self.newest, next(self.newest));
        let gains = &self.gains[k];
        s.set_valve(opened.state);

        // E/V at the extrapolated pressure: it changes by less than a percent per substep.
        let stiffness = lift.cylinder_stiffness(s.p_a, s.x, ports);
        let [implicit, first, second, third] = weights.pressure;
        let rest = past.p_a_rate.weigh(newest, [first, second, third]);
        let displaced = ports.cylinder_flow(-(lift.balance.area * s.v));
        let kappa = stiffness.scaled(h * implicit);
        let nu = ports.viscosity(lift.nu);
        let (orifice_a, orifice_b) = lift.orifices(ports);
        let a_past = past.a_comp.weigh(newest, weights.opening);
        let (least, most) = (lift.compensator.a_leak, lift.compensator.a_max);
        let p_a_free = past.p_a.before(newest, 0) + rest.scaled(h) + kappa * displaced;
        let equation = DropEquation {
            orifice_a,
            orifice_b,
            c2_a: orifice_a.critical_squared(nu),
            c2_b: orifice_b.critical_squared(nu),
            opening: ports.opening(opened.area),
            p_a_free,
            p_in_free: ports.inlet_pressure(p_a_free),
            kappa,
            p_b_past: past.p_b.weigh(newest, weights.volume),
            gamma: gains.gamma,
            p_d: ports.return_pressure(lift.p_tank),
            numerator: a_past + gains.wide + gains.regulation * ports.preset_pressure(lift.compensator.p_set),
            regulation: gains.regulation * ports.sensed_drop(S::one()),
            one_plus_r: gains.one_plus_r,
            feedback: gains.feedback,
            closed: least + (s.a_comp - least) * gains.decay,
            open: most + (s.a_comp - most) * gains.decay,
        };
        let drop = past.drop.onward(newest).real();
        let p_a = past.p_a.before(newest, 0) + past.p_a_rate.weigh(newest, weights.ahead).scaled(h);
        let p_b = ports.inlet_pressure(p_a).real() - drop;
        let (solved, iterations) = equation.solve(drop, p_b, self.tolerance);
        self.pair_iterations += iterations;
        s.p_a = equation.p_a_free - kappa * solved.q_a;
        s.p_b = equation.p_in_free - kappa * solved.q_a - solved.drop;
        s.a_comp = solved.a_comp;
        past.p_a.set(new, s.p_a);
        past.p_b.set(new, s.p_b);
        past.a_comp.set(new, s.a_comp);
        past.drop.set(new, solved.drop);
        Oil { stiffness, q_a: solved.q_a }
    }
}
