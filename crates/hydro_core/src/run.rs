//! A run: a truck under recorded or generated inputs, read at given times.

use crate::dual::Dual;
use crate::effects::StateSpec;
use crate::error::Error;
use crate::mast::{Extended, LiftName, Mast, Physics, Thesis, LIFT_STATES, STATES};
use crate::scalar::Scalar;
use crate::solver::fixed::{valve_steps, Fixed};
use crate::solver::radau::{Radau, System};
use crate::solver::statistics::Statistics;
use crate::truck::Truck;

/// Inputs of a run, each held from its time until the next.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// Strictly increasing [s].
    pub time: &'a [f64],
    /// Free and main command [A] at each time.
    pub command: &'a [[f64; 2]],
    /// Oil temperature [°C] at each time.
    pub oil_temperature_degc: &'a [f64],
    pub load_kg: f64,
}

/// Which integrator, and how finely.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Solver {
    /// [`Radau`] with this tolerance.
    Adaptive { tolerance: f64 },
    /// [`Fixed`] with this many substeps per tick of the command.
    Fixed { substeps: usize },
}

impl Solver {
    pub const DEFAULT_TOLERANCE: f64 = 1e-4;
    pub const DEFAULT_SUBSTEPS: usize = 8;
}

/// Which lifts are simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lifts {
    Both,
    One(LiftName),
}

/// States at the wanted times, row by row, and the work they took.
#[derive(Debug, Clone)]
pub struct Run {
    pub state_names: Vec<String>,
    /// (times, states), row-major.
    pub states: Vec<f64>,
    pub statistics: Statistics,
}

/// Asked now and then; true stops the run with [`Error::Interrupted`].
pub type Interrupt<'a> = &'a dyn Fn() -> bool;

/// Longest run in accepted steps: some hours of lowering at the tightest tolerance.
const STEP_LIMIT: usize = 20_000_000;

/// Simulates `truck` and gives its states at the times `wanted`.
///
/// The state vector is that of [`Mast`]: lift after lift as in [`LIFT_STATES`], then the effects'.
/// `start` replaces the usual start (at rest, [`LiftName::start_position`]).
///
/// # Errors
/// Arguments that do not fit, or a run that the integrator has to give up.
pub fn simulate(
    truck: &Truck,
    lifts: Lifts,
    inputs: &Inputs,
    wanted: &[f64],
    solver: Solver,
    start: Option<&[f64]>,
    interrupt: Interrupt,
) -> Result<Run, Error> {
    check(inputs, wanted, solver)?;
    match lifts {
        Lifts::Both => with_lifts(truck, LiftName::BOTH, inputs, wanted, solver, start, interrupt),
        Lifts::One(lift) => with_lifts(truck, [lift], inputs, wanted, solver, start, interrupt),
    }
}

fn with_lifts<const L: usize>(
    truck: &Truck,
    which: [LiftName; L],
    inputs: &Inputs,
    wanted: &[f64],
    solver: Solver,
    start: Option<&[f64]>,
    interrupt: Interrupt,
) -> Result<Run, Error> {
    let (lifts, effects) = truck.build(which, inputs.load_kg, |_, v| v)?;
    let (dual_lifts, dual_effects) =
        truck.build(which, Direction::constant(inputs.load_kg), |_, v| Direction::constant(v))?;
    let zero = Direction::zero();
    macro_rules! run {
        ($plain:expr, $dual:expr) => {{
            let (plain, dual) = ($plain, $dual);
            let plain = Mast { lifts, physics: plain, command: [0.0; L], oil_temperature_degc: 20.0 };
            let dual = Mast { lifts: dual_lifts, physics: dual, command: [zero; L], oil_temperature_degc: zero };
            let names = state_names(
                &which,
                &effects.iter().map(|(i, ..)| (i.name(), i.kind.spec().states)).collect::<Vec<_>>(),
            );
            let start = start_state(&plain, &which, &names, start)?;
            match solver {
                Solver::Adaptive { tolerance } => {
                    let scale = scales::<L>(effects.iter().flat_map(|(i, ..)| i.kind.spec().states));
                    let mut mast = Differentiable { plain, dual, held: [Held::Free; L], scale, names };
                    adaptive(&mut mast, &which, inputs, wanted, tolerance, &start, interrupt)
                }
                Solver::Fixed { substeps } => fixed(plain, &which, names, inputs, wanted, substeps, &start, interrupt),
            }
        }};
    }
    if effects.is_empty() {
        run!(Thesis, Thesis)
    } else {
        run!(Extended::new(&effects, &lifts), Extended::new(&dual_effects, &dual_lifts))
    }
}

fn check(inputs: &Inputs, wanted: &[f64], solver: Solver) -> Result<(), Error> {
    let n = inputs.time.len();
    let shape = |name: &str, got: usize| Error::Shape {
        name: name.into(),
        got: got.to_string(),
        expected: format!("{n}, one per command time"),
    };
    if n == 0 {
        return Err(Error::Argument {
            name: "command_time".into(),
            value: "empty".into(),
            requirement: "at least one time".into(),
        });
    }
    if inputs.command.len() != n {
        return Err(shape("command", inputs.command.len()));
    }
    if inputs.oil_temperature_degc.len() != n {
        return Err(shape("oil_temperature", inputs.oil_temperature_degc.len()));
    }
    increasing("command_time", inputs.time)?;
    increasing("time", wanted)?;
    let bad = |name: &str, value: f64, requirement: &str| {
        Err(Error::Argument { name: name.into(), value: value.to_string(), requirement: requirement.into() })
    };
    if let Some(&first) = wanted.first().filter(|&&first| first < inputs.time[0]) {
        return bad("time", first, &format!("at or after the first command time, {} s", inputs.time[0]));
    }
    if let Some(&value) = inputs.command.iter().flatten().find(|u| !(-0.1..=5.0).contains(*u)) {
        return bad("command", value, "a current between -0.1 and 5 A");
    }
    if let Some(&value) = inputs.oil_temperature_degc.iter().find(|t| !(-50.0..=150.0).contains(*t)) {
        return bad("oil_temperature", value, "between -50 and 150 degC");
    }
    if !(0.0..=2e4).contains(&inputs.load_kg) {
        return bad("load", inputs.load_kg, "between 0 and 20000 kg");
    }
    match solver {
        Solver::Adaptive { tolerance } if !(1e-12..=1e-1).contains(&tolerance) => {
            bad("tolerance", tolerance, "between 1e-12 and 0.1")
        }
        Solver::Fixed { substeps } if !(1..=1000).contains(&substeps) => {
            bad("substeps", substeps as f64, "between 1 and 1000")
        }
        _ => Ok(()),
    }
}

fn increasing(name: &str, time: &[f64]) -> Result<(), Error> {
    let requirement = "finite and strictly increasing";
    let refuse = |value: f64| {
        Err(Error::Argument { name: name.into(), value: value.to_string(), requirement: requirement.into() })
    };
    if let Some(&value) = time.iter().find(|t| !t.is_finite()) {
        return refuse(value);
    }
    match time.windows(2).find(|pair| pair[1] <= pair[0]) {
        Some(pair) => refuse(pair[1]),
        None => Ok(()),
    }
}

fn state_names(which: &[LiftName], effects: &[(String, &[StateSpec])]) -> Vec<String> {
    let lifts = which.iter().flat_map(|lift| LIFT_STATES.iter().map(move |s| format!("{}.{}", lift.as_str(), s.name)));
    let own = effects.iter().flat_map(|(name, states)| states.iter().map(move |s| format!("{name}.{}", s.name)));
    lifts.chain(own).collect()
}

fn scales<const L: usize>(own: impl Iterator<Item = &'static StateSpec>) -> Vec<f64> {
    (0..L).flat_map(|_| LIFT_STATES.iter()).chain(own).map(|s| s.scale).collect()
}

fn start_state<X: Physics<f64>, const L: usize>(
    mast: &Mast<f64, X, L>,
    which: &[LiftName; L],
    names: &[String],
    start: Option<&[f64]>,
) -> Result<Vec<f64>, Error> {
    if let Some(start) = start {
        if start.len() != mast.dim() {
            return Err(Error::Shape {
                name: "start".into(),
                got: start.len().to_string(),
                expected: format!("{}, one per state", mast.dim()),
            });
        }
        return match start.iter().position(|x| !x.is_finite()) {
            None => Ok(start.to_vec()),
            Some(k) => Err(Error::Argument {
                name: format!("start, {}", names[k]),
                value: start[k].to_string(),
                requirement: "finite".into(),
            }),
        };
    }
    let mut x = vec![0.0; mast.dim()];
    for (k, &lift) in which.iter().enumerate() {
        let stop = mast.lifts[k].stop;
        let position = lift.start_position().clamp_to(stop.lower, stop.upper);
        mast.lifts[k].at_rest(position).write(&mut x[k * STATES..(k + 1) * STATES]);
    }
    Ok(x)
}

/// Derivatives are taken along a few states at once; nine is one lift.
type Direction = Dual<f64, STATES>;

/// The mast as the adaptive integrator sees it: rates in `f64`, Jacobians through dual numbers.
struct Differentiable<X, Y, const L: usize> {
    plain: Mast<f64, X, L>,
    dual: Mast<Direction, Y, L>,
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

/// Places of position and velocity among a lift's states.
const POSITION: usize = 3;
const VELOCITY: usize = 4;
/// An acceleration away from a stop [m/s²] that releases a lift is compared with a depth [m] times this.
const RELEASE_PER_DEPTH: f64 = 1e4;

impl<X: Physics<f64>, Y: Physics<Direction>, const L: usize> Differentiable<X, Y, L> {
    fn set_inputs(&mut self, command: [f64; L], oil_temperature_degc: f64) {
        self.plain.set_inputs(command, oil_temperature_degc);
        self.dual.set_inputs(command.map(Direction::constant), Direction::constant(oil_temperature_degc));
    }
}

impl<X: Physics<f64>, Y: Physics<Direction>, const L: usize> System for Differentiable<X, Y, L> {
    fn dim(&self) -> usize {
        self.plain.dim()
    }
    fn rates(&self, _t: f64, x: &[f64], dx: &mut [f64]) {
        self.plain.rates(x, dx);
        for k in (0..L).filter(|&k| self.held[k] != Held::Free) {
            dx[k * STATES + POSITION] = 0.0;
            dx[k * STATES + VELOCITY] = 0.0;
        }
    }
    fn jacobian(&self, _t: f64, x: &[f64], jacobian: &mut [f64]) {
        jacobian_by_duals::<STATES>(x, jacobian, |x, dx| self.dual.rates(x, dx));
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

impl<X: Physics<f64>, Y: Physics<Direction>, const L: usize> Differentiable<X, Y, L> {
    /// The acceleration lift `k` would have without a stop [m/s²].
    fn acceleration(&self, x: &[f64], k: usize) -> f64 {
        let mut dx = vec![0.0; x.len()];
        self.plain.rates(x, &mut dx);
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

fn commands_of<const L: usize>(which: &[LiftName; L], both: [f64; 2]) -> [f64; L] {
    which.map(|lift| both[usize::from(lift == LiftName::Main)])
}

fn adaptive<X: Physics<f64>, Y: Physics<Direction>, const L: usize>(
    mast: &mut Differentiable<X, Y, L>,
    which: &[LiftName; L],
    inputs: &Inputs,
    wanted: &[f64],
    tolerance: f64,
    start: &[f64],
    interrupt: Interrupt,
) -> Result<Run, Error> {
    let n = mast.dim();
    let mut states = vec![0.0; wanted.len() * n];
    let held = |mast: &mut Differentiable<X, Y, L>, k: usize| {
        mast.set_inputs(commands_of(which, inputs.command[k]), inputs.oil_temperature_degc[k]);
    };
    held(mast, 0);
    let mut radau = Radau::new(mast, inputs.time[0], start, tolerance, STEP_LIMIT);
    let mut next = 0;
    if wanted.first() == Some(&inputs.time[0]) {
        states[..n].copy_from_slice(start);
        next = 1;
    }
    let Some(&end) = wanted.last() else {
        return Ok(Run { state_names: mast.names.clone(), states, statistics: radau.statistics });
    };
    let mut k = 0;
    while radau.t < end {
        // The inputs stay until the next time at which one of them differs.
        let same = |j: &usize| {
            inputs.command[*j] == inputs.command[k] && inputs.oil_temperature_degc[*j] == inputs.oil_temperature_degc[k]
        };
        let jump = (k + 1..inputs.time.len()).find(|j| !same(j));
        let until = jump.map_or(end, |j| inputs.time[j].min(end));
        radau.advance(mast, until, |step| {
            while next < wanted.len() && wanted[next] <= step.to {
                step.at(wanted[next], &mut states[next * n..(next + 1) * n]);
                next += 1;
            }
            if interrupt() {
                return Err(Error::Interrupted { time_s: step.to });
            }
            Ok(())
        })?;
        if let Some(j) = jump.filter(|_| radau.t < end) {
            k = j;
            held(mast, k);
            radau.inputs_changed(mast);
            radau.statistics.stops += 1;
        }
    }
    Ok(Run { state_names: mast.names.clone(), states, statistics: radau.statistics })
}

#[allow(clippy::too_many_arguments)] // the parts of one run, used once
fn fixed<X: Physics<f64>, const L: usize>(
    mast: Mast<f64, X, L>,
    which: &[LiftName; L],
    names: Vec<String>,
    inputs: &Inputs,
    wanted: &[f64],
    substeps: usize,
    start: &[f64],
    interrupt: Interrupt,
) -> Result<Run, Error> {
    let n = mast.dim();
    let mut states = vec![0.0; wanted.len() * n];
    let grid = Grid::new(inputs.time, substeps);
    let fastest = mast.lifts.iter().fold(0.0, |rate: f64, lift| rate.max(lift.valve.fastest_rate()));
    let mut fixed = Fixed::new(mast, start, grid.h, valve_steps(fastest, grid.h));
    let (mut before, mut after) = (start.to_vec(), start.to_vec());
    let (mut next, mut held, mut j) = (0, None, 0usize);
    while next < wanted.len() {
        let t = grid.time(j);
        while next < wanted.len() && wanted[next] <= t + grid.slack() {
            let theta = if j == 0 { 1.0 } else { ((wanted[next] - grid.time(j - 1)) / grid.h).min(1.0) };
            let row = &mut states[next * n..(next + 1) * n];
            for ((row, a), b) in row.iter_mut().zip(&before).zip(&after) {
                *row = if theta == 1.0 { *b } else { a + theta * (b - a) };
            }
            next += 1;
        }
        let k = grid.input_at(j, held.unwrap_or(0));
        if held != Some(k) {
            held = Some(k);
            fixed.mast.set_inputs(commands_of(which, inputs.command[k]), inputs.oil_temperature_degc[k]);
        }
        std::mem::swap(&mut before, &mut after);
        fixed.substep();
        fixed.write(&mut after);
        j += 1;
        if let Some(worst) = after.iter().position(|x| !x.is_finite()) {
            return Err(Error::NotFinite { time_s: grid.time(j), worst_state: names[worst].clone() });
        }
        if j.is_multiple_of(256) && interrupt() {
            return Err(Error::Interrupted { time_s: t });
        }
    }
    let statistics = Statistics { steps: j, newton_iterations: fixed.pair_iterations, ..Statistics::default() };
    Ok(Run { state_names: names, states, statistics })
}

/// The uniform grid of the fixed-step path, laid over a clock that may jitter.
struct Grid<'a> {
    time: &'a [f64],
    h: f64,
}

impl<'a> Grid<'a> {
    /// The tick is the median distance of the command times (20 ms if there is one only).
    fn new(time: &'a [f64], substeps: usize) -> Self {
        let mut ticks: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        ticks.sort_by(f64::total_cmp);
        let tick = ticks.get(ticks.len() / 2).copied().unwrap_or(0.02);
        Grid { time, h: tick / substeps as f64 }
    }

    fn time(&self, j: usize) -> f64 {
        self.time[0] + j as f64 * self.h
    }

    /// Times this close count as the same.
    fn slack(&self) -> f64 {
        1e-6 * self.h
    }

    /// Which inputs hold on the substep after grid point `j`: the last whose time lies less than
    /// half a substep ahead.
    fn input_at(&self, j: usize, mut k: usize) -> usize {
        let t = self.time(j);
        while k + 1 < self.time.len() && self.time[k + 1] < t + 0.5 * self.h {
            k += 1;
        }
        k
    }
}
