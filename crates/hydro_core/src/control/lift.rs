//! One lift's controller: equations (4.6) to (4.12), the derivative filter, the table, and what goes beyond them.
//!
//! Every step is written in the C of `c/` in the same words and the same order. It is written once for one truck and for
//! one in each lane.

use super::config::{
    INTEGRAL_SHIFT, LEARNING_SHIFT, MEAN_SHIFT, MOST_COUNTS, MOST_PRESSURE, MOST_PRESSURE_CHANGE, MOST_RESONANCE,
    MOST_SHAPED, MOST_TRIM, PAST, PRESSURE_GUARD, SHAPER_SHIFT, TEMPERATURE_GUARD, TRIM_SHIFT,
};
use super::fixed::{
    clamped, rounded, saturated, truncated, CURRENT_SHIFT, FACTOR_SHIFT, MOST_CURRENT, MOST_FACTOR, MOST_SPEED,
    SPEED_SHIFT,
};
use super::numbers::LiftNumbers;
use crate::integer::Integer;
use crate::scalar::Mask;

/// What a lift's controller remembers from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LiftState<I = i64> {
    /// Zero before the first tick, which has nothing to take differences from, then one.
    pub started: I,
    /// Encoder and pressure of the tick before.
    pub position: I,
    pub pressure: I,
    /// Filtered [speed].
    pub speed: I,
    /// Of the last ticks, each a ring [speed]: what was asked of the lift, the same shaped and the PID's
    /// correction. `oldest` is the place that is written next, the same in every lane.
    pub asked: [I; PAST],
    pub references: [I; PAST],
    pub corrections: [I; PAST],
    pub oldest: u32,
    /// Of the tick before [speed].
    pub error: I,
    /// Integral part, of the scale of a speed and [`INTEGRAL_SHIFT`] bits more: no product loses a bit in it.
    pub integral: I,
    /// Of the feed-forward.
    pub trim: I,
    /// Mean pressure [steps / 2^[`PRESSURE_GUARD`]].
    pub mean: I,
    /// The resonator.
    pub cosine: I,
    pub sine: I,
}

/// What a lift's controller reads in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LiftReading<I> {
    /// Encoder counts, upward positive.
    pub position: I,
    /// Steps.
    pub pressure: I,
    /// Steps, within the range of the configuration.
    pub temperature: I,
}

/// The error of (4.12), and that of its integral part [speed].
#[derive(Debug, Clone, Copy)]
struct Errors<I> {
    own: I,
    summed: I,
}

/// One as a factor.
#[inline(always)]
fn one<I: Integer>() -> I {
    I::constant(1i64 << FACTOR_SHIFT)
}

/// The place of a ring that was written some ticks before `newest`.
#[inline(always)]
fn before(newest: usize, ticks: usize) -> usize {
    (newest + PAST - ticks) % PAST
}

/// What a ring holds of some ticks before `newest`, up to [`PAST`] of them.
#[inline(always)]
fn then<I: Integer>(ring: &[I; PAST], newest: usize, ticks: I) -> I {
    let last = I::constant(PAST as i64 - 1);
    let place = I::constant((newest + PAST) as i64) - ticks;
    I::lookup(ring, I::select(last.lt(place), place - I::constant(PAST as i64), place))
}

impl<I: Integer> LiftState<I> {
    /// Before the first tick.
    pub fn at_rest() -> Self {
        let (zero, ring) = (I::zero(), [I::zero(); PAST]);
        LiftState {
            started: zero,
            position: zero,
            pressure: zero,
            speed: zero,
            asked: ring,
            references: ring,
            corrections: ring,
            oldest: 0,
            error: zero,
            integral: zero,
            trim: zero,
            mean: zero,
            cosine: zero,
            sine: zero,
        }
    }

    /// One tick: the valve's current [mA] for a lowering speed `asked` of the forks [speed].
    #[inline(always)]
    pub fn tick(&mut self, numbers: &LiftNumbers<I>, asked: I, reading: &LiftReading<I>) -> I {
        let parts = numbers.parts;
        let pressure = clamped(reading.pressure, I::zero(), I::constant(MOST_PRESSURE));
        let first = self.started.is_zero();
        self.position = I::select(first, reading.position, self.position);
        self.pressure = I::select(first, pressure, self.pressure);
        self.mean = I::select(first, pressure.shl(PRESSURE_GUARD), self.mean);
        self.started = I::constant(1);
        let speed = self.filtered_speed(numbers, reading.position);
        let swing = if parts.swing || parts.shaper { self.swing(numbers, pressure) } else { I::zero() };
        let newest = self.oldest as usize % PAST;
        self.oldest = ((newest + 1) % PAST) as u32;
        let shaped = if parts.shaper {
            self.asked[newest] = asked;
            self.through_shaper(numbers, newest)
        } else {
            asked
        };
        let reference = clamped(shaped, I::zero(), numbers.most);
        self.references[newest] = reference;
        // The valve is shut: nothing is controlled, and nothing may be left over for the next lowering.
        let shut = reference.is_zero();
        if shut.any() {
            let zero = I::zero();
            if parts.prediction {
                for correction in &mut self.corrections {
                    *correction = I::select(shut, zero, *correction);
                }
            }
            if !shut.not().any() {
                (self.integral, self.error) = (zero, zero);
                return zero;
            }
        }
        let delayed = match numbers.one_delay {
            Some(delay) => self.references[before(newest, delay)],
            None => then(&self.references, newest, numbers.delay),
        };
        let hidden = if parts.prediction { self.not_shown_yet(numbers, newest) } else { I::zero() };
        let error = saturated(delayed - speed - hidden, MOST_SPEED);
        let summed = if parts.overspeed { Self::summed_error(numbers, error, speed) } else { error };
        let u = self.speed_to_order(numbers, reference, Errors { own: error, summed }, swing, newest, shut);
        I::select(shut, I::zero(), current(numbers, u, reading.temperature))
    }

    /// What a ring held and holds now: a w + (1 − a) w(t − τ), with the shaper's share a and delay τ, between two ticks
    /// straight. A swing of the period 2τ does not pass (Singer & Seering 1990, equations 7 and 8).
    #[inline(always)]
    fn through_shaper(&self, numbers: &LiftNumbers<I>, newest: usize) -> I {
        let delay = clamped(numbers.shaper_delay.at(self.mean), I::zero(), I::constant(MOST_SHAPED));
        let share = numbers.shaper_share.at(self.mean);
        let whole = delay.shr(SHAPER_SHIFT);
        let into = delay - whole.shl(SHAPER_SHIFT);
        let ring = &self.asked;
        let (now, late) = (ring[newest], then(ring, newest, whole));
        let later = then(ring, newest, whole + I::constant(1));
        let late = late.product(I::constant(1 << SHAPER_SHIFT) - into) + later.product(into);
        let late = rounded(late, SHAPER_SHIFT);
        rounded(share.product(now) + (one::<I>() - share).product(late), FACTOR_SHIFT)
    }

    /// Corrections that are ordered and have not come back as a speed: a model of the lift that answers after `delay`
    /// ticks (Smith 1957), whose part of the feed-forward the delayed reference already is.
    #[inline(always)]
    fn not_shown_yet(&self, numbers: &LiftNumbers<I>, newest: usize) -> I {
        let last = self.corrections[before(newest, 1)];
        let shown = match numbers.one_delay {
            Some(delay) => self.corrections[before(newest, 1 + delay)],
            None => then(&self.corrections, newest, I::constant(1) + numbers.delay),
        };
        rounded(numbers.prediction.product(last - shown), FACTOR_SHIFT)
    }

    /// The error that is summed: what is too fast counts more.
    #[inline(always)]
    fn summed_error(numbers: &LiftNumbers<I>, error: I, speed: I) -> I {
        let over = clamped(speed - numbers.overspeed_from, I::zero(), I::constant(MOST_SPEED));
        saturated(error - numbers.overspeed.times(over), MOST_SPEED)
    }

    /// The difference of the encoder's counts as a lowering speed, through the filter of Figure A.17.
    #[inline(always)]
    fn filtered_speed(&mut self, numbers: &LiftNumbers<I>, position: I) -> I {
        let counts = saturated(self.position - position, MOST_COUNTS);
        self.position = position;
        let raw = saturated(numbers.count_speed.product(counts), MOST_SPEED);
        let sum = numbers.pole.product(self.speed) + (one::<I>() - numbers.pole).product(raw);
        self.speed = saturated(truncated(sum, FACTOR_SHIFT), MOST_SPEED);
        self.speed
    }

    /// PID, feed-forward and what the pressure adds, kept within its limits: (4.12), (4.7), (4.6) with T_t = T_s.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)] // one equation
    fn speed_to_order(
        &mut self,
        numbers: &LiftNumbers<I>,
        reference: I,
        error: Errors<I>,
        swing: I,
        newest: usize,
        shut: I::Mask,
    ) -> I {
        let proportional = saturated(numbers.proportional.times(error.own), MOST_SPEED);
        let derivative = saturated(numbers.derivative.times(error.own - self.error), MOST_SPEED);
        self.error = I::select(shut, I::zero(), error.own);
        let pid = saturated(proportional + derivative + rounded(self.integral, INTEGRAL_SHIFT), MOST_SPEED);
        let (mut trim, mut learnt) = (I::zero(), I::zero());
        if numbers.parts.adaptation {
            trim = rounded(self.trim.product(reference), TRIM_SHIFT);
            learnt = self.learn(numbers, reference, shut);
        }
        let wanted = reference + trim + pid + swing;
        let u = clamped(wanted, numbers.u_min, numbers.u_max);
        let step = numbers.integral.product(error.summed).shl_by(numbers.integral_shift);
        let tracked = self.integral - learnt + step + (u - wanted).shl(INTEGRAL_SHIFT);
        self.integral = I::select(shut, I::zero(), saturated(tracked, MOST_SPEED << INTEGRAL_SHIFT));
        if numbers.parts.prediction {
            let correction = saturated(pid + u - wanted, MOST_SPEED);
            self.corrections[newest] = I::select(shut, I::zero(), correction);
        }
        u
    }

    /// Moves a little of the integral part into the trim of the feed-forward; gives what is moved, of the integrator's
    /// scale. dk = μ I r, and I falls by dk·r: a gradient step, so that the order stays what it was.
    #[inline(always)]
    fn learn(&mut self, numbers: &LiftNumbers<I>, reference: I, shut: I::Mask) -> I {
        let integral = saturated(rounded(self.integral, INTEGRAL_SHIFT), MOST_SPEED);
        let product = rounded(integral.product(reference), 2 * SPEED_SHIFT - LEARNING_SHIFT);
        let trim = saturated(self.trim + numbers.adaptation.times(product), MOST_TRIM);
        let moved = trim - self.trim;
        self.trim = I::select(shut, self.trim, trim);
        truncated(moved.product(reference), TRIM_SHIFT - INTEGRAL_SHIFT)
    }

    /// What the cylinder's pressure swings by, as a speed: a resonator on its differences, which has no answer to a
    /// constant; truncation towards zero lets it come to rest.
    #[inline(always)]
    fn swing(&mut self, numbers: &LiftNumbers<I>, pressure: I) -> I {
        let p = &numbers.pressure;
        let change = saturated(pressure - self.pressure, MOST_PRESSURE_CHANGE);
        self.pressure = pressure;
        let sum = self.mean.product(I::constant((1 << MEAN_SHIFT) - 1)) + pressure.shl(PRESSURE_GUARD);
        self.mean = clamped(truncated(sum, MEAN_SHIFT), I::zero(), I::constant(MOST_PRESSURE << PRESSURE_GUARD));
        if !numbers.parts.swing {
            return I::zero();
        }
        let mean = self.mean;
        let (cosine, sine) = (p.cosine.at(mean), p.sine.at(mean));
        let (c, s) = (self.cosine, self.sine);
        let most = MOST_RESONANCE << PRESSURE_GUARD;
        let turned = truncated(cosine.product(c) - sine.product(s), FACTOR_SHIFT) + change.shl(PRESSURE_GUARD);
        self.cosine = saturated(turned, most);
        self.sine = saturated(truncated(sine.product(c) + cosine.product(s), FACTOR_SHIFT), most);
        let sum = p.real.at(mean).product(self.cosine) + p.imaginary.at(mean).product(self.sine);
        let read = (sum.abs() + p.half).shr_by(p.shift).signed_as(sum);
        clamped(read, -p.limit, p.limit)
    }
}

/// From a speed to the valve's current [mA]: (4.8), the table, (4.9).
#[inline(always)]
fn current<I: Integer>(numbers: &LiftNumbers<I>, u: I, temperature: I) -> I {
    let temperature = temperature.shl(TEMPERATURE_GUARD);
    let factor = numbers.scale_base + numbers.scale_slope.times(temperature);
    let factor = clamped(factor, I::zero(), I::constant(MOST_FACTOR));
    let scaled = saturated(rounded(factor.product(u), FACTOR_SHIFT), MOST_SPEED);
    let shift = saturated(numbers.shift_slope.times(temperature), MOST_CURRENT);
    let order = numbers.table.at(scaled) + numbers.shift_base + shift;
    let order = clamped(order, numbers.i_min, numbers.i_max);
    rounded(order, CURRENT_SHIFT)
}
