//! A run with fixed substeps, over any scalar, whatever gives it its commands.

use super::drive::Drive;
use super::{Inputs, Interrupt};
use crate::error::Error;
use crate::mast::{Mast, Physics};
use crate::scalar::{Mask, Scalar};
use crate::solver::fixed::{Fixed, ValveRates, ValveSteps};
use crate::solver::statistics::Statistics;
use crate::solver::vectors::Work;

/// The uniform grid of the substeps, laid over a clock that may jitter.
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

    /// The grid point from which on the inputs `k` hold: where [`Grid::input_at`] finds them first.
    fn holds_from(&self, k: usize) -> f64 {
        ((self.time[k] - self.time[0]) / self.h - 0.5).floor() + 1.0
    }
}

/// How long a substep is [s].
pub(super) fn substep_s(time: &[f64], substeps: usize) -> f64 {
    Grid::new(time, substeps).h
}

/// The means over the substep after grid point `j`, on which the inputs `k` hold, of commands that come late.
///
/// A command that jumped before, and whose delay is not over, counts with its share of the substep: exact for any
/// delay, and so is the derivative, at none as well.
fn late<S: Scalar, const L: usize>(
    drive: &dyn Drive<S, L>,
    grid: &Grid,
    (j, k): (usize, usize),
    delays: &[S; L],
) -> [S; L] {
    let of = |k: usize| drive.command(k);
    let mut mean = of(k);
    for (place, mean) in mean.iter_mut().enumerate() {
        let substeps = delays[place] * S::constant(1.0 / grid.h);
        let longest = substeps.largest();
        let mut k = k;
        while k > 0 {
            let left = S::constant(grid.holds_from(k) - j as f64) + substeps;
            if grid.holds_from(k) - (j as f64) + longest < 0.0 {
                break;
            }
            // At no delay the share is 0, and grows with it.
            let share = S::select(left.lt(S::zero()), S::zero(), S::select(S::one().lt(left), S::one(), left));
            *mean = *mean + share * (of(k - 1)[place] - of(k)[place]);
            k -= 1;
        }
    }
    mean
}

/// When a run's inputs change, and how warm the oil is then.
#[derive(Debug, Clone, Copy)]
pub struct Clock<'a> {
    /// Strictly increasing [s]; each is a tick.
    pub time: &'a [f64],
    /// [°C] at each of them.
    pub oil_temperature_degc: &'a [f64],
}

impl<'a> From<&Inputs<'a>> for Clock<'a> {
    fn from(inputs: &Inputs<'a>) -> Self {
        Clock { time: inputs.time, oil_temperature_degc: inputs.oil_temperature_degc }
    }
}

/// How much warmer the oil is than recorded [K]: a sensor that lags reads right where oil and tank have stood still,
/// at the start, and falls behind from there.
#[derive(Debug, Clone, Copy)]
pub struct Warmer<S> {
    /// At the start of the run.
    pub by: S,
    /// How much more until its end, evenly; none where the oil warms no more than recorded.
    pub warming: Option<S>,
}

impl<S: Scalar> Warmer<S> {
    /// As recorded.
    pub fn none() -> Self {
        Warmer { by: S::zero(), warming: None }
    }

    /// The oil temperature [°C] from the `k`-th tick on.
    #[inline(always)]
    pub fn at(&self, clock: &Clock, k: usize) -> S {
        let now = S::constant(clock.oil_temperature_degc[k]) + self.by;
        let Some(warming) = self.warming else { return now };
        let (first, last) = (clock.time[0], clock.time[clock.time.len() - 1]);
        let from_start = if first < last { (clock.time[k] - first) / (last - first) } else { 0.0 };
        now + warming * S::constant(from_start)
    }

    /// Whether it is the same at two ticks.
    #[inline(always)]
    fn stays(&self, clock: &Clock, j: usize, k: usize) -> bool {
        self.warming.is_none() && clock.oil_temperature_degc[j] == clock.oil_temperature_degc[k]
    }
}

/// How warm the oil is at each tick [°C].
#[derive(Debug, Clone, Copy)]
pub enum Oil<'a, S> {
    /// As the clock has it, and so much warmer.
    Warmer(Warmer<S>),
    /// Of lanes that each have a recording of their own.
    Each(&'a [S]),
}

impl<S: Scalar> Oil<'_, S> {
    #[inline(always)]
    fn at(&self, clock: &Clock, k: usize) -> S {
        match self {
            Oil::Warmer(warmer) => warmer.at(clock, k),
            Oil::Each(each) => each[k],
        }
    }

    /// Whether it is known to be the same at two ticks.
    #[inline(always)]
    fn stays(&self, clock: &Clock, j: usize, k: usize) -> bool {
        match self {
            Oil::Warmer(warmer) => warmer.stays(clock, j, k),
            Oil::Each(each) => !each[j].lt(each[k]).or(each[k].lt(each[j])).any(),
        }
    }
}

/// A mast to be run through its ticks; `record` is shown the state vector at each wanted time.
pub struct Ticks<'a, S, X, const L: usize> {
    pub mast: Mast<S, X, L>,
    pub drive: &'a mut dyn Drive<S, L>,
    pub clock: Clock<'a>,
    pub oil: Oil<'a, S>,
    pub start: &'a [S],
    /// Rising [s].
    pub wanted: &'a [f64],
    /// In each tick.
    pub substeps: usize,
    /// Is shown the place among `wanted` and the state vector.
    pub record: &'a mut dyn FnMut(usize, &[S]),
    /// Of lanes: whether the run goes on while one of them is still finite. Else the first state that is not ends it.
    pub carry_on: bool,
    pub interrupt: Interrupt<'a>,
}

/// What is done between the substeps of a run.
pub trait Between<S, X, const L: usize> {
    /// Told the time in the middle of the coming substep [s]; true where it has changed the states.
    fn before(&mut self, middle_s: f64, fixed: &mut Fixed<S, X, L>) -> bool;
}

/// Nothing.
impl<S, X, const L: usize> Between<S, X, L> for () {
    #[inline(always)]
    fn before(&mut self, _middle_s: f64, _fixed: &mut Fixed<S, X, L>) -> bool {
        false
    }
}

impl<S: Scalar, X: Physics<S>, const L: usize> Work for Ticks<'_, S, X, L> {
    type Number = S;
    /// The work done, or the time [s] and the place of the state that ceased to be finite.
    type Output = Result<Statistics, Stopped>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.through(())
    }
}

/// A run with something done between its substeps.
pub struct Pausing<'a, S, X, const L: usize, B> {
    pub ticks: Ticks<'a, S, X, L>,
    pub between: B,
}

impl<S: Scalar, X: Physics<S>, const L: usize, B: Between<S, X, L>> Work for Pausing<'_, S, X, L, B> {
    type Number = S;
    type Output = Result<Statistics, Stopped>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.ticks.through(self.between)
    }
}

impl<S: Scalar, X: Physics<S>, const L: usize> Ticks<'_, S, X, L> {
    #[inline(always)]
    fn through(self, mut between: impl Between<S, X, L>) -> Result<Statistics, Stopped> {
        let grid = Grid::new(self.clock.time, self.substeps);
        let rates = self.mast.lifts.iter().fold(ValveRates::default(), |rates, lift| rates.with(&lift.valve));
        let oil_at = |k: usize| self.oil.at(&self.clock, k);
        let delays = self.mast.physics.delays();
        // The rates at the start are those under the first inputs.
        let mut at = grid.input_at(0, 0);
        for tick in 0..=at {
            self.drive.tick(tick, self.start, oil_at(tick));
        }
        let mut mast = self.mast;
        mast.set_inputs(self.drive.command(at), oil_at(at));
        let mut fixed = Fixed::new(mast, self.start, grid.h, ValveSteps::of(rates, grid.h));
        let (mut before, mut after) = (self.start.to_vec(), self.start.to_vec());
        let mut row = after.clone();
        let (mut next, mut j) = (0, 0usize);
        while next < self.wanted.len() {
            let t = grid.time(j);
            while next < self.wanted.len() && self.wanted[next] <= t + grid.slack() {
                let theta = if j == 0 { 1.0 } else { (self.wanted[next] - grid.time(j - 1)) / grid.h };
                if theta >= 1.0 - 1e-6 {
                    (self.record)(next, &after);
                } else {
                    for ((row, &a), &b) in row.iter_mut().zip(&before).zip(&after) {
                        *row = a + S::constant(theta) * (b - a);
                    }
                    (self.record)(next, &row);
                }
                next += 1;
            }
            let k = grid.input_at(j, at);
            if at != k {
                for tick in at + 1..=k {
                    self.drive.tick(tick, &after, oil_at(tick));
                }
                match self.oil.stays(&self.clock, at, k) {
                    true => fixed.mast.command = self.drive.command(k),
                    false => fixed.mast.set_inputs(self.drive.command(k), oil_at(k)),
                }
                at = k;
            }
            if let Some(delays) = &delays {
                fixed.mast.command = late(self.drive, &grid, (j, k), delays);
            }
            if between.before(t + 0.5 * grid.h, &mut fixed) {
                fixed.write(&mut after);
            }
            std::mem::swap(&mut before, &mut after);
            fixed.mast.physics.at_time(t + 0.5 * grid.h);
            let then = grid.input_at(j + 1, at);
            let following = match then == at {
                true => Some(fixed.mast.command),
                false => self.drive.known_ahead().then(|| self.drive.command(then)),
            };
            fixed.substep(following);
            fixed.write(&mut after);
            j += 1;
            let mut fine = after[0].is_finite();
            for x in &after[1..] {
                fine = fine.and(x.is_finite());
            }
            if fine.not().any() {
                let gone = |x: &S| match self.carry_on {
                    true => !x.is_finite().any(),
                    false => x.is_finite().not().any(),
                };
                if let Some(state) = after.iter().position(gone) {
                    return Err(Stopped::NotFinite { time_s: grid.time(j), state });
                }
            }
            if j.is_multiple_of(256) && (self.interrupt)() {
                return Err(Stopped::Interrupted { time_s: t });
            }
        }
        Ok(Statistics { steps: j, newton_iterations: fixed.pair_iterations, ..Statistics::default() })
    }
}

/// Why a run ended early.
#[derive(Debug, Clone, Copy)]
pub enum Stopped {
    NotFinite { time_s: f64, state: usize },
    Interrupted { time_s: f64 },
}

impl Stopped {
    pub fn error(self, names: &[String]) -> Error {
        match self {
            Stopped::NotFinite { time_s, state } => Error::NotFinite { time_s, worst_state: names[state].clone() },
            Stopped::Interrupted { time_s } => Error::Interrupted { time_s },
        }
    }
}
