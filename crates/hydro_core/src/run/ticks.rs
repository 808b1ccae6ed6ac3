//! A run with fixed substeps, over any scalar.

use super::{commands_of, Inputs, Interrupt};
use crate::error::Error;
use crate::mast::{LiftName, Mast, Physics};
use crate::scalar::{Mask, Scalar};
use crate::solver::fixed::{valve_steps, Fixed};
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
}

/// Commands [A] and oil temperature [°C] of the `k`-th row of the inputs.
pub(super) fn held<S: Scalar, const L: usize>(
    which: &[LiftName; L],
    inputs: &Inputs,
    warmer: S,
    k: usize,
) -> ([S; L], S) {
    let command = commands_of(which, inputs.command[k]).map(S::constant);
    (command, S::constant(inputs.oil_temperature_degc[k]) + warmer)
}

/// A mast to be run through its inputs; `record` is shown the state vector at each wanted time.
pub(super) struct Ticks<'a, S, X, R, const L: usize> {
    pub mast: Mast<S, X, L>,
    pub which: &'a [LiftName; L],
    pub inputs: &'a Inputs<'a>,
    /// Added to the recorded oil temperature [°C].
    pub warmer: S,
    pub start: &'a [S],
    pub wanted: &'a [f64],
    pub substeps: usize,
    pub record: R,
    pub interrupt: Interrupt<'a>,
}

impl<S, X, R, const L: usize> Work for Ticks<'_, S, X, R, L>
where
    S: Scalar,
    X: Physics<S>,
    R: FnMut(usize, &[S]),
{
    type Number = S;
    /// The work done, or the time [s] and the place of the state that ceased to be finite.
    type Output = Result<Statistics, Stopped>;

    #[inline(always)]
    fn run(mut self) -> Self::Output {
        let grid = Grid::new(self.inputs.time, self.substeps);
        let fastest = self.mast.lifts.iter().fold(S::zero(), |rate, lift| rate.max(lift.valve.fastest_rate()));
        let held_on = |k: usize| held(self.which, self.inputs, self.warmer, k);
        // The rates at the start are those under the first inputs.
        let mut at = grid.input_at(0, 0);
        let (command, temperature) = held_on(at);
        self.mast.set_inputs(command, temperature);
        let mut fixed = Fixed::new(self.mast, self.start, grid.h, valve_steps(fastest.largest(), grid.h));
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
                at = k;
                let (command, temperature) = held_on(k);
                fixed.mast.set_inputs(command, temperature);
            }
            std::mem::swap(&mut before, &mut after);
            fixed.mast.physics.at_time(t + 0.5 * grid.h);
            fixed.substep();
            fixed.write(&mut after);
            j += 1;
            if let Some(state) = after.iter().position(|x| x.is_finite().not().any()) {
                return Err(Stopped::NotFinite { time_s: grid.time(j), state });
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
pub(super) enum Stopped {
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
