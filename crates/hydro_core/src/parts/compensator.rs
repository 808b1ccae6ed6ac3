//! Pressure compensator: opening in steady state with flow force, first-order dynamics.

use crate::scalar::Scalar;

/// A_s = A_max − k(p_xy + p_flow − p_set), held in [A_leak, A_max], k = (A_max − A_leak)/p_reg,
/// p_flow = (p_C − p_D)·A·C_D·cos θ/A_spool, dA/dt = (A_s − A)/τ
/// (Fri & Fahlén 2017, (3.15) with the order of Figure A.9, (3.16), (3.17)).
/// p_xy = p_A − p_B is the drop across the proportional valve.
#[derive(Debug, Clone, Copy)]
pub struct Compensator<S> {
    pub a_max: S,
    pub a_leak: S,
    pub slope: S,
    pub p_set: S,
    pub flow_force: S,
    pub inverse_tau: S,
}

impl<S: Scalar> Compensator<S> {
    #[allow(clippy::too_many_arguments)] // the parameters of (3.15) to (3.17)
    pub fn new(a_max: S, a_leak: S, a_spool: S, p_reg: S, p_set: S, tau: S, c_d: S, theta: S) -> Self {
        Compensator {
            a_max,
            a_leak,
            slope: (a_max - a_leak) / p_reg,
            p_set,
            flow_force: c_d * theta.cos() / a_spool,
            inverse_tau: S::one() / tau,
        }
    }

    /// A_s [m²] at the drops across valve and compensator [Pa] and the present opening [m²].
    #[inline(always)]
    pub fn steady_area(&self, p_xy: S, p_cd: S, area: S, p_set: S) -> S {
        let p_flow = p_cd * area * self.flow_force;
        (self.a_max - self.slope * (p_xy + p_flow - p_set)).clamp_to(self.a_leak, self.a_max)
    }

    /// The opening [m²] that is its own A_s, at a drop `p_cd` ≥ 0: (3.15) is linear in the opening.
    #[inline(always)]
    pub fn settled_area(&self, p_xy: S, p_cd: S, p_set: S) -> S {
        let open = self.a_max - self.slope * (p_xy - p_set);
        (open / (S::one() + self.slope * self.flow_force * p_cd)).clamp_to(self.a_leak, self.a_max)
    }

    /// dA/dt [m²/s].
    #[inline(always)]
    pub fn rate(&self, p_xy: S, p_cd: S, area: S, p_set: S) -> S {
        (self.steady_area(p_xy, p_cd, area, p_set) - area) * self.inverse_tau
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The free lift's of Table 5.1.
    fn thesis() -> Compensator<f64> {
        Compensator::new(1e-4, 1e-9, 3.14e-4, 2.7e5, 5.4e5, 0.01, 0.84417, 0.63222)
    }

    #[test]
    fn without_flow_force_it_opens_below_the_preset_pressure_and_closes_a_regulation_range_above() {
        let c = thesis();
        assert_eq!(c.steady_area(5.4e5, 0.0, 1e-5, c.p_set), c.a_max);
        assert_eq!(c.steady_area(0.0, 0.0, 1e-5, c.p_set), c.a_max);
        assert!((c.steady_area(5.4e5 + 1.35e5, 0.0, 1e-5, c.p_set) - 0.5 * (c.a_max + c.a_leak)).abs() < 1e-18);
        assert!((c.steady_area(8.1e5, 0.0, 1e-5, c.p_set) - c.a_leak).abs() < 1e-18);
        assert_eq!(c.steady_area(9e5, 0.0, 1e-5, c.p_set), c.a_leak);
    }

    #[test]
    fn the_flow_force_is_the_jets_momentum_over_the_spool() {
        // (3.16): p_flow = (p_C − p_D)·A·C_D·cos θ/A_spool, and it counts like the drop p_xy.
        let c = thesis();
        let p_flow = 2e6 * 3e-5 * 0.84417 * 0.63222f64.cos() / 3.14e-4;
        let with = c.steady_area(5.5e5, 2e6, 3e-5, c.p_set);
        let instead = c.steady_area(5.5e5 + p_flow, 0.0, 3e-5, c.p_set);
        assert!(with > c.a_leak && with < c.a_max);
        assert!((with - instead).abs() < 1e-18);
    }

    #[test]
    fn its_opening_follows_in_its_time_constant() {
        let c = thesis();
        assert!((c.rate(0.0, 0.0, 4e-5, c.p_set) - 6e-5 / 0.01).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn settled_it_has_the_opening_that_its_drops_ask_for(p_xy in 0.0..1e7f64, p_cd in 0.0..1e7f64) {
            let c = thesis();
            let area = c.settled_area(p_xy, p_cd, c.p_set);
            prop_assert!((c.steady_area(p_xy, p_cd, area, c.p_set) - area).abs() < 1e-12 * c.a_max);
        }

        #[test]
        fn its_opening_stays_between_its_ends_and_falls_with_either_drop(
            p_xy in -1e7..1e7f64, p_cd in -1e7..1e7f64, area in 1e-9..1e-4f64, more in 0.0..1e6f64,
        ) {
            let c = thesis();
            let at = |p_xy: f64, p_cd: f64| c.steady_area(p_xy, p_cd, area, c.p_set);
            prop_assert!((c.a_leak..=c.a_max).contains(&at(p_xy, p_cd)));
            prop_assert!(at(p_xy + more, p_cd) <= at(p_xy, p_cd));
            prop_assert!(at(p_xy, p_cd + more) <= at(p_xy, p_cd));
        }
    }
}
