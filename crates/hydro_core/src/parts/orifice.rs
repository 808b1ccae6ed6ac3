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
