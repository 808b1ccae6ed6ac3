//! The whole controller: the reference, the transition, and both lifts.

use std::borrow::Borrow;

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
pub struct FixedPoint<C> {
    config: C,
    works: [bool; 2],
    state: State,
}

impl<C: Borrow<Config>> FixedPoint<C> {
    /// Before its first tick.
    pub fn new(config: C) -> Self {
        // A lift that has no share of the reference anywhere is never wanted to move: its valve stays shut, whatever
        // its filters hold, and it need not be worked out.
        let works = [0, 1].map(|k| !config.borrow().ratio[k].is_zero());
        FixedPoint { config, works, state: State::default() }
    }
}

impl<C: Borrow<Config> + Send> closed_loop::Controller for FixedPoint<C> {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        self.state.tick_of(self.works, self.config.borrow(), request, reading)
    }
    fn reference(&self) -> [i32; 2] {
        self.state.wanted.map(|speed| rounded(i64::from(speed), self.config.borrow().word.speed()) as i32)
    }
}
