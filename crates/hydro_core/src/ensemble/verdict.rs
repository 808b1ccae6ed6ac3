//! Whether a member is stable, and if not, why.

use super::requirement::{Signal, Template};

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
    (Verdict::Overspeed, "overspeed", "a bound on the speed is broken"),
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
    (Verdict::OutOfBounds, "out_of_bounds", "a value drawn for the member is outside its parameter's bounds"),
    (Verdict::NotFinite, "not_finite", "the simulation ceased to be finite"),
];

/// An oscillation whose peak to peak changes by less than this share from one second to the next stays as it is: the
/// line between the three words is a definition.
pub const STEADY_SHARE: f64 = 0.1;

/// What a broken requirement makes of a member whose oscillation grew by the natural logarithm `growth` in the last
/// second; not a number where it has no two steady seconds.
pub fn of_broken(template: &Template, signal: Signal, growth: f64) -> Verdict {
    match template {
        Template::NeverAfterSettling { .. } if growth > libm::log(1.0 + STEADY_SHARE) => Verdict::Divergence,
        Template::NeverAfterSettling { .. } if growth < libm::log(1.0 - STEADY_SHARE) => Verdict::SustainedOscillation,
        Template::NeverAfterSettling { .. } => Verdict::LimitCycle,
        Template::Always { .. } if signal == Signal::Speed => Verdict::Overspeed,
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
        let calm = Template::NeverAfterSettling { upper: 0.1, after_s: 2.0 };
        let of = |growth| of_broken(&calm, Signal::Speed, growth);
        assert_eq!(of(0.2), Verdict::Divergence);
        assert_eq!(of(0.0), Verdict::LimitCycle);
        assert_eq!(of(f64::NAN), Verdict::LimitCycle);
        assert_eq!(of(-0.2), Verdict::SustainedOscillation);
        assert_eq!(graver(Verdict::Overspeed, Verdict::MissedTarget), Verdict::Overspeed);
    }
}
