//! The whole controller: the reference, the transition, and both lifts.

use super::config::Config;
use super::fixed::{clamped, rounded};
use super::lift::{LiftReading, LiftState};
use super::reference::ReferenceState;
use crate::run::closed_loop::{self, Reading};

/// Everything a controller remembers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct State {
    pub reference: ReferenceState,
    /// What the last tick meant the lifts to have [speed].
    pub wanted: [i32; 2],
    pub lifts: [LiftState; 2],
}

impl State {
    /// One tick: the valves' currents [mA].
    pub fn tick(&mut self, config: &Config, request: i32, reading: &Reading) -> [i32; 2] {
        self.tick_of([true; 2], config, request, reading)
    }

    /// The same of some lifts only; the others' states stand still and their valves stay shut.
    #[inline(always)]
    pub fn tick_of(&mut self, lifts: [bool; 2], config: &Config, request: i32, reading: &Reading) -> [i32; 2] {
        let height = i64::from(reading.position[0]) + 2 * i64::from(reading.position[1]);
        let shares = self.reference.tick(config, request, height);
        self.wanted = shares.wanted;
        let (least, most) = (i64::from(config.temperature_least), i64::from(config.temperature_most));
        let temperature = clamped(i64::from(reading.temperature), least, most) as i32;
        [0, 1].map(|k| {
            if !lifts[k] {
                return 0;
            }
            let own = LiftReading { position: reading.position[k], pressure: reading.pressure[k], temperature };
            self.lifts[k].tick(&config.lifts[k], config.word, shares.asked[k], &own)
        })
    }
}

/// A configuration with the state of one truck.
#[derive(Debug, Clone)]
pub struct FixedPoint<'a> {
    pub config: &'a Config,
    pub state: State,
}

impl<'a> FixedPoint<'a> {
    /// Before its first tick.
    pub fn new(config: &'a Config) -> Self {
        FixedPoint { config, state: State::default() }
    }
}

impl closed_loop::Controller for FixedPoint<'_> {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        self.state.tick(self.config, request, reading)
    }
    fn reference(&self) -> [i32; 2] {
        self.state.wanted.map(|speed| rounded(i64::from(speed), self.config.word.speed()) as i32)
    }
}
