//! The small volume between proportional valve and compensator.

use crate::scalar::Scalar;

/// dp_B/dt = E/V·(q_A − q_B) [Pa/s] (Fri & Fahlén 2017, (3.19)).
#[inline(always)]
pub fn pressure_rate<S: Scalar>(bulk_over_volume: S, q_a: S, q_b: S) -> S {
    bulk_over_volume * (q_a - q_b)
}
