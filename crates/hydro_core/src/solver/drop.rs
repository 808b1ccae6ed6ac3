//! The scalar equation that ties both pressures and the compensator's opening to the drop across the valve.

use crate::parts::orifice::Orifice;
use crate::scalar::{Mask, Scalar};

/// Newton iterations after which a lane is given up; bisection alone would need some 50.
const NEWTON_LIMIT: usize = 60;
/// How many times as much p_B may move, which enters as its root.
const LOOSER_FOR_P_B: f64 = 5.0;
/// Newton steps in the drop and p_B together before a lane is searched for.
const NEAR_LIMIT: usize = 2;
/// Pressure drops below this [Pa] count as this large when convergence is judged.
const LEAST_DROP: f64 = 1e2;

/// The scalar equation for the pressure drop D across the proportional valve.
#[derive(Debug, Clone, Copy)]
pub struct DropEquation<S> {
    pub orifice_a: Orifice<S>,
    pub orifice_b: Orifice<S>,
    pub c2_a: S,
    pub c2_b: S,
    pub opening: S,
    /// p_A = p_a_free − kappa·q_A.
    pub p_a_free: S,
    /// p_a_free with what lies between cylinder and valve: D = p_in_free − kappa·q_A − p_B.
    pub p_in_free: S,
    pub kappa: S,
    /// p_B = p_b_past + gamma·(q_A − q_B).
    pub p_b_past: S,
    pub gamma: S,
    pub p_d: S,
    /// The compensator's opening A = a_past + r·(A_s − A), which is (numerator − regulation·D)/
    /// (1 + r + feedback·(p_B − p_D)), between the openings that it reaches if A_s stays at either end.
    pub numerator: S,
    /// With the share of D that the compensator senses at once.
    pub regulation: S,
    pub one_plus_r: S,
    pub feedback: S,
    pub closed: S,
    pub open: S,
}

/// What the drop determines.
#[derive(Debug, Clone, Copy)]
pub struct Solved<S> {
    pub drop: S,
    pub q_a: S,
    pub a_comp: S,
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
        let (far, iterations) =
            if S::NUMBERS == 1 { self.searched_aside(drop, tolerance) } else { self.searched(drop, tolerance) };
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

    /// [`Self::searched`] out of the way of a single number, which hardly ever comes here: within the substep it
    /// would take registers away. Lanes have it inlined, or it would be compiled without their vectors.
    #[cold]
    #[inline(never)]
    fn searched_aside(self, guess: S, tolerance: f64) -> (Solved<S>, usize) {
        self.searched(guess, tolerance)
    }

    /// The root with its derivatives, by the implicit function theorem.
    #[inline(always)]
    pub fn solve(&self, drop: S::Real, p_b: S::Real, tolerance: f64) -> (Solved<S>, usize) {
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
