//! What is asked of a lowering: six templates, each with a signed margin that is worked out while the lowering runs.
//!
//! A margin is the robustness of a formula in signal temporal logic (Donzé & Maler 2010): positive where the
//! requirement is met, in the unit of its signal, over the ticks up to where the lift lands. A requirement that was
//! never asked (no step, no steady stretch) has an infinite margin, +∞; one that had to be reached and had no time, −∞.
//! `since` is the time since the speed asked for changed last, `step` by how much it changed; x is a signal.
//!
//! | template | formula |
//! |---|---|
//! | `always` | G_[from,to] (x ≤ upper), or (lower ≤ x) |
//! | `stays_inside` | G_[from,to] (lower ≤ x ∧ x ≤ upper) |
//! | `never_after_settling` | G (since ≥ after → x ≤ upper) |
//! | `settles` | G (since ≥ within → abs(x) ≤ band): once within the band, there until the next step |
//! | `responds` | G (step → F_[0,within] (abs(x − asked for) ≤ (1 − share) · abs(step))) |
//! | `reaches` | F_[from,to] (lower ≤ x ∧ x ≤ upper) |

use super::verdict::{of_broken, Verdict};
use super::window::Extremes;
use crate::scalar::{Mask, Scalar};

/// A signal of one lift that a requirement speaks of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signal {
    /// Lowering speed of the forks [m/s].
    Speed,
    /// That speed less the controller's reference [m/s].
    Error,
    /// Cylinder pressure [Pa].
    Pressure,
    /// Forks relative to what carries them [m].
    Position,
    /// Current ordered for the valve [A].
    Current,
}

/// The signals in their order, with the names and units that a sweep gives them.
pub const SIGNALS: &[(Signal, &str, &str, &str)] = &[
    (Signal::Speed, "speed", "m/s", "lowering speed of the forks, downward positive"),
    (Signal::Error, "error", "m/s", "lowering speed less the controller's reference"),
    (Signal::Pressure, "pressure", "Pa", "cylinder pressure"),
    (Signal::Position, "position", "m", "position as the encoder's output has it, upward positive"),
    (Signal::Current, "current", "A", "current that the controller orders for the valve"),
];

/// One template with its bounds, in the signal's unit and in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Template {
    Always { lower: f64, upper: f64, from_s: f64, to_s: f64 },
    StaysInside { lower: f64, upper: f64, from_s: f64, to_s: f64 },
    NeverAfterSettling { upper: f64, after_s: f64 },
    Settles { band: f64, within_s: f64 },
    Responds { share: f64, within_s: f64 },
    Reaches { lower: f64, upper: f64, from_s: f64, to_s: f64 },
}

impl Template {
    /// From when to when it is asked [s], where it says so.
    pub fn stretch(&self) -> Option<(f64, f64)> {
        match *self {
            Template::Always { from_s, to_s, .. }
            | Template::StaysInside { from_s, to_s, .. }
            | Template::Reaches { from_s, to_s, .. } => Some((from_s, to_s)),
            _ => None,
        }
    }
}

/// A requirement on one lift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Requirement {
    /// Its place among the simulated lifts.
    pub lift: usize,
    pub signal: Signal,
    /// Over so many seconds the signal's peak to peak, in place of the signal.
    pub peak_to_peak_s: Option<f64>,
    pub template: Template,
}

/// One tick of one lift, in lanes.
#[derive(Debug, Clone, Copy)]
pub struct Moment<S> {
    pub speed: S,
    pub error: S,
    pub pressure: S,
    pub position: S,
    pub current: S,
    /// The speed asked for [m/s].
    pub request: S,
    /// By how much it changed at this tick [m/s].
    pub step: S,
    /// Ticks since it changed last.
    pub since: S,
}

impl<S: Scalar> Moment<S> {
    #[inline(always)]
    fn signal(&self, signal: Signal) -> S {
        match signal {
            Signal::Speed => self.speed,
            Signal::Error => self.error,
            Signal::Pressure => self.pressure,
            Signal::Position => self.position,
            Signal::Current => self.current,
        }
    }
}

/// A time as a number of ticks, to the nearest.
pub fn ticks(seconds: f64, tick_s: f64) -> f64 {
    (seconds / tick_s).round()
}

/// A requirement on its way: how near it came to being broken so far.
#[derive(Debug, Clone)]
pub struct Watch<S> {
    requirement: Requirement,
    window: Option<Extremes<S>>,
    /// Bounds in ticks: from and to, or after or within twice.
    span: (f64, f64),
    margin: S,
    /// Of `responds`: the nearest that this step came so far.
    nearest: S,
    /// Of `responds`: what this step has to come within, and its ticks so far; past the span none is awaited.
    tolerance: S,
    waited: S,
}

impl<S: Scalar> Watch<S> {
    pub fn new(requirement: Requirement, tick_s: f64) -> Self {
        let both = |seconds: f64| (ticks(seconds, tick_s), ticks(seconds, tick_s));
        let span = match requirement.template {
            Template::Always { from_s, to_s, .. }
            | Template::StaysInside { from_s, to_s, .. }
            | Template::Reaches { from_s, to_s, .. } => (ticks(from_s, tick_s), ticks(to_s, tick_s)),
            Template::NeverAfterSettling { after_s, .. } => both(after_s),
            Template::Settles { within_s, .. } | Template::Responds { within_s, .. } => both(within_s),
        };
        let begin = match requirement.template {
            Template::Reaches { .. } => f64::NEG_INFINITY,
            _ => f64::INFINITY,
        };
        // A window of n ticks spans n + 1 samples.
        let window = requirement.peak_to_peak_s.map(|length| Extremes::new(ticks(length, tick_s) as usize + 1));
        Watch {
            requirement,
            window,
            span,
            margin: S::constant(begin),
            nearest: S::constant(f64::NEG_INFINITY),
            tolerance: S::zero(),
            waited: S::constant(f64::INFINITY),
        }
    }

    /// What a member becomes that breaks it, whose oscillation grew by `growth` in its last second.
    pub fn broken(&self, growth: f64) -> Verdict {
        of_broken(&self.requirement, growth)
    }

    /// The margin so far.
    pub fn margin(&self) -> S {
        self.margin
    }

    /// Tick `k` of the lanes that are `counted`: the others have landed, or ceased to be finite.
    #[inline(always)]
    pub fn see(&mut self, k: usize, moment: &Moment<S>, counted: S::Mask) {
        let mut x = moment.signal(self.requirement.signal);
        if let Some(window) = &mut self.window {
            let (high, low) = window.push(x);
            x = high - low;
        }
        let number = S::constant;
        let (from, to) = self.span;
        let within = (k as f64) >= from && (k as f64) <= to;
        let inside = |lower: f64, upper: f64| (number(upper) - x).min(x - number(lower));
        match self.requirement.template {
            Template::Always { lower, upper, .. } | Template::StaysInside { lower, upper, .. } => {
                if within {
                    self.lower_to(inside(lower, upper), counted);
                }
            }
            Template::Reaches { lower, upper, .. } => {
                if within {
                    let better = S::select(counted, self.margin.max(inside(lower, upper)), self.margin);
                    self.margin = better;
                }
            }
            Template::NeverAfterSettling { upper, .. } => {
                let settled = moment.since.lt(number(from)).not();
                self.lower_to(number(upper) - x, counted.and(settled));
            }
            Template::Settles { band, .. } => {
                let settled = moment.since.lt(number(from)).not();
                self.lower_to(number(band) - x.abs(), counted.and(settled));
            }
            Template::Responds { share, .. } => {
                let stepped = number(0.0).lt(moment.step.abs()).and(counted);
                self.tolerance = S::select(stepped, number(1.0 - share) * moment.step.abs(), self.tolerance);
                self.nearest = S::select(stepped, number(f64::NEG_INFINITY), self.nearest);
                self.waited = S::select(stepped, S::zero(), self.waited + S::one());
                let away = (x - moment.request).abs();
                self.nearest = self.nearest.max(self.tolerance - away);
                let over = self.waited.lt(number(from)).not().and(self.waited.lt(number(from + 1.0)));
                self.lower_to(self.nearest, counted.and(over));
            }
        }
    }

    #[inline(always)]
    fn lower_to(&mut self, margin: S, counted: S::Mask) {
        self.margin = S::select(counted, self.margin.min(margin), self.margin);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Lanes;
    use proptest::prelude::*;

    const TICK: f64 = 0.02;

    /// Speeds and requests of a lowering, as moments.
    fn moments(speed: &[f64], request: &[f64]) -> Vec<Moment<f64>> {
        let mut since = 0.0;
        (0..speed.len())
            .map(|k| {
                let before = if k > 0 { request[k - 1] } else { 0.0 };
                let step = request[k] - before;
                since = if step == 0.0 { since + 1.0 } else { 0.0 };
                Moment {
                    speed: speed[k],
                    error: speed[k] - request[k],
                    pressure: 0.0,
                    position: 0.0,
                    current: 0.0,
                    request: request[k],
                    step,
                    since,
                }
            })
            .collect()
    }

    fn margin(requirement: Requirement, speed: &[f64], request: &[f64]) -> f64 {
        let mut watch = Watch::new(requirement, TICK);
        for (k, moment) in moments(speed, request).iter().enumerate() {
            watch.see(k, moment, true);
        }
        watch.margin()
    }

    fn on(signal: Signal, template: Template) -> Requirement {
        Requirement { lift: 0, signal, peak_to_peak_s: None, template }
    }

    const STEP: [f64; 6] = [0.0, 0.5, 0.5, 0.5, 0.5, 0.5];

    #[test]
    fn always_is_the_least_distance_from_the_bound() {
        let all = Template::Always { lower: f64::NEG_INFINITY, upper: 0.6, from_s: 0.0, to_s: f64::INFINITY };
        assert_eq!(margin(on(Signal::Speed, all), &[0.1, 0.5, 0.2], &STEP[..3]), 0.6 - 0.5);
        let later = Template::Always { lower: f64::NEG_INFINITY, upper: 0.6, from_s: 0.04, to_s: 0.04 };
        assert_eq!(margin(on(Signal::Speed, later), &[0.1, 0.5, 0.2, 0.9], &STEP[..4]), 0.6 - 0.2);
    }

    #[test]
    fn what_is_reached_late_or_never_has_a_negative_margin() {
        let reaches = Template::Reaches { lower: 0.4, upper: 0.6, from_s: 0.0, to_s: 0.06 };
        assert_eq!(margin(on(Signal::Speed, reaches), &[0.0, 0.1, 0.2, 0.3, 0.5], &STEP[..5]), 0.3 - 0.4);
    }

    #[test]
    fn a_step_must_settle_in_time_and_stay() {
        let settles = on(Signal::Error, Template::Settles { band: 0.1, within_s: 0.06 });
        assert!((margin(settles, &[0.0, 0.0, 0.3, 0.4, 0.45, 0.52], &STEP) - 0.05).abs() < 1e-15);
        assert!((margin(settles, &[0.0, 0.5, 0.5, 0.5, 0.5, 0.2], &STEP) + 0.2).abs() < 1e-15);
        assert_eq!(margin(settles, &STEP[..3], &STEP[..3]), f64::INFINITY);
    }

    #[test]
    fn a_step_is_answered_within_its_time_or_not() {
        let responds = on(Signal::Speed, Template::Responds { share: 0.8, within_s: 0.04 });
        // 80 % of a step of 0.5 leave 0.1.
        assert!((margin(responds, &[0.0, 0.0, 0.3, 0.45, 0.1, 0.1], &STEP) - 0.05).abs() < 1e-15);
        assert!((margin(responds, &[0.0, 0.0, 0.1, 0.3, 0.5, 0.5], &STEP) + 0.1).abs() < 1e-15);
        assert_eq!(margin(responds, &[0.0, 0.0], &STEP[..2]), f64::INFINITY);
    }

    #[test]
    fn peak_to_peak_counts_once_the_reference_has_stood_long_enough() {
        let calm = Requirement {
            peak_to_peak_s: Some(0.02),
            ..on(Signal::Speed, Template::NeverAfterSettling { upper: 0.1, after_s: 0.06 })
        };
        let found = margin(calm, &[0.0, 0.5, 0.9, 0.5, 0.5, 0.48], &STEP);
        assert!((found - 0.08).abs() < 1e-15, "{found}");
    }

    fn templates() -> Vec<Requirement> {
        vec![
            on(Signal::Speed, Template::Always { lower: -9.0, upper: 0.6, from_s: 0.0, to_s: 9.0 }),
            on(Signal::Error, Template::StaysInside { lower: -0.2, upper: 0.3, from_s: 0.1, to_s: 0.5 }),
            on(Signal::Speed, Template::Reaches { lower: 0.3, upper: 0.5, from_s: 0.0, to_s: 0.3 }),
            on(Signal::Error, Template::Settles { band: 0.1, within_s: 0.1 }),
            on(Signal::Speed, Template::Responds { share: 0.7, within_s: 0.08 }),
            Requirement {
                peak_to_peak_s: Some(0.1),
                ..on(Signal::Speed, Template::NeverAfterSettling { upper: 0.2, after_s: 0.1 })
            },
        ]
    }

    proptest! {
        #[test]
        fn every_template_in_lanes_is_that_of_each_lane(
            speed in proptest::array::uniform4(proptest::collection::vec(0.0..1.0f64, 60)),
            steps in proptest::array::uniform4(proptest::collection::vec(0usize..4, 6)),
        ) {
            let request: Vec<Vec<f64>> =
                steps.iter().map(|steps| (0..60).map(|k| 0.2 * steps[k / 10] as f64).collect()).collect();
            let each: Vec<_> = (0..4).map(|lane| moments(&speed[lane], &request[lane])).collect();
            for requirement in templates() {
                let mut watch = Watch::new(requirement, TICK);
                for k in 0..60 {
                    let of = |f: fn(&Moment<f64>) -> f64| Lanes::<4>(std::array::from_fn(|lane| f(&each[lane][k])));
                    let moment = Moment {
                        speed: of(|m| m.speed), error: of(|m| m.error), pressure: of(|m| m.pressure),
                        position: of(|m| m.position), current: of(|m| m.current), request: of(|m| m.request),
                        step: of(|m| m.step), since: of(|m| m.since),
                    };
                    watch.see(k, &moment, Lanes::<4>::zero().lt(Lanes::<4>::one()));
                }
                for lane in 0..4 {
                    let alone = margin(requirement, &speed[lane], &request[lane]);
                    prop_assert_eq!(watch.margin().0[lane].to_bits(), alone.to_bits());
                }
            }
        }
    }
}
