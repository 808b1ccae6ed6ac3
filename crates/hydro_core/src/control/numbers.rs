//! A configuration as a tick reads it: one controller's numbers, or one in each lane.

use super::config::{Config, LiftConfig, INTEGRAL_SHIFT};
use super::fixed::{Gain, FACTOR_SHIFT};
use super::table::Table;
use crate::integer::{Integer, LaneInteger};

/// A factor in each lane: mantissa·2^−shift.
#[derive(Debug, Clone, Copy)]
pub struct Gains<I> {
    pub mantissa: I,
    shift: I,
    /// Half of 2^shift.
    half: I,
}

impl<I: Integer> Gains<I> {
    /// The product with a number of 32 bits, rounded.
    #[inline(always)]
    pub fn times(&self, x: I) -> I {
        let exact = self.mantissa.product(x);
        (exact.abs() + self.half).shr_by(self.shift).signed_as(exact)
    }
}

/// Of each segment of a table the knot at which it begins, and how much higher the next one is; none where it is the same
/// everywhere.
#[derive(Debug, Clone)]
enum Segments<I> {
    /// In each lane.
    Each(Vec<[I; 2]>),
    /// In all lanes the same.
    One { low: Vec<i64>, rise: Vec<i64> },
}

impl<I: Integer> Segments<I> {
    /// Both at each lane's segment.
    #[inline(always)]
    fn at(&self, segment: I) -> [I; 2] {
        match self {
            Segments::Each(segments) => {
                [I::lookup_in(segments, |both| both[0], segment), I::lookup_in(segments, |both| both[1], segment)]
            }
            Segments::One { low, rise } => [I::pick(low, segment), I::pick(rise, segment)],
        }
    }
}

/// A table in each lane. Shorter ones repeat their last knot.
#[derive(Debug, Clone)]
pub struct Tables<I> {
    first: I,
    spacing: I,
    half: I,
    /// From the first knot to the last, and the last segment.
    span: I,
    last: I,
    segments: Segments<I>,
    /// The value, where every lane has the same one everywhere.
    everywhere: Option<I>,
}

impl<I: Integer> Tables<I> {
    /// y at x, rounded.
    #[inline(always)]
    pub fn at(&self, x: I) -> I {
        if let Some(value) = self.everywhere {
            return value;
        }
        let from = (x - self.first).clamp_to(I::zero(), self.span);
        let segment = from.shr_by(self.spacing).clamp_to(I::zero(), self.last);
        let [low, rise] = self.segments.at(segment);
        // Two knots of 32 bits may lie further apart than 32 bits hold.
        let exact = rise * (from - segment.shl_by(self.spacing));
        low + (exact.abs() + self.half).shr_by(self.spacing).signed_as(exact)
    }
}

/// A pressure's feedback: [`super::config::PressureConfig`].
#[derive(Debug, Clone)]
pub struct PressureNumbers<I> {
    pub cosine: Tables<I>,
    pub sine: Tables<I>,
    pub real: Tables<I>,
    pub imaginary: Tables<I>,
    pub shift: I,
    pub half: I,
    pub limit: I,
}

/// What a lift's controller does; where every lane leaves something out, nothing is computed for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts {
    /// It has a share of the reference somewhere.
    pub works: bool,
    pub swing: bool,
    pub shaper: bool,
    /// A low-pass of its own ahead of the shaper.
    pub early: bool,
    pub prediction: bool,
    pub overspeed: bool,
    pub adaptation: bool,
}

impl Parts {
    const ALL: Parts = Parts {
        works: true,
        swing: true,
        shaper: true,
        early: true,
        prediction: true,
        overspeed: true,
        adaptation: true,
    };

    /// Each part is the identity where it is absent, to the bit, in a run from its start: what it adds is zero, and the
    /// states that it alone reads are of no consequence.
    fn of(config: &Config, lift: usize) -> Parts {
        let own = &config.lifts[lift];
        let one = i64::from(1u32 << FACTOR_SHIFT);
        Parts {
            works: !config.ratio[lift].is_zero(),
            swing: !own.pressure.is_quiet(),
            shaper: !own.shaper.delay.is_zero()
                || (0..own.shaper.share.knots.len()).any(|k| own.shaper.share.knot(k) != one),
            early: own.early_pole != config.ramp_pole,
            prediction: own.prediction != 0,
            overspeed: own.overspeed.mantissa != 0,
            adaptation: own.adaptation.mantissa != 0,
        }
    }

    fn or(self, other: Parts) -> Parts {
        Parts {
            works: self.works | other.works,
            swing: self.swing | other.swing,
            shaper: self.shaper | other.shaper,
            early: self.early | other.early,
            prediction: self.prediction | other.prediction,
            overspeed: self.overspeed | other.overspeed,
            adaptation: self.adaptation | other.adaptation,
        }
    }
}

/// One lift's numbers: [`LiftConfig`].
#[derive(Debug, Clone)]
pub struct LiftNumbers<I> {
    pub parts: Parts,
    pub most: I,
    pub early_pole: I,
    pub shaper_delay: Tables<I>,
    pub shaper_share: Tables<I>,
    pub prediction: I,
    pub overspeed: Gains<I>,
    pub overspeed_from: I,
    pub count_speed: I,
    pub pole: I,
    /// Of the reference model [ticks]; and that of all lanes, where it is one.
    pub delay: I,
    pub one_delay: Option<usize>,
    pub proportional: Gains<I>,
    /// I·T_s, and the shift to the integrator's scale.
    pub integral: I,
    pub integral_shift: I,
    pub derivative: Gains<I>,
    pub u_min: I,
    pub u_max: I,
    pub adaptation: Gains<I>,
    pub scale_base: I,
    pub scale_slope: Gains<I>,
    pub table: Tables<I>,
    pub shift_base: I,
    pub shift_slope: Gains<I>,
    pub i_min: I,
    pub i_max: I,
    pub pressure: PressureNumbers<I>,
}

/// The whole controller's numbers: [`Config`].
#[derive(Debug, Clone)]
pub struct Numbers<I> {
    pub request_most: I,
    pub ramp_up: I,
    pub ramp_down: I,
    pub ramp_pole: I,
    pub temperature_least: I,
    pub temperature_most: I,
    pub ratio: [Tables<I>; 2],
    /// Apart from each other, as those of many lanes are large.
    pub lifts: [Box<LiftNumbers<I>>; 2],
}

/// Configurations side by side, and whether they are one.
struct Beside<'a, const N: usize>([&'a Config; N], bool);

impl<'a, const N: usize> Beside<'a, N> {
    fn of(configs: [&'a Config; N]) -> Self {
        Beside(configs, configs.iter().all(|config| std::ptr::eq(*config, configs[0])))
    }

    fn each<I: LaneInteger<N>>(&self, of: impl Fn(&Config) -> i64) -> I {
        match self.1 {
            true => I::constant(of(self.0[0])),
            false => I::from_lanes(self.0.map(of)),
        }
    }

    /// Each configuration once.
    fn unlike(&self) -> &[&'a Config] {
        &self.0[..if self.1 { 1 } else { N }]
    }

    fn gains<I: LaneInteger<N>>(&self, of: impl Fn(&Config) -> Gain) -> Gains<I> {
        Gains {
            mantissa: self.each(|config| i64::from(of(config).mantissa)),
            shift: self.each(|config| i64::from(of(config).shift)),
            half: self.each(|config| (1i64 << of(config).shift) >> 1),
        }
    }

    fn tables<I: LaneInteger<N>>(&self, of: impl Fn(&Config) -> &Table) -> Tables<I> {
        let knot = |config: &Config, k: usize| {
            let knots = &of(config).knots;
            of(config).knot(k.min(knots.len() - 1))
        };
        let most = self.unlike().iter().map(|config| of(config).knots.len()).max().unwrap_or(0);
        let segments = |config: &Config| of(config).knots.len() as i64 - 1;
        let flat = self.unlike().iter().all(|config| of(config).knots.iter().all(|&y| y == of(config).knots[0]));
        let looked_up = if flat { 0 } else { most - 1 };
        Tables {
            first: self.each(|config| i64::from(of(config).first)),
            spacing: self.each(|config| i64::from(of(config).spacing)),
            half: self.each(|config| (1i64 << of(config).spacing) >> 1),
            span: self.each(|config| segments(config) << of(config).spacing),
            last: self.each(|config| segments(config) - 1),
            segments: match self.1 {
                true => Segments::One {
                    low: (0..looked_up).map(|k| knot(self.0[0], k)).collect(),
                    rise: (0..looked_up).map(|k| knot(self.0[0], k + 1) - knot(self.0[0], k)).collect(),
                },
                false => Segments::Each(
                    (0..looked_up)
                        .map(|k| [self.each(|c| knot(c, k)), self.each(|c| knot(c, k + 1) - knot(c, k))])
                        .collect(),
                ),
            },
            everywhere: flat.then(|| self.each(|config| knot(config, 0))),
        }
    }

    fn lift<I: LaneInteger<N>>(&self, lift: usize, parts: Parts) -> LiftNumbers<I> {
        let each = |of: &dyn Fn(&LiftConfig) -> i32| self.each(|config| i64::from(of(&config.lifts[lift])));
        let gains = |of: fn(&LiftConfig) -> Gain| self.gains(|config| of(&config.lifts[lift]));
        let tables = |of: fn(&LiftConfig) -> &Table| self.tables(|config| of(&config.lifts[lift]));
        let delay = |config: &Config| config.lifts[lift].delay;
        let same = self.unlike().iter().all(|config| delay(config) == delay(self.0[0]));
        LiftNumbers {
            parts,
            most: each(&|own| own.most),
            early_pole: each(&|own| own.early_pole),
            shaper_delay: tables(|own| &own.shaper.delay),
            shaper_share: tables(|own| &own.shaper.share),
            prediction: each(&|own| own.prediction),
            overspeed: gains(|own| own.overspeed),
            overspeed_from: each(&|own| own.overspeed_from),
            count_speed: each(&|own| own.count_speed),
            pole: each(&|own| own.pole),
            delay: self.each(|config| i64::from(delay(config))),
            one_delay: same.then(|| delay(self.0[0]) as usize),
            proportional: gains(|own| own.proportional),
            integral: each(&|own| own.integral.mantissa),
            integral_shift: self.each(|config| i64::from(INTEGRAL_SHIFT - config.lifts[lift].integral.shift)),
            derivative: gains(|own| own.derivative),
            u_min: each(&|own| own.u_min),
            u_max: each(&|own| own.u_max),
            adaptation: gains(|own| own.adaptation),
            scale_base: each(&|own| own.scale_base),
            scale_slope: gains(|own| own.scale_slope),
            table: tables(|own| &own.table),
            shift_base: each(&|own| own.shift_base),
            shift_slope: gains(|own| own.shift_slope),
            i_min: each(&|own| own.i_min),
            i_max: each(&|own| own.i_max),
            pressure: PressureNumbers {
                cosine: tables(|own| &own.pressure.cosine),
                sine: tables(|own| &own.pressure.sine),
                real: tables(|own| &own.pressure.real),
                imaginary: tables(|own| &own.pressure.imaginary),
                shift: self.each(|config| i64::from(config.lifts[lift].pressure.shift)),
                half: self.each(|config| (1i64 << config.lifts[lift].pressure.shift) >> 1),
                limit: each(&|own| own.pressure.limit),
            },
        }
    }

    fn numbers<I: LaneInteger<N>>(&self, parts: [Parts; 2]) -> Numbers<I> {
        Numbers {
            request_most: self.each(|config| i64::from(config.request_most)),
            ramp_up: self.each(|config| i64::from(config.ramp_up)),
            ramp_down: self.each(|config| i64::from(config.ramp_down)),
            ramp_pole: self.each(|config| i64::from(config.ramp_pole)),
            temperature_least: self.each(|config| i64::from(config.temperature_least)),
            temperature_most: self.each(|config| i64::from(config.temperature_most)),
            ratio: [0, 1].map(|lift| self.tables(|config| &config.ratio[lift])),
            lifts: [0, 1].map(|lift| Box::new(self.lift(lift, parts[lift]))),
        }
    }
}

impl<I: Integer> Numbers<I> {
    /// With every part worked out, present or not: the reference, of which the C is the image.
    pub fn complete<const N: usize>(configs: [&Config; N]) -> Self
    where
        I: LaneInteger<N>,
    {
        Beside::of(configs).numbers([Parts::ALL; 2])
    }

    /// Without what no lane has; from its start on the orders are the same.
    pub fn of<const N: usize>(configs: [&Config; N]) -> Self
    where
        I: LaneInteger<N>,
    {
        let beside = Beside::of(configs);
        let parts = [0, 1].map(|lift| {
            let each = beside.unlike().iter().map(|config| Parts::of(config, lift));
            each.reduce(Parts::or).unwrap_or(Parts::ALL)
        });
        beside.numbers(parts)
    }
}
