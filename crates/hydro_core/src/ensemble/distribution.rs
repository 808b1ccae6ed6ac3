//! How a varied quantity is distributed: its quantile function, which turns a uniform number into a value.

use crate::error::{refuse, Error};

/// The distribution of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum Distribution {
    /// Even between two values.
    Uniform { lower: f64, upper: f64 },
    /// Even in the logarithm between two positive values.
    LogUniform { lower: f64, upper: f64 },
    /// Normal, cut off at two values.
    Normal { mean: f64, deviation: f64, lower: f64, upper: f64 },
    /// Its logarithm is normal: `median` and the standard deviation of the logarithm, cut off at two values.
    LogNormal { median: f64, deviation: f64, lower: f64, upper: f64 },
    /// Any of the values, all alike.
    Choice(Vec<f64>),
}

impl Distribution {
    /// # Errors
    /// A range that does not rise, a width that is not positive, no value to choose.
    pub fn check(&self, name: &str) -> Result<(), Error> {
        let refuse = |value: String, requirement: &str| refuse(name, value, requirement);
        let rises = |lower: f64, upper: f64| lower < upper && lower.is_finite() && upper.is_finite();
        match self {
            Distribution::Uniform { lower, upper } if !rises(*lower, *upper) => {
                refuse(format!("[{lower}, {upper}]"), "two finite numbers that rise")
            }
            Distribution::LogUniform { lower, upper } if !(rises(*lower, *upper) && *lower > 0.0) => {
                refuse(format!("[{lower}, {upper}]"), "two positive numbers that rise")
            }
            Distribution::Normal { mean, deviation, lower, upper } if !(*deviation > 0.0 && mean.is_finite()) => {
                refuse(
                    format!("mean {mean}, standard deviation {deviation}, from {lower} to {upper}"),
                    "a finite mean and a positive standard deviation",
                )
            }
            Distribution::LogNormal { median, deviation, .. } if !(*deviation > 0.0 && *median > 0.0) => refuse(
                format!("median {median}, standard deviation of the logarithm {deviation}"),
                "a positive median and a positive standard deviation",
            ),
            Distribution::Normal { lower, upper, .. } | Distribution::LogNormal { lower, upper, .. }
                if lower.is_nan() || upper.is_nan() || lower >= upper =>
            {
                refuse(format!("from {lower} to {upper}"), "cut off at two numbers that rise")
            }
            Distribution::Choice(values) if values.is_empty() || values.iter().any(|v| !v.is_finite()) => {
                refuse(format!("{values:?}"), "one or more finite numbers")
            }
            _ => Ok(()),
        }
    }

    /// The value below which a share `u` of (0, 1) lies.
    pub fn quantile(&self, u: f64) -> f64 {
        match self {
            Distribution::Uniform { lower, upper } => lower + u * (upper - lower),
            Distribution::LogUniform { lower, upper } => {
                let (low, high) = (libm::log(*lower), libm::log(*upper));
                libm::exp(low + u * (high - low)).clamp(*lower, *upper)
            }
            Distribution::Normal { mean, deviation, lower, upper } => {
                let z = cut((lower - mean) / deviation, (upper - mean) / deviation, u);
                (mean + deviation * z).clamp(*lower, *upper)
            }
            Distribution::LogNormal { median, deviation, lower, upper } => {
                let standard = |x: f64| if x > 0.0 { libm::log(x / median) / deviation } else { f64::NEG_INFINITY };
                (median * libm::exp(deviation * cut(standard(*lower), standard(*upper), u))).clamp(*lower, *upper)
            }
            Distribution::Choice(values) => values[((u * values.len() as f64) as usize).min(values.len() - 1)],
        }
    }
}

/// The quantile of a standard normal number between two.
fn cut(lower: f64, upper: f64, u: f64) -> f64 {
    // In the upper tail by its mirror image, where the distribution function is still resolved.
    if lower > 0.0 {
        return -cut(-upper, -lower, 1.0 - u);
    }
    let (below, above) = (normal_cdf(lower), normal_cdf(upper));
    normal_quantile(below + u * (above - below))
}

/// The standard normal distribution function.
pub fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// The standard normal quantile, to some 1e-16 of itself (Wichura 1988, algorithm AS 241, PPND16).
pub fn normal_quantile(p: f64) -> f64 {
    let polynomial = |c: &[f64], x: f64| c.iter().rev().fold(0.0, |sum, &c| sum * x + c);
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        let r = 0.180625 - q * q;
        return q * polynomial(&CENTRE.0, r) / polynomial(&CENTRE.1, r);
    }
    let r = if q < 0.0 { p } else { 1.0 - p };
    if r <= 0.0 {
        return if q < 0.0 { f64::NEG_INFINITY } else { f64::INFINITY };
    }
    let r = (-libm::log(r)).sqrt();
    let z = if r <= 5.0 {
        polynomial(&MIDDLE.0, r - 1.6) / polynomial(&MIDDLE.1, r - 1.6)
    } else {
        polynomial(&TAIL.0, r - 5.0) / polynomial(&TAIL.1, r - 5.0)
    };
    if q < 0.0 {
        -z
    } else {
        z
    }
}

type Ratio = ([f64; 8], [f64; 8]);
const CENTRE: Ratio = (
    [
        3.3871328727963666080,
        133.14166789178437745,
        1971.5909503065514427,
        13731.693765509461125,
        45921.953931549871457,
        67265.770927008700853,
        33430.575583588128105,
        2509.0809287301226727,
    ],
    [
        1.0,
        42.313330701600911252,
        687.18700749205790830,
        5394.1960214247511077,
        21213.794301586595867,
        39307.895800092710610,
        28729.085735721942674,
        5226.4952788528545610,
    ],
);
const MIDDLE: Ratio = (
    [
        1.42343711074968357734,
        4.63033784615654529590,
        5.76949722146069140550,
        3.64784832476320460504,
        1.27045825245236838258,
        0.241780725177450611770,
        0.0227238449892691845833,
        7.74545014278341407640e-4,
    ],
    [
        1.0,
        2.05319162663775882187,
        1.67638483018380384940,
        0.689767334985100004550,
        0.148103976427480074590,
        0.0151986665636164571966,
        5.47593808499534494600e-4,
        1.05075007164441684324e-9,
    ],
);
const TAIL: Ratio = (
    [
        6.65790464350110377720,
        5.46378491116411436990,
        1.78482653991729133580,
        0.296560571828504891230,
        0.0265321895265761230930,
        0.00124266094738807843860,
        2.71155556874348757815e-5,
        2.01033439929228813265e-7,
    ],
    [
        1.0,
        0.599832206555887937690,
        0.136929880922735805310,
        0.0148753612908506148525,
        7.86869131145613259100e-4,
        1.84631831751005468180e-5,
        1.42151175831644588870e-7,
        2.04426310338993978564e-15,
    ],
);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ALL: fn() -> Vec<Distribution> = || {
        vec![
            Distribution::Uniform { lower: -2.0, upper: 3.0 },
            Distribution::LogUniform { lower: 1e-6, upper: 2.0 },
            Distribution::Normal { mean: 1.0, deviation: 2.0, lower: -1.0, upper: 6.0 },
            Distribution::Normal { mean: 0.0, deviation: 1.0, lower: 9.0, upper: 12.0 },
            Distribution::LogNormal { median: 3.0, deviation: 0.2, lower: 1.0, upper: f64::INFINITY },
            Distribution::Choice(vec![1.0, 2.0, 5.0]),
        ]
    };

    proptest! {
        #[test]
        fn the_normal_quantile_undoes_the_distribution_function(z in -8.0..8.0f64) {
            let p = normal_cdf(z);
            // Near 1 the probability itself is rounded.
            prop_assume!(p < 1.0);
            let rounding = f64::EPSILON / (-0.5 * z * z).exp();
            prop_assert!((normal_quantile(p) - z).abs() < 1e-12 + 4.0 * rounding, "{}", normal_quantile(p));
        }

        #[test]
        fn a_quantile_does_not_fall_and_stays_within_its_range(a in 1e-9..1.0f64, b in 1e-9..1.0f64) {
            prop_assume!(a < b && b < 1.0);
            for distribution in ALL() {
                let (low, high) = (distribution.quantile(a), distribution.quantile(b));
                prop_assert!(low <= high && low.is_finite() && high.is_finite(), "{:?} {} {}", distribution, low, high);
                distribution.check("x").unwrap();
            }
        }
    }

    #[test]
    fn a_wrong_distribution_is_refused() {
        let wrong = [
            Distribution::Uniform { lower: 1.0, upper: 1.0 },
            Distribution::LogUniform { lower: 0.0, upper: 1.0 },
            Distribution::Normal { mean: 0.0, deviation: 0.0, lower: -1.0, upper: 1.0 },
            Distribution::Normal { mean: 0.0, deviation: 1.0, lower: 1.0, upper: -1.0 },
            Distribution::LogNormal { median: -1.0, deviation: 1.0, lower: 0.0, upper: 1.0 },
            Distribution::Choice(Vec::new()),
        ];
        for distribution in wrong {
            assert!(distribution.check("x").is_err(), "{distribution:?}");
        }
    }
}
