//! The controller in floating point: the same equations without a scale, to measure what the integers cost.
//!
//! It reads its numbers from the integers of a configuration, so that only the arithmetic differs.

use super::config::{
    Config, LiftConfig, LEARNING_SHIFT, LEAST_REFERENCE, MEAN_SHIFT, PAST, PRESSURE_GUARD, SHAPER_SHIFT,
    TEMPERATURE_GUARD, TRIM_SHIFT,
};
use super::fixed::{two_to, CURRENT_SHIFT, FACTOR_SHIFT, SPEED_SHIFT};
use super::table::Table;
use crate::run::closed_loop::{Controller, Reading};

#[derive(Debug, Clone, Copy, Default)]
struct LiftTwin {
    started: bool,
    position: f64,
    pressure: f64,
    speed: f64,
    asked: [f64; PAST],
    references: [f64; PAST],
    corrections: [f64; PAST],
    oldest: usize,
    error: f64,
    integral: f64,
    trim: f64,
    mean: f64,
    cosine: f64,
    sine: f64,
}

/// The whole controller, in mm/s and mA.
#[derive(Debug, Clone)]
pub struct FloatingPoint<'a> {
    config: &'a Config,
    ramp: f64,
    smooth: f64,
    early: [f64; 2],
    wanted: [f64; 2],
    lifts: [LiftTwin; 2],
}

/// A table at an x of its own scale.
fn at(table: &Table, x: f64) -> f64 {
    let last = table.knots.len() - 1;
    let place = ((x - f64::from(table.first)) / two_to(table.spacing)).clamp(0.0, last as f64);
    let k = (place as usize).min(last - 1);
    let (low, high) = (table.knot(k) as f64, table.knot(k + 1) as f64);
    low + (high - low) * (place - k as f64)
}

impl<'a> FloatingPoint<'a> {
    /// Before its first tick.
    pub fn new(config: &'a Config) -> Self {
        let lifts = [LiftTwin::default(); 2];
        FloatingPoint { config, ramp: 0.0, smooth: 0.0, early: [0.0; 2], wanted: [0.0; 2], lifts }
    }
}

impl Controller for FloatingPoint<'_> {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        let config = self.config;
        let (speed, factor) = (two_to(SPEED_SHIFT), two_to(FACTOR_SHIFT));
        let asked = f64::from(request).clamp(0.0, (f64::from(config.request_most) / speed).floor());
        self.ramp += (asked - self.ramp).clamp(-f64::from(config.ramp_down) / speed, f64::from(config.ramp_up) / speed);
        let pole = f64::from(config.ramp_pole) / factor;
        self.smooth = pole * self.smooth + (1.0 - pole) * self.ramp;
        let rests = |state: f64| if state * speed < LEAST_REFERENCE as f64 { 0.0 } else { state };
        let reference = rests(self.smooth);
        let height = f64::from(reading.position[0]) + 2.0 * f64::from(reading.position[1]);
        let (least, most) = (config.temperature_least, config.temperature_most);
        let temperature = f64::from(reading.temperature.clamp(least, most));
        let mut current = [0; 2];
        for k in 0..2 {
            let share = at(&config.ratio[k], height) / factor;
            self.wanted[k] = share * reference;
            let pole = f64::from(config.lifts[k].early_pole) / factor;
            self.early[k] = pole * self.early[k] + (1.0 - pole) * self.ramp;
            let asked = share * rests(self.early[k]);
            let (position, pressure) = (f64::from(reading.position[k]), f64::from(reading.pressure[k]));
            let order = self.lifts[k].tick(&config.lifts[k], asked, position, pressure, temperature);
            current[k] = order.round() as i32;
        }
        current
    }
    fn reference(&self) -> [i32; 2] {
        self.wanted.map(|speed| speed.round() as i32)
    }
}

impl LiftTwin {
    fn tick(&mut self, lift: &LiftConfig, asked: f64, position: f64, pressure: f64, temperature: f64) -> f64 {
        let (speed, factor) = (two_to(SPEED_SHIFT), two_to(FACTOR_SHIFT));
        if !self.started {
            *self = LiftTwin { started: true, position, pressure, mean: pressure, ..*self };
        }
        let raw = f64::from(lift.count_speed) / speed * (self.position - position);
        self.position = position;
        let pole = f64::from(lift.pole) / factor;
        self.speed = pole * self.speed + (1.0 - pole) * raw;
        let p = &lift.pressure;
        let change = pressure - self.pressure;
        self.pressure = pressure;
        self.mean += (pressure - self.mean) / two_to(MEAN_SHIFT);
        let mean = self.mean * two_to(PRESSURE_GUARD);
        let (cosine, sine) = (at(&p.cosine, mean) / factor, at(&p.sine, mean) / factor);
        (self.cosine, self.sine) =
            (cosine * self.cosine - sine * self.sine + change, sine * self.cosine + cosine * self.sine);
        let read = at(&p.real, mean) * self.cosine + at(&p.imaginary, mean) * self.sine;
        let limit = f64::from(p.limit) / speed;
        let swing = (read * two_to(PRESSURE_GUARD) / two_to(p.shift) / speed).clamp(-limit, limit);
        let newest = self.oldest;
        self.oldest = (newest + 1) % PAST;
        let before = |ticks: usize| (newest + PAST - ticks) % PAST;
        let late = at(&lift.shaper.delay, mean) / two_to(SHAPER_SHIFT);
        let share = at(&lift.shaper.share, mean) / factor;
        let shaped = |ring: &[f64; PAST]| {
            let (whole, into) = (late as usize, late.fract());
            let then = ring[before(whole)] * (1.0 - into) + ring[before(whole + 1)] * into;
            share * ring[newest] + (1.0 - share) * then
        };
        self.asked[newest] = asked;
        let reference = shaped(&self.asked);
        self.references[newest] = reference;
        if reference * speed < 0.5 {
            (self.integral, self.error) = (0.0, 0.0);
            self.corrections = [0.0; PAST];
            return 0.0;
        }
        let delay = lift.delay as usize;
        let hidden = self.corrections[before(1)] - self.corrections[before(1 + delay)];
        let error = self.references[before(delay)] - self.speed - f64::from(lift.prediction) / factor * hidden;
        let over = (self.speed - f64::from(lift.overspeed_from) / speed).max(0.0);
        let summed = error - lift.overspeed.value() * over;
        let pid = lift.proportional.value() * error + lift.derivative.value() * (error - self.error) + self.integral;
        self.error = error;
        let wanted = reference * (1.0 + self.trim) + pid + swing;
        let u = wanted.clamp(f64::from(lift.u_min) / speed, f64::from(lift.u_max) / speed);
        let learnt = lift.adaptation.value() / two_to(TRIM_SHIFT - LEARNING_SHIFT) * self.integral * reference;
        let trim = (self.trim + learnt).clamp(-0.25, 0.25);
        let moved = (trim - self.trim) * reference;
        self.trim = trim;
        self.integral += lift.integral.value() * summed + (u - wanted) - moved;
        self.corrections[newest] = pid + u - wanted;
        let temperature = temperature * two_to(TEMPERATURE_GUARD);
        let scale = (f64::from(lift.scale_base) + lift.scale_slope.value() * temperature) / factor;
        let table = at(&lift.table, scale.max(0.0) * u * speed);
        let order = table + f64::from(lift.shift_base) + lift.shift_slope.value() * temperature;
        order.clamp(f64::from(lift.i_min), f64::from(lift.i_max)) / two_to(CURRENT_SHIFT)
    }
}
