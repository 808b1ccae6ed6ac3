//! Whether a member is stable, and if not, why.

use super::requirement::{Requirement, Signal, Template};

/// A verdict has one word and one meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Stable,
    MissedTarget,
    Overspeed,
    SustainedOscillation,
    LimitCycle,
    Divergence,
    OutOfBounds,
    NotFinite,
}

/// The verdicts by their number, with word and meaning.
pub const VERDICTS: &[(Verdict, &str, &str)] = &[
    (Verdict::Stable, "stable", "every requirement is met"),
    (Verdict::MissedTarget, "missed_target", "a requirement on following the reference, or any other, is broken"),
    (Verdict::Overspeed, "overspeed", "an upper bound on the speed, which has no other, is broken"),
    (
        Verdict::SustainedOscillation,
        "sustained_oscillation",
        "oscillation after settling is broken as a requirement, though it decays from one second to the next",
    ),
    (
        Verdict::LimitCycle,
        "limit_cycle",
        "oscillation after settling is broken as a requirement, and stays as it is from one second to the next",
    ),
    (
        Verdict::Divergence,
        "divergence",
        "oscillation after settling is broken as a requirement, and grows from one second to the next",
    ),
    (
        Verdict::OutOfBounds,
        "out_of_bounds",
        "a value drawn for the member is outside its parameter's bounds, or its controller cannot be made",
    ),
    (Verdict::NotFinite, "not_finite", "the simulation ceased to be finite"),
];

/// An oscillation whose peak to peak changes by less than this share from one second to the next stays as it is: the
/// line between the three words is a definition.
pub const STEADY_SHARE: f64 = 0.1;

/// What a broken requirement makes of a member whose oscillation grew by the natural logarithm `growth` in the last
/// second; not a number where it has no two steady seconds. Only a peak to peak speaks of an oscillation.
pub fn of_broken(requirement: &Requirement, growth: f64) -> Verdict {
    let swings = requirement.peak_to_peak_s.is_some();
    // Of two bounds either may be the one that is broken.
    let from_below = matches!(requirement.template, Template::Always { lower, .. } if lower > f64::NEG_INFINITY);
    match requirement.template {
        Template::NeverAfterSettling { .. } if swings && growth > libm::log(1.0 + STEADY_SHARE) => Verdict::Divergence,
        Template::NeverAfterSettling { .. } if swings && growth < libm::log(1.0 - STEADY_SHARE) => {
            Verdict::SustainedOscillation
        }
        Template::NeverAfterSettling { .. } if swings => Verdict::LimitCycle,
        Template::Always { upper, .. } | Template::NeverAfterSettling { upper, .. }
            if !swings && requirement.signal == Signal::Speed && upper < f64::INFINITY && !from_below =>
        {
            Verdict::Overspeed
        }
        _ => Verdict::MissedTarget,
    }
}

/// The graver of two.
pub fn graver(a: Verdict, b: Verdict) -> Verdict {
    if b as u8 > a as u8 {
        b
    } else {
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_stand_in_the_order_of_their_numbers() {
        for (k, (verdict, ..)) in VERDICTS.iter().enumerate() {
            assert_eq!(*verdict as usize, k);
        }
    }

    #[test]
    fn an_oscillation_is_named_by_what_becomes_of_it() {
        let template = Template::NeverAfterSettling { upper: 0.1, after_s: 2.0 };
        let calm = Requirement { lift: 0, signal: Signal::Speed, peak_to_peak_s: Some(1.0), template };
        let of = |growth| of_broken(&calm, growth);
        assert_eq!(of(0.2), Verdict::Divergence);
        assert_eq!(of(0.0), Verdict::LimitCycle);
        assert_eq!(of(f64::NAN), Verdict::LimitCycle);
        assert_eq!(of(-0.2), Verdict::SustainedOscillation);
        assert_eq!(graver(Verdict::Overspeed, Verdict::MissedTarget), Verdict::Overspeed);
    }

    #[test]
    fn only_an_upper_bound_of_the_speed_itself_is_overspeed_and_only_a_peak_to_peak_oscillates() {
        let of = |signal, peak_to_peak_s, template| {
            of_broken(&Requirement { lift: 0, signal, peak_to_peak_s, template }, 0.2)
        };
        let always = |lower, upper| Template::Always { lower, upper, from_s: 0.0, to_s: 9.0 };
        let (least, most) = (always(0.1, f64::INFINITY), always(f64::NEG_INFINITY, 0.6));
        let later = Template::NeverAfterSettling { upper: 0.1, after_s: 2.0 };
        assert_eq!(of(Signal::Speed, None, most), Verdict::Overspeed);
        assert_eq!(of(Signal::Speed, None, later), Verdict::Overspeed);
        assert_eq!(of(Signal::Speed, None, least), Verdict::MissedTarget);
        assert_eq!(of(Signal::Speed, None, always(0.1, 0.6)), Verdict::MissedTarget);
        assert_eq!(of(Signal::Speed, Some(1.0), most), Verdict::MissedTarget);
        assert_eq!(of(Signal::Pressure, None, most), Verdict::MissedTarget);
        assert_eq!(of(Signal::Error, None, later), Verdict::MissedTarget);
        assert_eq!(of(Signal::Pressure, Some(1.0), later), Verdict::Divergence);
    }
}
