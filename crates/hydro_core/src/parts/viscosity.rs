//! Viscosity of the oil against temperature.

use crate::scalar::Scalar;

/// ν = ν0·e^(−λ(T − T0)) [m²/s], T in °C (Fri & Fahlén 2017, (3.1)).
///
/// The thesis prints "dynamic viscosity [Pa s]"; only a kinematic one makes (3.8) dimensionless.
#[inline(always)]
pub fn viscosity<S: Scalar>(nu_0: S, lambda: S, t_0: S, oil_temperature_degc: S) -> S {
    let kelvin = oil_temperature_degc + S::constant(273.0);
    nu_0 * (-(lambda * (kelvin - t_0))).exp()
}
