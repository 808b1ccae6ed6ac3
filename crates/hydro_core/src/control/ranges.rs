//! How large every variable of a tick can become, and where saturation can act.
//!
//! Interval arithmetic (Moore 1966) over the tick, from the configuration's integers and the ranges of readings and
//! requests alone: what the variables are before their saturation, and what they are after it.

use super::config::{
    Config, LiftConfig, INTEGRAL_SHIFT, MOST_COUNTS, MOST_PRESSURE, MOST_PRESSURE_CHANGE, MOST_RESONANCE, MOST_SHAPED,
    MOST_TRIM, PRESSURE_GUARD, SHAPER_SHIFT, TRIM_SHIFT,
};
use super::fixed::{Gain, Word};
use super::table::Table;

/// From the least to the greatest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval(pub i128, pub i128);

impl Interval {
    fn around(most: i64) -> Self {
        Interval(-i128::from(most), i128::from(most))
    }
    fn up_to(most: i64) -> Self {
        Interval(0, i128::from(most))
    }
    fn plus(self, other: Self) -> Self {
        Interval(self.0 + other.0, self.1 + other.1)
    }
    fn minus(self, other: Self) -> Self {
        Interval(self.0 - other.1, self.1 - other.0)
    }
    fn times(self, other: Self) -> Self {
        let ends = [self.0 * other.0, self.0 * other.1, self.1 * other.0, self.1 * other.1];
        Interval(*ends.iter().min().expect("four"), *ends.iter().max().expect("four"))
    }
    fn by(self, factor: i128) -> Self {
        self.times(Interval(factor, factor))
    }
    /// After a rounding shift, outwards by less than one.
    fn shifted(self, shift: u32) -> Self {
        let round = |x: i128| {
            let size = (x.abs() + ((1 << shift) >> 1)) >> shift;
            size * x.signum()
        };
        Interval(round(self.0), round(self.1))
    }
    fn within(self, other: Self) -> Self {
        Interval(self.0.clamp(other.0, other.1), self.1.clamp(other.0, other.1))
    }
    fn of(table: &Table) -> Self {
        let least = table.knots.iter().min().copied().unwrap_or(0);
        let most = table.knots.iter().max().copied().unwrap_or(0);
        Interval(i128::from(least), i128::from(most))
    }
    /// Bits of a signed integer that holds both ends.
    pub fn bits(self) -> u32 {
        let magnitude = self.0.unsigned_abs().max(self.1.unsigned_abs() + 1);
        129 - (magnitude - 1).leading_zeros().min(128)
    }
}

/// One variable of a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Range {
    /// 0: what both lifts share, 1 and 2: the free and the main lift's.
    pub owner: usize,
    /// As the C names it.
    pub variable: &'static str,
    /// Before saturation.
    pub reach: Interval,
    /// After it.
    pub kept: Interval,
    /// The value is the integer / 2^scale in `unit`.
    pub scale: u32,
    pub unit: &'static str,
}

impl Range {
    /// Whether saturation can act on it.
    pub fn saturates(&self) -> bool {
        self.reach != self.kept
    }
}

fn product(gain: Gain, x: Interval) -> Interval {
    x.by(i128::from(gain.mantissa)).shifted(gain.shift)
}

/// Every variable of a tick, in the order in which it is worked out.
pub fn ranges(config: &Config) -> Vec<Range> {
    let word = config.word;
    let most = i64::from(config.request_most);
    let mut rows = Vec::new();
    let mut add = |variable, reach: Interval, kept: Interval, scale| {
        rows.push(Range { owner: 0, variable, reach, kept: reach.within(kept), scale, unit: "mm/s" });
    };
    let ramp = Interval::up_to(most);
    let change = Interval(-i128::from(config.ramp_down), i128::from(config.ramp_up));
    add("ramp", ramp.plus(change), ramp, word.speed());
    let smooth = Interval::up_to(most << word.guard());
    add("smooth", smooth, smooth, word.speed() + word.guard());
    add("early", smooth, smooth, word.speed() + word.guard());
    let mut asked = [ramp; 2];
    for (asked, ratio) in asked.iter_mut().zip(&config.ratio) {
        *asked = Interval::of(ratio).times(ramp).shifted(word.factor());
        add("wanted", *asked, *asked, word.speed());
        add("asked", *asked, *asked, word.speed());
    }
    let temperature = Interval(i128::from(config.temperature_least), i128::from(config.temperature_most));
    for (k, lift) in config.lifts.iter().enumerate() {
        of_lift(&mut rows, k + 1, word, lift, asked[k], temperature);
    }
    rows
}

fn of_lift(
    rows: &mut Vec<Range>,
    owner: usize,
    word: Word,
    config: &LiftConfig,
    asked: Interval,
    temperature: Interval,
) {
    let mut add = |variable, unit, reach: Interval, kept: Interval, scale| -> Interval {
        let kept = reach.within(kept);
        rows.push(Range { owner, variable, reach, kept, scale, unit });
        kept
    };
    let speeds = Interval::around(word.most_speed());
    let guarded = Interval::around(word.most_speed() << word.guard());
    let all = Interval(i128::MIN / 4, i128::MAX / 4);
    let word32 = Interval(i128::from(i32::MIN), i128::from(i32::MAX));
    let counts = add("counts", "count", word32.minus(word32), Interval::around(MOST_COUNTS), 0);
    let raw = add("raw", "mm/s", product(config.count_speed, counts), speeds, word.speed());
    // A mean of what it was and of what comes in, by a pole between 0 and 1.
    let speed = add("speed", "mm/s", raw.by(1 << word.guard()), guarded, word.speed() + word.guard());
    let delay = Interval::of(&config.shaper.delay);
    add("shaper's delay", "tick", delay, Interval::up_to(MOST_SHAPED), SHAPER_SHIFT);
    let share = Interval::of(&config.shaper.share);
    let one = Interval(1 << word.factor(), 1 << word.factor());
    let most = Interval::up_to(i64::from(config.most));
    let shaped = share.times(asked).plus(one.minus(share).times(asked)).shifted(word.factor());
    let reference = add("reference", "mm/s", shaped, most, word.speed());
    // A correction is kept like a speed; see the end of the tick.
    let hidden = speeds.minus(speeds).by(i128::from(config.prediction)).shifted(word.factor());
    let error = reference.minus(speed.shifted(word.guard())).minus(hidden);
    let error = add("error", "mm/s", error, speeds, word.speed());
    let from = i128::from(config.overspeed_from);
    let over = speed.shifted(word.guard()).minus(Interval(from, from)).within(Interval::up_to(word.most_speed()));
    let summed = add("summed", "mm/s", error.minus(product(config.overspeed, over)), speeds, word.speed());
    let proportional =
        add("proportional", "mm/s", product(config.proportional, error), guarded, word.speed() + word.guard());
    let slope = product(config.derivative, error.minus(error));
    let derivative = add("derivative", "mm/s", slope, guarded, word.speed() + word.guard());
    let integral = Interval::around(word.most_speed() << INTEGRAL_SHIFT);
    let sum = proportional.plus(derivative).plus(integral.shifted(INTEGRAL_SHIFT - word.guard()));
    let pid = add("pid", "mm/s", sum.shifted(word.guard()), speeds, word.speed());
    let p = &config.pressure;
    let pressure = Interval::up_to(MOST_PRESSURE);
    let change = add("change", "step", pressure.minus(pressure), Interval::around(MOST_PRESSURE_CHANGE), 0)
        .by(1 << PRESSURE_GUARD);
    let resonance = Interval::around(MOST_RESONANCE << PRESSURE_GUARD);
    let (c, s) = (Interval::of(&p.cosine), Interval::of(&p.sine));
    let turned = c.times(resonance).minus(s.times(resonance)).shifted(word.factor());
    let cosine = add("cosine", "step", turned.plus(change), resonance, PRESSURE_GUARD);
    let turned = s.times(resonance).plus(c.times(resonance)).shifted(word.factor());
    let sine = add("sine", "step", turned, resonance, PRESSURE_GUARD);
    let swing = Interval::of(&p.real).times(cosine).plus(Interval::of(&p.imaginary).times(sine)).shifted(p.shift);
    let swing = add("swing", "mm/s", swing, Interval::around(i64::from(p.limit)), word.speed());
    let trims = Interval::around(MOST_TRIM);
    let squared = pid_integral(word).times(reference).shifted(2 * word.speed());
    let learnt = add("trim", "1", trims.plus(product(config.adaptation, squared)), trims, TRIM_SHIFT);
    let moved = learnt.minus(learnt).times(reference).shifted(TRIM_SHIFT - INTEGRAL_SHIFT);
    let trim = learnt.times(reference).shifted(TRIM_SHIFT);
    let wanted = reference.plus(trim).plus(pid).plus(swing);
    let limits = Interval(i128::from(config.u_min), i128::from(config.u_max));
    let u = add("u", "mm/s", wanted, limits, word.speed());
    let exact = i128::from(config.integral.mantissa) << (INTEGRAL_SHIFT - config.integral.shift);
    let tracked = integral.minus(moved).plus(summed.by(exact)).plus(u.minus(wanted).by(1 << INTEGRAL_SHIFT));
    add("integral", "mm/s", tracked, integral, word.speed() + INTEGRAL_SHIFT);
    add("correction", "mm/s", pid.plus(u).minus(wanted), speeds, word.speed());
    let base = Interval(i128::from(config.scale_base), i128::from(config.scale_base));
    let factor = base.plus(product(config.scale_slope, temperature));
    let factor = add("factor", "1", factor, Interval::up_to(word.most_factor()), word.factor());
    let scaled = add("scaled", "mm/s", factor.times(u).shifted(word.factor()), speeds, word.speed());
    let held = Interval(i128::from(config.table.first), i128::from(end_of(&config.table)));
    add("table's input", "mm/s", scaled, held, word.speed());
    let currents = Interval::around(word.most_current());
    let shift = add("shift", "mA", product(config.shift_slope, temperature), currents, word.current());
    let base = Interval(i128::from(config.shift_base), i128::from(config.shift_base));
    let order = Interval::of(&config.table).plus(base).plus(shift);
    let limits = Interval(i128::from(config.i_min), i128::from(config.i_max));
    let order = add("order", "mA", order, limits, word.current());
    add("current", "mA", order.shifted(word.current()), all, 0);
}

/// The integral part as the trim sees it.
fn pid_integral(word: Word) -> Interval {
    Interval::around(word.most_speed())
}

fn end_of(table: &Table) -> i64 {
    i64::from(table.first) + ((table.knots.len() as i64 - 1) << table.spacing)
}

/// The largest product and sum of a tick's 64-bit arithmetic: what must stay below 2^63.
pub fn widest(config: &Config) -> u32 {
    let word = config.word;
    let (one, most) = (Interval::around(1i64 << word.factor()), Interval::around(word.most_speed()));
    let guarded = most.by(1 << word.guard());
    let shaped = one.times(most).by(1 << SHAPER_SHIFT);
    let mut bits = one.times(guarded).plus(one.times(guarded)).bits().max(shaped.plus(shaped).bits());
    for lift in &config.lifts {
        let mantissas = [lift.proportional, lift.derivative, lift.integral].map(|gain| i128::from(gain.mantissa));
        let error = most.minus(most);
        bits = mantissas.iter().fold(bits, |bits, &m| bits.max(error.by(m).bits()));
        let exact = mantissas[2] << (INTEGRAL_SHIFT - lift.integral.shift);
        let tracked = most.by(1 << INTEGRAL_SHIFT).by(8).plus(most.by(exact));
        let resonance = Interval::around(MOST_RESONANCE << PRESSURE_GUARD);
        let p = &lift.pressure;
        let turned = Interval::of(&p.cosine).times(resonance).plus(Interval::of(&p.sine).times(resonance));
        let read = Interval::of(&p.real).times(resonance).plus(Interval::of(&p.imaginary).times(resonance));
        bits = bits.max(tracked.bits()).max(turned.bits()).max(read.bits());
    }
    bits
}
