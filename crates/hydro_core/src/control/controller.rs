//! The whole controller: the reference, the transition, and both lifts.

use std::borrow::Borrow;

use super::config::Config;
use super::fixed::{clamped, rounded, SPEED_SHIFT};
use super::lift::{LiftReading, LiftState};
use super::numbers::Numbers;
use super::reference::ReferenceState;
use crate::integer::Integer;
use crate::run::closed_loop::{self, Reading};

/// Everything a controller remembers: of one truck, or of one in each lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct State<I = i64> {
    pub reference: ReferenceState<I>,
    /// What the last tick meant the lifts to have [speed].
    pub wanted: [I; 2],
    pub lifts: [LiftState<I>; 2],
}

impl State {
    /// One tick with everything that a controller does: the valves' currents [mA].
    ///
    /// This is the reference, of which the C of `c/` is the image.
    pub fn tick(&mut self, config: &Config, request: i32, reading: &Reading) -> [i32; 2] {
        self.tick_of(&Numbers::complete([config]), i64::from(request), &reading.whole()).map(|current| current as i32)
    }
}

impl<I: Integer> State<I> {
    /// Before the first tick.
    pub fn at_rest() -> Self {
        State { reference: ReferenceState::at_rest(), wanted: [I::zero(); 2], lifts: [LiftState::at_rest(); 2] }
    }

    /// One tick with the parts that the numbers have: the valves' currents [mA]. The state of a lift that does not work
    /// stands still and its valve stays shut.
    #[inline(always)]
    pub fn tick_of(&mut self, numbers: &Numbers<I>, request: I, reading: &Reading<I>) -> [I; 2] {
        let height = reading.position[0] + reading.position[1].shl(1);
        let shares = self.reference.tick(numbers, request, height);
        self.wanted = shares.wanted;
        let temperature = clamped(reading.temperature, numbers.temperature_least, numbers.temperature_most);
        let mut current = [I::zero(); 2];
        for k in 0..2 {
            if numbers.lifts[k].parts.works {
                let own = LiftReading { position: reading.position[k], pressure: reading.pressure[k], temperature };
                current[k] = self.lifts[k].tick(&numbers.lifts[k], shares.asked[k], &own);
            }
        }
        current
    }

    /// The lowering speeds of the forks [mm/s] that the last tick meant the lifts to have.
    #[inline(always)]
    pub fn meant(&self) -> [I; 2] {
        let [free, main] = self.wanted;
        [rounded(free, SPEED_SHIFT), rounded(main, SPEED_SHIFT)]
    }
}

/// A configuration with the state of one truck.
#[derive(Debug, Clone)]
pub struct FixedPoint<C> {
    config: C,
    /// From the first tick on: lanes that run together never need them.
    begun: Option<Box<(Numbers<i64>, State)>>,
}

impl<C: Borrow<Config>> FixedPoint<C> {
    /// Before its first tick.
    pub fn new(config: C) -> Self {
        FixedPoint { config, begun: None }
    }
}

impl<C: Borrow<Config> + Send> closed_loop::Controller for FixedPoint<C> {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        let at_rest = || Box::new((Numbers::of([self.config.borrow()]), State::at_rest()));
        let (numbers, state) = &mut **self.begun.get_or_insert_with(at_rest);
        state.tick_of(numbers, i64::from(request), &reading.whole()).map(|current| current as i32)
    }
    fn reference(&self) -> [i32; 2] {
        self.begun.as_ref().map_or([0, 0], |begun| begun.1.meant().map(|speed| speed as i32))
    }
    fn in_integers(&self) -> Option<&Config> {
        self.begun.is_none().then(|| self.config.borrow())
    }
}
