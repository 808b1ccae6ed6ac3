//! Steady lowering: the velocity a lift keeps under a constant current, section 3.6.1.
//!
//! The steady state is a zero of the mast's own right-hand side, [`Mast::rates`], in everything but the
//! position: effects take part as they are. It is bracketed in the thesis's parts, so that nothing
//! depends on a guess, and finished by Newton's method on the right-hand side; derivatives follow from
//! the implicit function theorem over dual numbers.

use crate::dual::Dual;
use crate::error::{refuse, Error};
use crate::mast::{
    place, Extended, Lift, LiftName, LiftState, Mast, Physics, Thesis, CYLINDER_PRESSURE, LIFT_STATES, STATES, VELOCITY,
};
use crate::ports::Closed;
use crate::run::jacobian_by_duals;
use crate::scalar::Scalar;
use crate::solver::linear::Lu;
use crate::truck::{Owner, Truck};

/// What is known of the cylinder's pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Known {
    /// p_A [Pa] and its rate [Pa/s], as measured: the force balance is left out, (3.38).
    Pressure { pressure: f64, rate: f64 },
    /// The load [kg]: p_A follows from the force balance with friction.
    Load(f64),
}

/// Where a steady state is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Commanded current [A].
    pub current: f64,
    /// Share by which the bristle of the valve's hysteresis is bent: 1 where the current rose, −1 where it fell.
    pub bend: f64,
    pub known: Known,
    pub oil_temperature_degc: f64,
}

/// What a derivative is taken along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// The k-th of [`Truck::values`].
    Parameter(usize),
    Current,
    /// What [`Known`] gives: the pressure or the load.
    Known,
    OilTemperature,
}

/// One steady state.
#[derive(Debug, Clone, PartialEq)]
pub struct Settled {
    /// Cylinder velocity [m/s], upward positive, and cylinder pressure [Pa].
    pub values: [f64; 2],
    /// Derivatives of both along the directions.
    pub derivatives: [Vec<f64>; 2],
}

/// Steps of Newton's method; it takes three.
const MOST_STEPS: usize = 60;
/// A step smaller than this, in states over their scales, is the last one.
const SMALL_STEP: f64 = 1e-13;
/// Derivatives taken at once.
const WIDE: usize = 16;

/// The steady lowering of `lift` at each point, with its derivatives.
///
/// At or below the tank's pressure, and where friction holds the load, the lift stands still: velocity and
/// derivatives are zero. Where friction falls so steeply with speed that several speeds balance, it is one
/// of them.
///
/// # Errors
/// [`Error::Argument`] for a point out of range; [`Error::NoSteadyState`] if effects leave none nearby.
pub fn settle(truck: &Truck, lift: LiftName, points: &[Point], along: &[Along]) -> Result<Vec<Settled>, Error> {
    points.iter().try_for_each(check)?;
    let joined = truck.joined();
    let at = |(k, point): (usize, &Point)| {
        let found = if joined {
            let place = usize::from(lift == LiftName::Main);
            Task { truck, which: LiftName::BOTH, lift: place, point, along }.settle()
        } else {
            Task { truck, which: [lift], lift: 0, point, along }.settle()
        };
        found.map_err(|state| Error::NoSteadyState {
            lift: lift.as_str().into(),
            point: k,
            current_a: point.current,
            worst_state: state,
        })
    };
    points.iter().enumerate().map(at).collect()
}

fn check(point: &Point) -> Result<(), Error> {
    if !(-0.1..=5.0).contains(&point.current) {
        return refuse("current", point.current, "a current between -0.1 and 5 A");
    }
    if !(-1.0..=1.0).contains(&point.bend) {
        return refuse("bend", point.bend, "between -1, the current fell, and 1, it rose");
    }
    if !(-50.0..=150.0).contains(&point.oil_temperature_degc) {
        return refuse("oil_temperature", point.oil_temperature_degc, "between -50 and 150 degC");
    }
    match point.known {
        Known::Pressure { pressure, .. } if !(0.0..=1e9).contains(&pressure) => {
            refuse("pressure", pressure, "between 0 and 1e9 Pa")
        }
        Known::Pressure { rate, .. } if !(-1e10..=1e10).contains(&rate) => {
            refuse("pressure_rate", rate, "between -1e10 and 1e10 Pa/s")
        }
        Known::Load(load) if !(0.0..=2e4).contains(&load) => refuse("load", load, "between 0 and 20000 kg"),
        _ => Ok(()),
    }
}

/// Where a continuous function that is negative at `lower` and not at `upper` changes its sign, to a few
/// roundings: no more steps than bisection takes and one, and far fewer where the function is smooth
/// (Oliveira & Takahashi 2020, ITP with κ₁ = 0.2/(b − a), κ₂ = 2, n₀ = 1).
fn sign_change(lower: f64, upper: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut b) = (lower, upper);
    let close = 2.0 * f64::EPSILON * b.abs().max(a.abs());
    let (mut f_a, mut f_b) = (f(a), f(b));
    let width = b - a;
    // The next power of two, of two at least.
    let (mantissa, exponent) = libm::frexp((width / close).max(1.0));
    let halvings = if mantissa > 0.5 { exponent } else { exponent - 1 };
    let mut room = close * libm::ldexp(1.0, halvings.max(1));
    while b - a > 2.0 * close {
        let middle = 0.5 * (a + b);
        let straight = if f_a < 0.0 && f_b > 0.0 { (f_b * a - f_a * b) / (f_b - f_a) } else { middle };
        let towards = if straight <= middle { 1.0 } else { -1.0 };
        let pushed = 0.2 * (b - a) * ((b - a) / width);
        let tried = if pushed <= (middle - straight).abs() { straight + towards * pushed } else { middle };
        let leash = room - 0.5 * (b - a);
        let next = if (tried - middle).abs() <= leash { tried } else { middle - towards * leash.max(0.0) };
        // A root at one end shows as a step within its roundings.
        let next = next.max(a + close).min(b - close);
        let f_next = f(next);
        if f_next < 0.0 {
            (a, f_a) = (next, f_next);
        } else {
            (b, f_b) = (next, f_next);
        }
        room *= 0.5;
    }
    b
}

/// The thesis's hydraulics at the pressure p_A over the tank's: p_B and the compensator's opening.
fn hydraulics(lift: &Lift<f64>, i: f64, p_a: f64) -> (f64, f64) {
    let (c2_a, c2_b) = (lift.orifice_a.critical_squared(lift.nu), lift.orifice_b.critical_squared(lift.nu));
    let opening = lift.opening(i, &Closed);
    let settled = |p_b: f64| lift.compensator.settled_area(p_a - p_b, p_b - lift.p_tank, lift.compensator.p_set);
    let p_b = sign_change(lift.p_tank, p_a, |p_b| {
        lift.orifice_b.flow(c2_b, settled(p_b), p_b - lift.p_tank) - lift.orifice_a.flow(c2_a, opening, p_a - p_b)
    });
    (p_b, settled(p_b))
}

/// Flow out of the cylinder [m³/s].
fn flow(lift: &Lift<f64>, i: f64, p_a: f64) -> f64 {
    if p_a <= lift.p_tank {
        return 0.0;
    }
    let p_b = hydraulics(lift, i, p_a).0;
    lift.orifice_a.flow(lift.orifice_a.critical_squared(lift.nu), lift.opening(i, &Closed), p_a - p_b)
}

/// The pressure [Pa] at which the lift slides steadily at the velocity `v` ≤ 0.
fn sliding_pressure(lift: &Lift<f64>, v: f64) -> f64 {
    let z = lift.friction.settled_bristle(v);
    let p = lift.balance.equilibrium_pressure();
    p - lift.force_and_bristle_rate(v, z, p, &Closed).0 / lift.balance.area
}

/// The pressure of the thesis's steady state under the load that `lift` has; none where friction holds it.
fn balanced_pressure(lift: &Lift<f64>, i: f64) -> Option<f64> {
    let area = lift.balance.area;
    if sliding_pressure(lift, -f64::MIN_POSITIVE) <= lift.p_tank {
        return None;
    }
    let excess = |speed: f64| area * speed - flow(lift, i, sliding_pressure(lift, -speed));
    let mut most = flow(lift, i, lift.balance.equilibrium_pressure()) / area;
    while excess(most) < 0.0 {
        most *= 2.0;
    }
    Some(sliding_pressure(lift, -sign_change(0.0, most, excess)))
}

struct Task<'a, const L: usize> {
    truck: &'a Truck,
    which: [LiftName; L],
    /// Which of them is lowered; the other stands still.
    lift: usize,
    point: &'a Point,
    along: &'a [Along],
}

impl<const L: usize> Task<'_, L> {
    /// The mast over any scalar, from the numbers that `number` makes of what a derivative may be taken along.
    fn mast<S: Scalar, X: Physics<S>>(
        &self,
        number: &impl Fn(Along, f64) -> S,
        physics: impl Fn(&[Lift<S>], Effects<S>) -> X,
    ) -> Mast<S, X, L> {
        let load = match self.point.known {
            Known::Load(load) => number(Along::Known, load),
            Known::Pressure { .. } => S::zero(),
        };
        let (lifts, effects) = self
            .truck
            .build(self.which, load, |k, v| number(Along::Parameter(k), v))
            .expect("both lifts are built where an effect joins them");
        let physics = physics(&lifts, effects);
        let mut mast = Mast { lifts, physics, command: [S::zero(); L], oil_temperature_degc: S::zero() };
        let mut command = [S::zero(); L];
        command[self.lift] = number(Along::Current, self.point.current);
        mast.set_inputs(command, number(Along::OilTemperature, self.point.oil_temperature_degc));
        mast
    }

    fn settle(&self) -> Result<Settled, String> {
        if self.truck.effects().next().is_none() {
            self.solve(|_, _| Thesis, |_, _| Thesis, |_, _| Thesis)
        } else {
            self.solve(|l, e| Extended::new(&e, l), |l, e| Extended::new(&e, l), |l, e| Extended::new(&e, l))
        }
    }

    /// What of the state vector is known beforehand, over any scalar.
    fn known<S: Scalar, X: Physics<S>>(&self, mast: &Mast<S, X, L>, number: &impl Fn(Along, f64) -> S) -> Vec<S> {
        let mut x = vec![S::zero(); mast.dim()];
        for (k, lift) in mast.lifts.iter().enumerate() {
            let position = S::constant(self.which[k].start_position()).clamp_to(lift.stop.lower, lift.stop.upper);
            let mut state = lift.at_rest(position);
            if k == self.lift {
                let valve = lift.valve.settled(mast.command[k], S::constant(self.point.bend));
                state = LiftState { i: valve.i, i_rate: valve.rate, i_bristle: valve.bristle, ..state };
                if let Known::Pressure { pressure, .. } = self.point.known {
                    state.p_a = number(Along::Known, pressure);
                }
            }
            state.write(&mut x[k * STATES..(k + 1) * STATES]);
        }
        x
    }

    fn solve<X: Physics<f64>, Y: Physics<Columns>, Z: Physics<Dual<f64, WIDE>>>(
        &self,
        plain: impl Fn(&[Lift<f64>], Effects<f64>) -> X,
        columns: impl Fn(&[Lift<Columns>], Effects<Columns>) -> Y,
        wide: impl Fn(&[Lift<Dual<f64, WIDE>>], Effects<Dual<f64, WIDE>>) -> Z,
    ) -> Result<Settled, String> {
        let mast = self.mast(&|_, v| v, plain);
        let lift = &mast.lifts[self.lift];
        let first = self.lift * STATES;
        let mut x = self.known(&mast, &|_, v| v);
        let mut state = LiftState::from_slice(&x[first..first + STATES]);
        let p_a = match self.point.known {
            Known::Pressure { pressure, .. } => Some(pressure).filter(|&p| p > lift.p_tank),
            Known::Load(_) => balanced_pressure(lift, state.i),
        };
        let Some(p_a) = p_a.filter(|&p| p > lift.p_tank) else {
            let p_a = match self.point.known {
                Known::Pressure { pressure, .. } => pressure,
                Known::Load(_) => lift.p_tank,
            };
            let none = vec![0.0; self.along.len()];
            return Ok(Settled { values: [0.0, p_a], derivatives: [none.clone(), none] });
        };
        state.p_a = p_a;
        (state.p_b, state.a_comp) = hydraulics(lift, state.i, p_a);
        let relieved = match self.point.known {
            Known::Pressure { rate, .. } => rate / lift.cylinder_stiffness(p_a, state.x, &Closed),
            Known::Load(_) => 0.0,
        };
        state.v = -(flow(lift, state.i, p_a) + relieved) / lift.balance.area;
        state.z = lift.friction.settled_bristle(state.v);
        state.write(&mut x[first..first + STATES]);
        mast.start_effects(&mut x);

        let dual = self.mast(&|_, v| Columns::constant(v), columns);
        let mut system = System::new(&mast, &dual, self, x);
        system.newton()?;
        let mut derivatives = [vec![0.0; self.along.len()], vec![0.0; self.along.len()]];
        if !self.along.is_empty() {
            let lu = system.factored()?;
            let owners = self.truck.owners();
            let concerns = |d: &usize| match self.along[*d] {
                Along::Parameter(k) => match owners[k] {
                    Owner::Lift(owner) => owner == self.which[self.lift],
                    Owner::Mast => true,
                },
                _ => true,
            };
            let directions: Vec<usize> = (0..self.along.len()).filter(concerns).collect();
            for part in directions.chunks(WIDE) {
                let number = |along: Along, value: f64| match part.iter().position(|&d| self.along[d] == along) {
                    Some(p) => Dual::variable(value, p),
                    None => Dual::constant(value),
                };
                let mast = self.mast(&number, &wide);
                let mut x = self.known(&mast, &number);
                for &k in &system.unknown {
                    x[k] = Dual::constant(system.x[k]);
                }
                let mut dx = x.clone();
                mast.rates(&x, &mut dx);
                for (p, &d) in part.iter().enumerate() {
                    // dy/dθ = −(∂R/∂y)⁻¹·∂R/∂θ.
                    let mut change: Vec<f64> = system.rows.iter().map(|&row| -dx[row].eps[p]).collect();
                    system.solve(&lu, &mut change);
                    for (state, derivatives) in [VELOCITY, CYLINDER_PRESSURE].iter().zip(&mut derivatives) {
                        let k = first + state;
                        derivatives[d] = match system.unknown.iter().position(|&u| u == k) {
                            Some(place) => change[place],
                            None => x[k].eps[p],
                        };
                    }
                }
            }
        }
        Ok(Settled { values: [system.x[first + VELOCITY], system.x[first + CYLINDER_PRESSURE]], derivatives })
    }
}

type Columns = Dual<f64, STATES>;
type Effects<S> = Vec<(crate::effects::Instance, usize, Vec<S>)>;

/// As many rows of the right-hand side as there are unknown states.
struct System<'a, X, Y, const L: usize> {
    plain: &'a Mast<f64, X, L>,
    dual: &'a Mast<Columns, Y, L>,
    x: Vec<f64>,
    unknown: Vec<usize>,
    rows: Vec<usize>,
    /// The rate that each row shall have.
    wanted: Vec<f64>,
    /// Largest entry of each row of the Jacobian over scaled states.
    row_scale: Vec<f64>,
    scale: Vec<f64>,
}

impl<'a, X: Physics<f64>, Y: Physics<Columns>, const L: usize> System<'a, X, Y, L> {
    fn new(plain: &'a Mast<f64, X, L>, dual: &'a Mast<Columns, Y, L>, task: &Task<L>, x: Vec<f64>) -> Self {
        const I: usize = place("valve_current");
        const I_RATE: usize = place("valve_current_rate");
        const Z: usize = place("friction_bristle");
        const P_B: usize = place("volume_pressure");
        const A_COMP: usize = place("compensator_area");
        let (unknown, rows, rate): (&[usize], &[usize], f64) = match task.point.known {
            Known::Pressure { rate, .. } => {
                (&[I, VELOCITY, P_B, A_COMP], &[I_RATE, CYLINDER_PRESSURE, P_B, A_COMP], rate)
            }
            Known::Load(_) => (
                &[I, VELOCITY, Z, CYLINDER_PRESSURE, P_B, A_COMP],
                &[I_RATE, VELOCITY, Z, CYLINDER_PRESSURE, P_B, A_COMP],
                0.0,
            ),
        };
        let first = task.lift * STATES;
        let own = L * STATES..x.len();
        let all = |of: &[usize]| of.iter().map(|k| first + k).chain(own.clone()).collect::<Vec<_>>();
        let rows = all(rows);
        let pressure = first + CYLINDER_PRESSURE;
        let wanted = rows.iter().map(|&row| if row == pressure { rate } else { 0.0 }).collect();
        // What a state reaches, so that a slow lowering is told as sharply as a fast one.
        let effects = task.truck.effects().filter(|effect| effect.lift.is_none_or(|lift| task.which.contains(&lift)));
        let of_effects: Vec<f64> = effects.flat_map(|e| e.kind.spec().states.iter().map(|state| state.scale)).collect();
        let usual = |k: usize| if k < L * STATES { LIFT_STATES[k % STATES].scale } else { of_effects[k - L * STATES] };
        let unknown = all(unknown);
        let scale = unknown.iter().map(|&k| if x[k] == 0.0 { usual(k) } else { x[k].abs() }).collect();
        System { plain, dual, x, row_scale: vec![1.0; rows.len()], unknown, rows, wanted, scale }
    }

    fn residual(&self, x: &[f64]) -> Vec<f64> {
        let mut dx = vec![0.0; x.len()];
        self.plain.rates(x, &mut dx);
        self.rows.iter().zip(&self.wanted).map(|(&row, wanted)| wanted - dx[row]).collect()
    }

    /// The Jacobian of the rows over the unknown states, scaled, and factored.
    fn factored(&mut self) -> Result<Lu<f64>, String> {
        let (n, dim) = (self.unknown.len(), self.x.len());
        let mut whole = vec![0.0; dim * dim];
        jacobian_by_duals::<STATES>(&self.x, &mut whole, |x, dx| self.dual.rates(x, dx));
        let mut part = Vec::with_capacity(n * n);
        for (r, &row) in self.rows.iter().enumerate() {
            let entries = self.unknown.iter().zip(&self.scale).map(|(&k, scale)| whole[row * dim + k] * scale);
            let entries: Vec<f64> = entries.collect();
            let most = entries.iter().fold(0.0f64, |most, e| most.max(e.abs()));
            if !(most > 0.0 && most.is_finite()) {
                return Err(self.name(row));
            }
            self.row_scale[r] = most;
            part.extend(entries.iter().map(|e| e / most));
        }
        Lu::factor(part, n).ok_or_else(|| self.name(self.rows[0]))
    }

    /// Turns rates of the rows into changes of the unknown states.
    fn solve(&self, lu: &Lu<f64>, b: &mut [f64]) {
        for (b, scale) in b.iter_mut().zip(&self.row_scale) {
            *b /= scale;
        }
        lu.solve(b);
        for (b, scale) in b.iter_mut().zip(&self.scale) {
            *b *= scale;
        }
    }

    fn size(&self, change: &[f64]) -> f64 {
        change.iter().zip(&self.scale).fold(0.0, |most, (c, scale)| most.max((c / scale).abs()))
    }

    /// Newton's method, damped by the natural monotonicity test (Deuflhard 2004, section 3.3).
    ///
    /// Without effects the bracketed state is the steady state, and what a step would better is rounding.
    fn newton(&mut self) -> Result<(), String> {
        if !X::JOINED {
            return Ok(());
        }
        let mut worst = 0;
        for _ in 0..MOST_STEPS {
            let lu = self.factored()?;
            let mut step = self.residual(&self.x);
            self.solve(&lu, &mut step);
            let length = self.size(&step);
            worst = (0..step.len())
                .max_by(|&a, &b| {
                    let of = |k: usize| (step[k] / self.scale[k]).abs();
                    of(a).total_cmp(&of(b))
                })
                .unwrap_or(0);
            if length <= SMALL_STEP {
                return Ok(());
            }
            let mut share = 1.0;
            let next = loop {
                let mut x = self.x.clone();
                for (&k, step) in self.unknown.iter().zip(&step) {
                    x[k] += share * step;
                }
                let mut after = self.residual(&x);
                self.solve(&lu, &mut after);
                if self.size(&after) < (1.0 - 0.25 * share) * length {
                    break Some(x);
                }
                share *= 0.5;
                if share < 1e-4 {
                    break None;
                }
            };
            match next {
                Some(x) => self.x = x,
                // Nothing but rounding is left.
                None if length < 1e-9 => return Ok(()),
                None => break,
            }
        }
        Err(self.name(self.unknown[worst]))
    }

    fn name(&self, k: usize) -> String {
        if k < L * STATES {
            LIFT_STATES[k % STATES].name.to_string()
        } else {
            format!("effect state {}", k - L * STATES)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sign_change_is_found_to_its_roundings_in_few_steps() {
        let steps = std::cell::Cell::new(0);
        type Case = (fn(f64) -> f64, f64, usize);
        let functions: [Case; 4] = [
            (|x| x * x - 2.0, 2f64.sqrt(), 16),
            (|x| x - 1e-6, 1e-6, 16),
            (|x| if x < 1.7 { -1.0 } else { 1.0 }, 1.7, 60),
            (|x| (x - 1.9).max(0.0).sqrt() - (1.9 - x).max(0.0).sqrt(), 1.9, 60),
        ];
        for (f, root, most) in functions {
            steps.set(0);
            let found = sign_change(0.0, 2.0, |x| {
                steps.set(steps.get() + 1);
                f(x)
            });
            assert!((found - root).abs() < 4e-15, "{found} is not {root}");
            assert!(steps.get() <= most, "{root}: {} steps", steps.get());
        }
        assert_eq!(sign_change(1.0, 1.0, |_| 0.0), 1.0);
    }
}
