//! Ticks from random states, folded into a digest that the exported C folds as well.
//!
//! One tick that is equal from every state is equality of all runs, by induction; so states are drawn over the whole
//! of their ranges, and not only where runs come by.

use super::config::{Config, INTEGRAL_SHIFT, MOST_PRESSURE, MOST_RESONANCE, MOST_TRIM, PAST, PRESSURE_GUARD};
use super::controller::State;
use super::fixed::{rounded, saturated, truncated, Gain, MOST_SPEED};
use super::lift::LiftState;
use super::numbers::Numbers;
use super::reference::ReferenceState;
use crate::run::closed_loop::Reading;

/// Marsaglia's xorshift (2003) with 64 bits: three lines of C, the same on every machine.
#[derive(Debug, Clone, Copy)]
pub struct Draws(u64);

impl Draws {
    /// A seed other than zero.
    pub fn new(seed: u64) -> Self {
        Draws(seed.max(1))
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// From −most to most; one draw in eight is an end or zero.
    fn around(&mut self, most: i64) -> i64 {
        let drawn = self.next();
        let size = (drawn >> 8) % (2 * most as u64 + 1);
        match drawn & 31 {
            0 => -most,
            1 => most,
            2 | 3 => 0,
            _ => size as i64 - most,
        }
    }

    /// From 0 to most.
    fn up_to(&mut self, most: i64) -> i64 {
        let around = self.around(most);
        if around < 0 {
            -around
        } else {
            around
        }
    }

    fn word(&mut self) -> i32 {
        self.around(i64::from(i32::MAX)) as i32
    }

    /// A state within the ranges that ticks keep.
    pub fn state(&mut self, config: &Config) -> State {
        let most = i64::from(config.request_most);
        let (smooth, early) = (self.up_to(most), [self.up_to(most), self.up_to(most)]);
        let reference = ReferenceState { ramp: self.up_to(most), smooth, early };
        let wanted = [self.up_to(most), self.up_to(most)];
        let mut lift = || LiftState {
            started: i64::from(self.next() & 15 != 0),
            position: i64::from(self.word()),
            pressure: self.up_to(MOST_PRESSURE),
            speed: self.around(MOST_SPEED),
            asked: std::array::from_fn(|_| self.up_to(most)),
            references: std::array::from_fn(|_| self.up_to(most)),
            corrections: std::array::from_fn(|_| self.around(MOST_SPEED)),
            oldest: (self.next() % PAST as u64) as u32,
            error: self.around(MOST_SPEED),
            integral: self.around(MOST_SPEED << INTEGRAL_SHIFT),
            trim: self.around(MOST_TRIM),
            mean: self.up_to(MOST_PRESSURE << PRESSURE_GUARD),
            cosine: self.around(MOST_RESONANCE << PRESSURE_GUARD),
            sine: self.around(MOST_RESONANCE << PRESSURE_GUARD),
        };
        let lifts = [lift(), lift()];
        State { reference, wanted, lifts }
    }

    /// A request and a reading, near the state's own as often as anywhere.
    pub fn reading(&mut self, state: &State) -> (i32, Reading) {
        let request = if self.next() & 1 == 0 { self.up_to(1000) as i32 } else { self.word() };
        let mut reading = Reading::default();
        for k in 0..2 {
            let near = (state.lifts[k].position as i32).wrapping_add(self.around(80) as i32);
            reading.position[k] = if self.next() & 3 == 0 { self.word() } else { near };
            reading.pressure[k] = if self.next() & 3 == 0 { self.word() } else { self.up_to(MOST_PRESSURE) as i32 };
        }
        reading.temperature = if self.next() & 3 == 0 { self.word() } else { self.around(200) as i32 };
        (request, reading)
    }
}

/// FNV-1a (Fowler, Noll & Vo) by whole words.
fn fold(digest: u64, value: i64) -> u64 {
    (digest ^ value as u64).wrapping_mul(0x100_0000_01b3)
}

/// All of a state and the currents, folded into a digest.
fn folded(mut digest: u64, state: &State, current: [i64; 2]) -> u64 {
    let mut add = |value: i64| digest = fold(digest, value);
    let reference = &state.reference;
    for value in [reference.ramp, reference.smooth].into_iter().chain(reference.early).chain(state.wanted) {
        add(value);
    }
    for lift in &state.lifts {
        [lift.started, lift.position, lift.pressure, lift.speed].into_iter().for_each(&mut add);
        for ring in [&lift.asked, &lift.references, &lift.corrections] {
            ring.iter().copied().for_each(&mut add);
        }
        add(i64::from(lift.oldest));
        [lift.error, lift.integral, lift.trim, lift.mean, lift.cosine, lift.sine].into_iter().for_each(&mut add);
    }
    current.into_iter().for_each(add);
    digest
}

/// The digest of `ticks` ticks, each from a state drawn anew, a request and a reading.
pub fn digest(config: &Config, seed: u64, ticks: u64) -> u64 {
    let (mut draws, numbers) = (Draws::new(seed), Numbers::complete([config]));
    let mut digest = 0xcbf2_9ce4_8422_2325;
    for _ in 0..ticks {
        let mut state = draws.state(config);
        let (request, reading) = draws.reading(&state);
        let current = state.tick_of(&numbers, i64::from(request), &reading.whole());
        digest = folded(digest, &state, current);
    }
    digest
}

/// What the controller's arithmetic is made of, each a function of two 16-bit arguments, or of one of 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Helper {
    /// A gain's mantissa times x, at a shift.
    Times(u32),
    /// x of 32 bits at a shift.
    Rounded(u32),
    Truncated(u32),
    /// x within ±most.
    Saturated,
    /// A lift's speed table at x of 32 bits.
    Table(usize),
}

impl Helper {
    fn answer(self, config: &Config, upper: i64, lower: i64) -> i64 {
        match self {
            Helper::Times(shift) => Gain { mantissa: upper as i32, shift }.times(lower),
            Helper::Rounded(shift) => rounded(upper * 65536 + lower, shift),
            Helper::Truncated(shift) => truncated(upper * 65536 + lower, shift),
            Helper::Saturated => saturated(upper, lower.abs()),
            Helper::Table(lift) => config.lifts[lift].table.at(upper * 65536 + lower),
        }
    }
}

/// The digest of a helper's answers to every lower argument of 16 bits with the upper ones of a range, in order.
pub fn helper_digest(config: &Config, helper: Helper, upper: std::ops::Range<i64>) -> u64 {
    let mut digest = 0xcbf2_9ce4_8422_2325;
    for upper in upper {
        for lower in i64::from(i16::MIN)..=i64::from(i16::MAX) {
            digest = fold(digest, helper.answer(config, upper, lower));
        }
    }
    digest
}
