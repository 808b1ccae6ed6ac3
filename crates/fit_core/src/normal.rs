//! The normal distribution's logarithm.

use std::f64::consts::FRAC_1_SQRT_2;

/// Below it erfc comes near the smallest numbers there are.
const FAR: f64 = -30.0;
/// ½ ln 2π.
pub const HALF_LN_TWO_PI: f64 = 0.918_938_533_204_672_741_8;

/// ln Φ(x), from its tail where that is the smaller number.
#[inline]
pub fn ln_cdf(x: f64) -> f64 {
    if x < FAR {
        // Abramowitz & Stegun (1964), 26.2.12; what it leaves out is below 3e-16 of the sum.
        let z = 1.0 / (x * x);
        let tail = z * (-1.0 + z * (3.0 + z * (-15.0 + z * (105.0 + z * (-945.0 + z * 10_395.0)))));
        return -0.5 * x * x - libm::log(-x) - HALF_LN_TWO_PI + libm::log1p(tail);
    }
    if x < -1.0 {
        return libm::log(0.5 * libm::erfc(-x * FRAC_1_SQRT_2));
    }
    libm::log1p(-0.5 * libm::erfc(x * FRAC_1_SQRT_2))
}
