//! One lift's controller: equations (4.6) to (4.12), the derivative filter, the table, and what goes beyond them.
//!
//! Every step is written in the C of `c/` in the same words and the same order.

use super::config::{
    LiftConfig, INTEGRAL_SHIFT, MEAN_SHIFT, MOST_COUNTS, MOST_PRESSURE, MOST_PRESSURE_CHANGE, MOST_RESONANCE,
    MOST_SHAPED, MOST_TRIM, PAST, PRESSURE_GUARD, SHAPER_SHIFT, TRIM_SHIFT,
};
use super::fixed::{clamped, rounded, saturated, truncated, Word};

/// What a lift's controller remembers from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LiftState {
    /// False before the first tick, which has nothing to take differences from.
    pub started: bool,
    /// Encoder and pressure of the tick before.
    pub position: i32,
    pub pressure: i32,
    /// Filtered speed, with the filter's guard bits.
    pub speed: i32,
    /// Of the last ticks, each a ring [speed]: what was asked of the lift, the same shaped and the PID's
    /// correction. `oldest` is the place that is written next.
    pub asked: [i32; PAST],
    pub references: [i32; PAST],
    pub corrections: [i32; PAST],
    pub oldest: u32,
    /// Of the tick before [speed].
    pub error: i32,
    /// Integral part, of the scale of a speed and [`INTEGRAL_SHIFT`] bits more: no product loses a bit in it.
    pub integral: i64,
    /// Of the feed-forward.
    pub trim: i32,
    /// Mean pressure [steps], with guard bits.
    pub mean: i32,
    /// The resonator.
    pub cosine: i32,
    pub sine: i32,
}

/// What a lift's controller reads in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiftReading {
    /// Encoder counts, upward positive.
    pub position: i32,
    /// Steps.
    pub pressure: i32,
    /// Steps, within the range of the configuration.
    pub temperature: i32,
}

/// The error of (4.12), and that of its integral part [speed].
#[derive(Debug, Clone, Copy)]
struct Errors {
    own: i64,
    summed: i64,
}

/// The place of a ring that was written some ticks before `newest`.
#[inline(always)]
fn before(newest: usize, ticks: usize) -> usize {
    (newest + PAST - ticks) % PAST
}

impl LiftState {
    /// One tick: the valve's current [mA] for a lowering speed `asked` of the forks [speed].
    pub fn tick(&mut self, config: &LiftConfig, word: Word, asked: i32, reading: &LiftReading) -> i32 {
        if !self.started {
            self.position = reading.position;
            self.pressure = clamped(i64::from(reading.pressure), 0, MOST_PRESSURE) as i32;
            self.mean = self.pressure << PRESSURE_GUARD;
            self.started = true;
        }
        let speed = self.filtered_speed(config, word, reading.position);
        let swing = self.swing(config, word, reading.pressure);
        let newest = self.oldest as usize % PAST;
        self.oldest = ((newest + 1) % PAST) as u32;
        self.asked[newest] = asked;
        let shaped = self.through_shaper(config, word, &self.asked, newest);
        let reference = clamped(shaped, 0, i64::from(config.most));
        self.references[newest] = reference as i32;
        if reference == 0 {
            // The valve is shut: nothing is controlled, and nothing may be left over for the next lowering.
            self.integral = 0;
            self.error = 0;
            self.corrections = [0; PAST];
            return 0;
        }
        let delayed = i64::from(self.references[before(newest, config.delay as usize)]);
        let error = saturated(delayed - speed - self.not_shown_yet(config, word, newest), word.most_speed());
        let summed = Self::summed_error(config, word, error, speed);
        let u = self.speed_to_order(config, word, reference, Errors { own: error, summed }, swing, newest);
        current(config, word, u, i64::from(reading.temperature))
    }

    /// What a ring held and holds now: a w + (1 − a) w(t − τ), with the shaper's share a and delay τ, between two ticks
    /// straight. A swing of the period 2τ does not pass (Singer & Seering 1990, equations 7 and 8).
    fn through_shaper(&self, config: &LiftConfig, word: Word, ring: &[i32; PAST], newest: usize) -> i64 {
        let mean = i64::from(self.mean) >> PRESSURE_GUARD;
        let delay = clamped(config.shaper.delay.at(mean), 0, MOST_SHAPED);
        let (share, one) = (config.shaper.share.at(mean), 1i64 << word.factor());
        let whole = (delay >> SHAPER_SHIFT) as usize;
        let into = delay - ((whole as i64) << SHAPER_SHIFT);
        let [now, late, later] = [0, whole, whole + 1].map(|ticks| i64::from(ring[before(newest, ticks)]));
        let late = late * ((1 << SHAPER_SHIFT) - into) + later * into;
        rounded(share * (now << SHAPER_SHIFT) + (one - share) * late, word.factor() + SHAPER_SHIFT)
    }

    /// Corrections that are ordered and have not come back as a speed: a model of the lift that answers after `delay`
    /// ticks (Smith 1957), whose part of the feed-forward the delayed reference already is.
    fn not_shown_yet(&self, config: &LiftConfig, word: Word, newest: usize) -> i64 {
        let [last, shown] = [1, 1 + config.delay as usize].map(|ticks| self.corrections[before(newest, ticks)]);
        rounded(i64::from(config.prediction) * (i64::from(last) - i64::from(shown)), word.factor())
    }

    /// The error that is summed: what is too fast counts more.
    fn summed_error(config: &LiftConfig, word: Word, error: i64, speed: i64) -> i64 {
        let over = clamped(speed - i64::from(config.overspeed_from), 0, word.most_speed());
        saturated(error - config.overspeed.times(over), word.most_speed())
    }

    /// The difference of the encoder's counts as a lowering speed, through the filter of Figure A.17.
    fn filtered_speed(&mut self, config: &LiftConfig, word: Word, position: i32) -> i64 {
        let counts = saturated(i64::from(self.position) - i64::from(position), MOST_COUNTS);
        self.position = position;
        let raw = saturated(config.count_speed.times(counts), word.most_speed());
        let (pole, one) = (i64::from(config.pole), 1i64 << word.factor());
        let sum = pole * i64::from(self.speed) + (one - pole) * (raw << word.guard());
        self.speed = saturated(truncated(sum, word.factor()), word.most_speed() << word.guard()) as i32;
        rounded(i64::from(self.speed), word.guard())
    }

    /// PID, feed-forward and what the pressure adds, kept within its limits: (4.12), (4.7), (4.6) with T_t = T_s.
    fn speed_to_order(
        &mut self,
        config: &LiftConfig,
        word: Word,
        reference: i64,
        error: Errors,
        swing: i64,
        newest: usize,
    ) -> i64 {
        let most = word.most_speed() << word.guard();
        let proportional = saturated(config.proportional.times(error.own), most);
        let derivative = saturated(config.derivative.times(error.own - i64::from(self.error)), most);
        self.error = error.own as i32;
        let sum = proportional + derivative + rounded(self.integral, INTEGRAL_SHIFT - word.guard());
        let pid = saturated(rounded(sum, word.guard()), word.most_speed());
        let trim = rounded(i64::from(self.trim) * reference, TRIM_SHIFT);
        let wanted = reference + trim + pid + swing;
        let u = clamped(wanted, i64::from(config.u_min), i64::from(config.u_max));
        let learnt = self.learn(config, word, reference);
        let exact = 1i64 << (INTEGRAL_SHIFT - config.integral.shift);
        let step = i64::from(config.integral.mantissa) * error.summed * exact;
        let tracked = self.integral - learnt + step + (u - wanted) * (1i64 << INTEGRAL_SHIFT);
        self.integral = saturated(tracked, word.most_speed() << INTEGRAL_SHIFT);
        self.corrections[newest] = saturated(pid + u - wanted, word.most_speed()) as i32;
        u
    }

    /// Moves a little of the integral part into the trim of the feed-forward; gives what is moved, of the integrator's
    /// scale. dk = μ I r, and I falls by dk·r: a gradient step, so that the order stays what it was.
    fn learn(&mut self, config: &LiftConfig, word: Word, reference: i64) -> i64 {
        let integral = saturated(rounded(self.integral, INTEGRAL_SHIFT), word.most_speed());
        let product = rounded(integral * reference, 2 * word.speed());
        let trim = saturated(i64::from(self.trim) + config.adaptation.times(product), MOST_TRIM);
        let moved = trim - i64::from(self.trim);
        self.trim = trim as i32;
        truncated(moved * reference, TRIM_SHIFT - INTEGRAL_SHIFT)
    }

    /// What the cylinder's pressure swings by, as a speed: a resonator on its differences, which has no answer to a
    /// constant; truncation towards zero lets it come to rest.
    fn swing(&mut self, config: &LiftConfig, word: Word, pressure: i32) -> i64 {
        let p = &config.pressure;
        let pressure = clamped(i64::from(pressure), 0, MOST_PRESSURE);
        let change = saturated(pressure - i64::from(self.pressure), MOST_PRESSURE_CHANGE);
        self.pressure = pressure as i32;
        let sum = i64::from(self.mean) * ((1 << MEAN_SHIFT) - 1) + (pressure << PRESSURE_GUARD);
        self.mean = clamped(truncated(sum, MEAN_SHIFT), 0, MOST_PRESSURE << PRESSURE_GUARD) as i32;
        if p.is_quiet() {
            // What follows with tables of zeros, to the bit.
            let turned = saturated(change << PRESSURE_GUARD, MOST_RESONANCE << PRESSURE_GUARD);
            (self.cosine, self.sine) = (turned as i32, 0);
            return 0;
        }
        let mean = i64::from(self.mean) >> PRESSURE_GUARD;
        let (cosine, sine) = (p.cosine.at(mean), p.sine.at(mean));
        let (c, s) = (i64::from(self.cosine), i64::from(self.sine));
        let most = MOST_RESONANCE << PRESSURE_GUARD;
        let turned = truncated(cosine * c - sine * s, word.factor()) + (change << PRESSURE_GUARD);
        self.cosine = saturated(turned, most) as i32;
        self.sine = saturated(truncated(sine * c + cosine * s, word.factor()), most) as i32;
        let sum = p.real.at(mean) * i64::from(self.cosine) + p.imaginary.at(mean) * i64::from(self.sine);
        saturated(rounded(sum, p.shift), i64::from(p.limit))
    }
}

/// From a speed to the valve's current [mA]: (4.8), the table, (4.9).
fn current(config: &LiftConfig, word: Word, u: i64, temperature: i64) -> i32 {
    let factor = i64::from(config.scale_base) + config.scale_slope.times(temperature);
    let factor = clamped(factor, 0, word.most_factor());
    let scaled = saturated(rounded(factor * u, word.factor()), word.most_speed());
    let shift = saturated(config.shift_slope.times(temperature), word.most_current());
    let order = config.table.at(scaled) + i64::from(config.shift_base) + shift;
    let order = clamped(order, i64::from(config.i_min), i64::from(config.i_max));
    rounded(order, word.current()) as i32
}
