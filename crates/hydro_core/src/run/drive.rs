//! What gives a run its commands: a recording, or a controller that reads the sensors.

use super::{commands_of, Inputs};
use crate::mast::LiftName;
use crate::scalar::Scalar;

/// Where the commands of a run come from.
///
/// A run begins its ticks in order, each exactly once, and may ask for the command of every tick that has begun: what
/// comes late (an effect between command and valve) looks back.
pub trait Drive<S: Scalar, const L: usize> {
    /// Whether the commands of ticks that have not begun can be asked for as well.
    fn known_ahead(&self) -> bool;
    /// Tick `k` begins, with the mast in state `x` and the oil at a temperature [°C].
    fn tick(&mut self, k: usize, x: &[S], oil_temperature_degc: S);
    /// The commands [A] that hold from tick `k` to the next.
    fn command(&self, k: usize) -> [S; L];
}

/// Recorded commands, the same in every lane.
#[derive(Debug, Clone, Copy)]
pub struct Replay<'a, const L: usize> {
    which: [LiftName; L],
    command: &'a [[f64; 2]],
}

impl<'a, const L: usize> Replay<'a, L> {
    /// Those of the lifts `which`.
    pub fn new(which: [LiftName; L], inputs: &Inputs<'a>) -> Self {
        Replay { which, command: inputs.command }
    }
}

impl<S: Scalar, const L: usize> Drive<S, L> for Replay<'_, L> {
    fn known_ahead(&self) -> bool {
        true
    }
    fn tick(&mut self, _k: usize, _x: &[S], _oil_temperature_degc: S) {}
    fn command(&self, k: usize) -> [S; L] {
        commands_of(&self.which, self.command[k]).map(S::constant)
    }
}
