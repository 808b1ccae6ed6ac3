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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_reference_temperature_the_oil_has_its_reference_viscosity_exactly() {
        assert_eq!(viscosity(4.45e-5, 0.0050814, 293.0, 20.0), 4.45e-5);
    }

    #[test]
    fn each_kelvin_thins_the_oil_by_the_same_share() {
        let nu = |celsius: f64| viscosity(4.45e-5, 0.02, 293.0, celsius);
        for k in -40..120 {
            let t = f64::from(k);
            assert!((nu(t + 1.0) / nu(t) - (-0.02f64).exp()).abs() < 1e-14);
        }
    }
}
