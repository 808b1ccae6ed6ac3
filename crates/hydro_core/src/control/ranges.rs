//! How large every variable of a tick can become, and where saturation can act.
//!
//! Interval arithmetic (Moore 1966) over the tick, from the configuration's integers and the ranges of readings and
//! requests alone: what the variables are before their saturation, and what they are after it.

use super::config::{
    Config, LiftConfig, INTEGRAL_SHIFT, LEARNING_SHIFT, MOST_COUNTS, MOST_PRESSURE, MOST_PRESSURE_CHANGE,
    MOST_RESONANCE, MOST_SHAPED, MOST_TRIM, PRESSURE_GUARD, SHAPER_SHIFT, TEMPERATURE_GUARD, TRIM_SHIFT,
};
use super::fixed::{Gain, CURRENT_SHIFT, FACTOR_SHIFT, MOST_CURRENT, MOST_FACTOR, MOST_SPEED, SPEED_SHIFT};
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
        let knots = || (0..table.knots.len()).map(|k| i128::from(table.knot(k)));
        Interval(knots().min().unwrap_or(0), knots().max().unwrap_or(0))
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
    let most = i64::from(config.request_most);
    let mut rows = Vec::new();
    let mut add = |variable, reach: Interval, kept: Interval, scale| {
        rows.push(Range { owner: 0, variable, reach, kept: reach.within(kept), scale, unit: "mm/s" });
    };
    let ramp = Interval::up_to(most);
    let change = Interval(-i128::from(config.ramp_down), i128::from(config.ramp_up));
    add("ramp", ramp.plus(change), ramp, SPEED_SHIFT);
    add("smooth", ramp, ramp, SPEED_SHIFT);
    add("early", ramp, ramp, SPEED_SHIFT);
    let mut asked = [ramp; 2];
    for (k, (asked, ratio)) in asked.iter_mut().zip(&config.ratio).enumerate() {
        *asked = Interval::of(ratio).times(ramp).shifted(FACTOR_SHIFT);
        for variable in ["wanted", "asked"] {
            let (owner, scale) = (k + 1, SPEED_SHIFT);
            rows.push(Range { owner, variable, reach: *asked, kept: *asked, scale, unit: "mm/s" });
        }
    }
    let temperature = Interval(i128::from(config.temperature_least), i128::from(config.temperature_most));
    for (k, lift) in config.lifts.iter().enumerate() {
        of_lift(&mut rows, k + 1, lift, asked[k], temperature);
    }
    rows
}

fn of_lift(rows: &mut Vec<Range>, owner: usize, config: &LiftConfig, asked: Interval, temperature: Interval) {
    let mut add = |variable, unit, reach: Interval, kept: Interval, scale| -> Interval {
        let kept = reach.within(kept);
        rows.push(Range { owner, variable, reach, kept, scale, unit });
        kept
    };
    let speeds = Interval::around(MOST_SPEED);
    let all = Interval(i128::MIN / 4, i128::MAX / 4);
    let word32 = Interval(i128::from(i32::MIN), i128::from(i32::MAX));
    let counts = add("counts", "count", word32.minus(word32), Interval::around(MOST_COUNTS), 0);
    let raw = add("raw", "mm/s", counts.by(i128::from(config.count_speed)), speeds, SPEED_SHIFT);
    // A mean of what it was and of what comes in, by a pole between 0 and 1.
    let speed = add("speed", "mm/s", raw, speeds, SPEED_SHIFT);
    let delay = Interval::of(&config.shaper.delay);
    add("shaper's delay", "tick", delay, Interval::up_to(MOST_SHAPED), SHAPER_SHIFT);
    let share = Interval::of(&config.shaper.share);
    let one = Interval(1 << FACTOR_SHIFT, 1 << FACTOR_SHIFT);
    let most = Interval::up_to(i64::from(config.most));
    let shaped = share.times(asked).plus(one.minus(share).times(asked)).shifted(FACTOR_SHIFT);
    let reference = add("reference", "mm/s", shaped, most, SPEED_SHIFT);
    // A correction is kept like a speed; see the end of the tick.
    let hidden = speeds.minus(speeds).by(i128::from(config.prediction)).shifted(FACTOR_SHIFT);
    let error = reference.minus(speed).minus(hidden);
    let error = add("error", "mm/s", error, speeds, SPEED_SHIFT);
    let from = i128::from(config.overspeed_from);
    let over = speed.minus(Interval(from, from)).within(Interval::up_to(MOST_SPEED));
    let summed = add("summed", "mm/s", error.minus(product(config.overspeed, over)), speeds, SPEED_SHIFT);
    let proportional = add("proportional", "mm/s", product(config.proportional, error), speeds, SPEED_SHIFT);
    let slope = product(config.derivative, error.minus(error));
    let derivative = add("derivative", "mm/s", slope, speeds, SPEED_SHIFT);
    let integral = Interval::around(MOST_SPEED << INTEGRAL_SHIFT);
    let sum = proportional.plus(derivative).plus(integral.shifted(INTEGRAL_SHIFT));
    let pid = add("pid", "mm/s", sum, speeds, SPEED_SHIFT);
    let p = &config.pressure;
    let pressure = Interval::up_to(MOST_PRESSURE);
    let change = add("change", "step", pressure.minus(pressure), Interval::around(MOST_PRESSURE_CHANGE), 0)
        .by(1 << PRESSURE_GUARD);
    let resonance = Interval::around(MOST_RESONANCE << PRESSURE_GUARD);
    let (c, s) = (Interval::of(&p.cosine), Interval::of(&p.sine));
    let turned = c.times(resonance).minus(s.times(resonance)).shifted(FACTOR_SHIFT);
    let cosine = add("cosine", "step", turned.plus(change), resonance, PRESSURE_GUARD);
    let turned = s.times(resonance).plus(c.times(resonance)).shifted(FACTOR_SHIFT);
    let sine = add("sine", "step", turned, resonance, PRESSURE_GUARD);
    let swing = Interval::of(&p.real).times(cosine).plus(Interval::of(&p.imaginary).times(sine)).shifted(p.shift);
    let swing = add("swing", "mm/s", swing, Interval::around(i64::from(p.limit)), SPEED_SHIFT);
    let trims = Interval::around(MOST_TRIM);
    let squared = speeds.times(reference).shifted(2 * SPEED_SHIFT - LEARNING_SHIFT);
    let learnt = add("trim", "1", trims.plus(product(config.adaptation, squared)), trims, TRIM_SHIFT);
    let moved = learnt.minus(learnt).times(reference).shifted(TRIM_SHIFT - INTEGRAL_SHIFT);
    let trim = learnt.times(reference).shifted(TRIM_SHIFT);
    let wanted = reference.plus(trim).plus(pid).plus(swing);
    let limits = Interval(i128::from(config.u_min), i128::from(config.u_max));
    let u = add("u", "mm/s", wanted, limits, SPEED_SHIFT);
    let exact = i128::from(config.integral.mantissa) << (INTEGRAL_SHIFT - config.integral.shift);
    let tracked = integral.minus(moved).plus(summed.by(exact)).plus(u.minus(wanted).by(1 << INTEGRAL_SHIFT));
    add("integral", "mm/s", tracked, integral, SPEED_SHIFT + INTEGRAL_SHIFT);
    add("correction", "mm/s", pid.plus(u).minus(wanted), speeds, SPEED_SHIFT);
    let temperature = temperature.by(1 << TEMPERATURE_GUARD);
    let base = Interval(i128::from(config.scale_base), i128::from(config.scale_base));
    let factor = base.plus(product(config.scale_slope, temperature));
    let factor = add("factor", "1", factor, Interval::up_to(MOST_FACTOR), FACTOR_SHIFT);
    let scaled = add("scaled", "mm/s", factor.times(u).shifted(FACTOR_SHIFT), speeds, SPEED_SHIFT);
    let held = Interval(i128::from(config.table.first), i128::from(config.table.end()));
    add("table's input", "mm/s", scaled, held, SPEED_SHIFT);
    let currents = Interval::around(MOST_CURRENT);
    let shift = add("shift", "mA", product(config.shift_slope, temperature), currents, CURRENT_SHIFT);
    let base = Interval(i128::from(config.shift_base), i128::from(config.shift_base));
    let order = Interval::of(&config.table).plus(base).plus(shift);
    let limits = Interval(i128::from(config.i_min), i128::from(config.i_max));
    let order = add("order", "mA", order, limits, CURRENT_SHIFT);
    // Without a speed asked for the valve is shut: no current, whatever the least while lowering is.
    let Interval(least, most) = order.shifted(CURRENT_SHIFT);
    add("current", "mA", Interval(least.min(0), most.max(0)), all, 0);
}

/// The largest product and sum of a tick's 64-bit arithmetic: what must stay below 2^63.
pub fn widest(config: &Config) -> u32 {
    let (one, most) = (Interval::around(1i64 << FACTOR_SHIFT), Interval::around(MOST_SPEED));
    let mut bits = one.times(most).plus(one.times(most)).bits();
    for lift in &config.lifts {
        let mantissas = [lift.proportional, lift.derivative, lift.integral].map(|gain| i128::from(gain.mantissa));
        let error = most.minus(most);
        bits = mantissas.iter().fold(bits, |bits, &m| bits.max(error.by(m).bits()));
        let over = Interval::up_to(MOST_SPEED).by(i128::from(lift.overspeed.mantissa));
        let squared = most.times(Interval::up_to(i64::from(lift.most)));
        let learnt = squared.shifted(2 * SPEED_SHIFT - LEARNING_SHIFT).by(i128::from(lift.adaptation.mantissa));
        let trims = Interval::around(MOST_TRIM);
        let moved = trims.minus(trims).times(Interval::up_to(i64::from(lift.most)));
        bits = [over, squared, learnt, moved].iter().fold(bits, |bits, one| bits.max(one.bits()));
        let exact = mantissas[2] << (INTEGRAL_SHIFT - lift.integral.shift);
        let tracked = most.by(1 << INTEGRAL_SHIFT).by(8).plus(most.by(exact));
        let resonance = Interval::around(MOST_RESONANCE << PRESSURE_GUARD);
        let p = &lift.pressure;
        let turned = Interval::of(&p.cosine).times(resonance).plus(Interval::of(&p.sine).times(resonance));
        let read = Interval::of(&p.real).times(resonance).plus(Interval::of(&p.imaginary).times(resonance));
        bits = bits.max(tracked.bits()).max(turned.bits()).max(read.bits());
        let tables = [&lift.table, &p.cosine, &p.sine, &p.real, &p.imaginary, &lift.shaper.delay, &lift.shaper.share];
        for table in tables {
            let rise = Interval::of(table).minus(Interval::of(table));
            bits = bits.max(rise.by(1 << table.spacing).bits());
        }
    }
    bits
}
