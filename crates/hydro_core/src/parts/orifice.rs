//! Flow through an orifice, laminar at small and turbulent at large pressure differences.

use std::f64::consts::PI;

use crate::scalar::Scalar;

/// Q = C_D·A·√(2/ρ)·p/(p² + p_cr²)^¼ with p_cr = ρ/2·(Re_cr·ν/(C_D·D_H))² and D_H = √(4A/π)
/// (Fri & Fahlén 2017, (3.7)–(3.9)).
///
/// With w = A·p and c = A·p_cr = πρRe_cr²ν²/(8C_D²), which holds no area, this is
/// Q = C_D√(2/ρ)·A·w·((w² + c²)·A²)^(−¼): one fourth root, no division, no diameter.
#[derive(Debug, Clone, Copy)]
pub struct Orifice<S> {
    /// C_D·√(2/ρ).
    gain: S,
    /// c/ν² = πρRe_cr²/(8C_D²).
    critical: S,
}

/// A flow with its partial derivatives, without dual numbers: what a Newton step needs.
#[derive(Debug, Clone, Copy)]
pub struct Flow<S> {
    /// Q [m³/s], along the pressure drop.
    pub q: S,
    /// ∂Q/∂p.
    pub by_pressure: S,
    /// ∂Q/∂A.
    pub by_area: S,
}

impl<S: Scalar> Orifice<S> {
    pub fn new(c_d: S, re_cr: S, density: S) -> Self {
        Orifice {
            gain: c_d * (S::constant(2.0) / density).sqrt(),
            critical: S::constant(PI / 8.0) * density * (re_cr * re_cr) / (c_d * c_d),
        }
    }

    /// The same orifice with another gain C_D·√(2/ρ), the critical pressure as it is.
    #[inline(always)]
    pub fn with_gain(&self, gain: impl Fn(S) -> S) -> Self {
        Orifice { gain: gain(self.gain), critical: self.critical }
    }

    /// The same orifice without derivatives.
    #[inline(always)]
    pub fn real(&self) -> Orifice<S::Real> {
        Orifice { gain: self.gain.real(), critical: self.critical.real() }
    }

    /// c² at the viscosity ν; the oil's temperature changes slowly, so this is kept.
    #[inline(always)]
    pub fn critical_squared(&self, nu: S) -> S {
        let c = self.critical * nu * nu;
        c * c
    }

    /// Q [m³/s] at the opening `area` > 0 [m²] and the pressure drop `p` [Pa].
    #[inline(always)]
    pub fn flow(&self, c2: S, area: S, p: S) -> S {
        let w = area * p;
        self.gain * (area * w) * ((w * w + c2) * (area * area)).inverse_fourth_root()
    }

    /// Q with its derivatives.
    #[inline(always)]
    pub fn flow_and_slopes(&self, c2: S, area: S, p: S) -> Flow<S> {
        let w = area * p;
        let a2 = area * area;
        let y = ((w * w + c2) * a2).inverse_fourth_root();
        let per_pressure = self.gain * (a2 * y);
        let y2 = y * y;
        // y⁴A² = 1/(w² + c²), the laminar share of the square.
        let turbulent = (w * w) * (y2 * y2 * a2);
        let half = S::constant(0.5);
        Flow {
            q: per_pressure * p,
            by_pressure: per_pressure * (S::one() - half * turbulent),
            by_area: self.gain * (w * y) * (S::constant(1.5) - half * turbulent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;
    use proptest::prelude::*;

    /// (3.7) to (3.9) as printed.
    fn printed(c_d: f64, re_cr: f64, density: f64, nu: f64, area: f64, p: f64) -> f64 {
        let p_cr = critical_pressure(c_d, re_cr, density, nu, area);
        c_d * area * (2.0 / density).sqrt() * p / (p * p + p_cr * p_cr).powf(0.25)
    }

    fn critical_pressure(c_d: f64, re_cr: f64, density: f64, nu: f64, area: f64) -> f64 {
        let d_h = (4.0 * area / PI).sqrt();
        density / 2.0 * (re_cr * nu / (c_d * d_h)).powi(2)
    }

    fn decades(lower: f64, upper: f64) -> impl Strategy<Value = f64> {
        (lower.ln()..upper.ln()).prop_map(f64::exp)
    }

    prop_compose! {
        /// c_d, re_cr, density, nu, area over the range of trucks and oils.
        fn anywhere()(
            c_d in decades(0.1, 1.5), re_cr in decades(1.0, 1e6), density in decades(600.0, 1300.0),
            nu in decades(1e-7, 1e-2), area in decades(1e-13, 1e-3),
        ) -> [f64; 5] {
            [c_d, re_cr, density, nu, area]
        }
    }

    proptest! {
        #[test]
        fn the_flow_is_that_of_the_printed_formula([c_d, re_cr, density, nu, area] in anywhere(), p in decades(1e-3, 1e9)) {
            let orifice = Orifice::new(c_d, re_cr, density);
            let (got, want) = (orifice.flow(orifice.critical_squared(nu), area, p), printed(c_d, re_cr, density, nu, area, p));
            prop_assert!((got / want - 1.0).abs() < 1e-13, "{} {}", got, want);
        }

        #[test]
        fn no_orifice_creates_energy_and_the_flow_is_odd([c_d, re_cr, density, nu, area] in anywhere(), p in decades(1e-3, 1e9)) {
            let orifice = Orifice::new(c_d, re_cr, density);
            let c2 = orifice.critical_squared(nu);
            let (forth, back) = (orifice.flow(c2, area, p), orifice.flow(c2, area, -p));
            prop_assert!(forth * p > 0.0);
            prop_assert_eq!(forth.to_bits(), (-back).to_bits());
            prop_assert_eq!(orifice.flow(c2, area, 0.0), 0.0);
        }

        #[test]
        fn more_pressure_and_a_wider_opening_give_more_flow(
            [c_d, re_cr, density, nu, area] in anywhere(), p in decades(1e-3, 1e9), more in decades(1e-9, 10.0),
        ) {
            let orifice = Orifice::new(c_d, re_cr, density);
            let c2 = orifice.critical_squared(nu);
            let flow = orifice.flow(c2, area, p);
            prop_assert!(orifice.flow(c2, area, p * (1.0 + more)) > flow);
            prop_assert!(orifice.flow(c2, area * (1.0 + more), p) > flow);
        }

        #[test]
        fn far_below_the_critical_pressure_flow_is_laminar_and_far_above_turbulent(
            [c_d, re_cr, density, nu, area] in anywhere(), far in decades(1e1, 1e4),
        ) {
            let orifice = Orifice::new(c_d, re_cr, density);
            let (c2, p_cr) = (orifice.critical_squared(nu), critical_pressure(c_d, re_cr, density, nu, area));
            // (1 + x²)^(−¼) differs from one by less than x²/4.
            let close = 0.25 / (far * far) + 1e-13;
            let laminar = c_d * area * (2.0 / (density * p_cr)).sqrt();
            let slow = orifice.flow(c2, area, p_cr / far) / (laminar * p_cr / far);
            let turbulent = c_d * area * (2.0 * p_cr * far / density).sqrt();
            let fast = orifice.flow(c2, area, p_cr * far) / turbulent;
            prop_assert!((slow - 1.0).abs() < close && (fast - 1.0).abs() < close, "{} {}", slow, fast);
        }

        #[test]
        fn the_slopes_of_a_newton_step_are_the_exact_derivatives(
            [c_d, re_cr, density, nu, area] in anywhere(), p in decades(1e-3, 1e9), up in any::<bool>(),
        ) {
            let p = if up { p } else { -p };
            let orifice = Orifice::new(c_d, re_cr, density);
            let slopes = orifice.flow_and_slopes(orifice.critical_squared(nu), area, p);
            type D = Dual<f64, 2>;
            let orifice = Orifice::new(D::constant(c_d), D::constant(re_cr), D::constant(density));
            let c2 = orifice.critical_squared(D::constant(nu));
            let exact = orifice.flow(c2, D::variable(area, 0), D::variable(p, 1));
            prop_assert!((slopes.q / exact.re - 1.0).abs() < 1e-14);
            prop_assert!((slopes.by_area / exact.eps[0] - 1.0).abs() < 1e-13);
            prop_assert!((slopes.by_pressure / exact.eps[1] - 1.0).abs() < 1e-13);
        }
    }
}
