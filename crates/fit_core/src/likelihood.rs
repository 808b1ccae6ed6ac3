//! How unlikely a sample is, given what the model says: as a residual whose square is −2 ln of it.
//!
//! Each rule gives a residual ρ and its derivative along the model's value, so that the sum of ρ² is −2 ln L up to
//! a constant and a least-squares search follows the likelihood itself.

use crate::normal::{ln_cdf, HALF_LN_TWO_PI};

/// Residuals, in standard deviations, beyond which a sample counts by its distance and not by its square.
pub const HUBER: f64 = 4.0;
/// Below this residual its derivative is that in the middle of the interval: ρ/ρ' would be 0/0 there.
const INNER: f64 = 1e-4;
/// ρ below which the derivative of what is censored is none.
const NONE: f64 = 1e-150;

/// How a sensor errs, at the weight of a search.
#[derive(Debug, Clone, Copy)]
pub enum Rule {
    /// Noise of standard deviation `sigma` with the odd bad sample; at one of its ends the sensor tells only that the
    /// truth lies there or beyond.
    Noisy { sigma: f64, ends: [f64; 2] },
    /// An encoder that rounds down.
    Rounded(Interval),
}

impl Rule {
    /// Of a sensor that rounds down to `count`, where that is not 0. Of an encoder `sigma` is the softness.
    pub fn of(sigma: f64, count: f64, ends: [f64; 2]) -> Self {
        if count == 0.0 {
            Rule::Noisy { sigma, ends }
        } else {
            Rule::Rounded(Interval::new(count, sigma))
        }
    }

    /// ρ, and its derivative along what the model says.
    #[inline]
    pub fn misfit(&self, read: f64, model: f64) -> (f64, f64) {
        match self {
            Rule::Rounded(interval) => interval.misfit(read, model),
            &Rule::Noisy { sigma, ends: [least, most] } => {
                if read >= most {
                    censored(most, model, sigma, 1.0)
                } else if read <= least {
                    censored(least, model, sigma, -1.0)
                } else {
                    gaussian(read, model, sigma)
                }
            }
        }
    }

    /// ρ alone, to the bit the same: a search asks for it more often.
    #[inline]
    pub fn residual(&self, read: f64, model: f64) -> f64 {
        match self {
            Rule::Rounded(interval) => interval.residual(read, model).0,
            Rule::Noisy { .. } => self.misfit(read, model).0,
        }
    }
}

/// With r = (model − measured)/σ: ρ = r up to [`HUBER`], beyond it ρ² = 2k|r| − k² (Huber 1964).
#[inline]
fn gaussian(measured: f64, model: f64, sigma: f64) -> (f64, f64) {
    let r = (model - measured) / sigma;
    if r.abs() > HUBER {
        let rho = (2.0 * HUBER * r.abs() - HUBER * HUBER).sqrt();
        (rho.copysign(r), HUBER / rho / sigma)
    } else {
        (r, 1.0 / sigma)
    }
}

/// The truth lies at the end of what a sensor reads, or beyond (Tobin 1958): ρ² = −2 ln Φ(u),
/// u = ±(model − end)/σ, `sign` 1 for a ceiling, −1 for a floor. Far short of the end this is the distance; like
/// [`gaussian`], it grows with the root of it beyond [`HUBER`].
fn censored(end: f64, model: f64, sigma: f64, sign: f64) -> (f64, f64) {
    let u = sign * (model - end) / sigma;
    let ln_p = ln_cdf(u);
    let rho = (-2.0 * ln_p).sqrt();
    // dρ/du.
    let falls = if rho > NONE { -libm::exp(-0.5 * u * u - HALF_LN_TWO_PI - ln_p) / rho } else { 0.0 };
    let (rho, falls) = if rho > HUBER {
        let damped = (2.0 * HUBER * rho - HUBER * HUBER).sqrt();
        (damped, falls * HUBER / damped)
    } else {
        (rho, falls)
    };
    (-sign * rho, -falls / sigma)
}

/// An encoder that rounds down: the truth lies in [read, read + count), up to an error of `softness`.
///
/// P = Φ((read + count − model)/s) − Φ((read − model)/s), and ρ² = −2 ln(P/P₀) with P₀ the largest P there is, in the
/// middle: nothing is told inside the interval, and beyond it the distance counts as with Gaussian noise of s. For
/// s ≫ count this is Gaussian noise of s around the middle.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    softness: f64,
    /// Of a count, in s.
    half: f64,
    /// ln P₀.
    central: f64,
    /// √(−d² ln P/du²) in the middle, which is 2h φ(h)/P₀.
    inner: f64,
}

impl Interval {
    pub fn new(count: f64, softness: f64) -> Self {
        let half = 0.5 * count / softness;
        let central = between(half, 0.0);
        let curvature = 2.0 * half * libm::exp(-0.5 * half * half - HALF_LN_TWO_PI - central);
        Interval { softness, half, central, inner: curvature.sqrt() }
    }

    /// Sum of −2 ln P of samples, P₀ not taken off: what tells which softness they have.
    pub fn cost<'a>(&self, samples: impl Iterator<Item = (&'a f64, &'a f64)>) -> f64 {
        samples.map(|(&read, &model)| -2.0 * self.ln_p(read, model).1).sum()
    }

    /// How far the model lies from the middle, in s, and ln P.
    #[inline]
    fn ln_p(&self, read: f64, model: f64) -> (f64, f64) {
        let u = (model - read) / self.softness - self.half;
        (u, between(self.half, u.abs()))
    }

    /// ρ, how far the model lies from the middle, in s, and ln P.
    #[inline]
    fn residual(&self, read: f64, model: f64) -> (f64, f64, f64) {
        let (u, ln_p) = self.ln_p(read, model);
        let square = -2.0 * (ln_p - self.central);
        // Not by `max`, which would make a number of what is none.
        let rho = if square < 0.0 { 0.0 } else { square.sqrt() };
        (if u < 0.0 { -rho } else { rho }, u.abs(), ln_p)
    }

    #[inline]
    fn misfit(&self, read: f64, model: f64) -> (f64, f64) {
        let (rho, off, ln_p) = self.residual(read, model);
        if rho.abs() < INNER {
            return (rho, self.inner / self.softness);
        }
        // d ln P/d off = (φ(half + off) − φ(half − off))/P, ratios in logarithms
        let ratio = |z: f64| libm::exp(-0.5 * z * z - HALF_LN_TWO_PI - ln_p);
        let falls = ratio(self.half + off) - ratio(self.half - off);
        (rho, -falls / rho.abs() / self.softness)
    }
}

/// ln(Φ(half − off) − Φ(−half − off)), without cancellation far out: by the larger of the two logarithms.
#[inline]
fn between(half: f64, off: f64) -> f64 {
    let (near, far) = (ln_cdf(half - off), ln_cdf(-half - off));
    near + libm::log(-libm::expm1(far - near))
}
