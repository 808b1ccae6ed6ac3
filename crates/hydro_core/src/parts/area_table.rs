//! Opening of the proportional valve against its current: the look-up table of (3.14), Figure 5.5.

use crate::scalar::Scalar;

/// Most knots a table may have; the table is an array, so that it needs no heap in lanes.
pub const MOST_KNOTS: usize = 24;

/// Piecewise-linear A(i), held at its end values outside the knots, never below a least opening.
///
/// Written as a sum of clamped ramps, A(i) = A₁ + Σ sₖ·clamp(i − iₖ, 0, iₖ₊₁ − iₖ): no search, so
/// that lanes need not agree on the segment.
#[derive(Debug, Clone, Copy)]
pub struct AreaTable<S> {
    segments: usize,
    first: S,
    least: S,
    start: [S; MOST_KNOTS],
    width: [S; MOST_KNOTS],
    slope: [S; MOST_KNOTS],
}

impl<S: Scalar> AreaTable<S> {
    /// `current` [A] rising, `area` [m²], both of the same length from 2 to [`MOST_KNOTS`];
    /// `least` is the floor of Figure A.3.
    pub fn new(current: &[S], area: &[S], least: S) -> Self {
        let zero = S::zero();
        let mut table = AreaTable {
            segments: 0,
            first: area[0],
            least,
            start: [zero; MOST_KNOTS],
            width: [zero; MOST_KNOTS],
            slope: [zero; MOST_KNOTS],
        };
        for (i, a) in current.windows(2).zip(area.windows(2)) {
            let k = table.segments;
            table.start[k] = i[0];
            table.width[k] = i[1] - i[0];
            table.slope[k] = (a[1] - a[0]) / table.width[k];
            table.segments += 1;
        }
        table
    }

    /// A [m²] at the current `i` [A].
    #[inline(always)]
    pub fn at(&self, i: S) -> S {
        let mut area = self.first;
        for k in 0..self.segments {
            area = area + self.slope[k] * (i - self.start[k]).clamp_to(S::zero(), self.width[k]);
        }
        area.max(self.least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    prop_compose! {
        /// Currents at least 1 mA apart, areas that do not fall.
        fn tables()(n in 2..=MOST_KNOTS)(
            gaps in proptest::collection::vec(1e-3..0.2f64, n),
            rises in proptest::collection::vec(prop_oneof![1 => Just(0.0), 3 => 0.0..1e-5f64], n),
        ) -> (Vec<f64>, Vec<f64>) {
            let sum = |steps: &[f64]| steps.iter().scan(0.0, |total, step| { *total += step; Some(*total) }).collect();
            (sum(&gaps), sum(&rises))
        }
    }

    proptest! {
        #[test]
        fn a_table_meets_its_knots_and_is_straight_between((current, area) in tables(), share in 0.0..1.0f64) {
            let table = AreaTable::new(&current, &area, 1e-15);
            // One rounding a ramp.
            let close = f64::EPSILON * current.len() as f64 * area.last().unwrap() + 1e-15;
            for k in 0..current.len() {
                prop_assert!((table.at(current[k]) - area[k]).abs() <= close);
            }
            for k in 1..current.len() {
                let i = current[k - 1] + share * (current[k] - current[k - 1]);
                let between = area[k - 1] + share * (area[k] - area[k - 1]);
                prop_assert!((table.at(i) - between).abs() <= 4.0 * close + 1e-12 * between);
            }
        }

        #[test]
        fn more_current_never_closes_the_valve((current, area) in tables(), a in -1.0..5.0f64, b in -1.0..5.0f64) {
            let table = AreaTable::new(&current, &area, 1e-9);
            prop_assert!(table.at(a.min(b)) <= table.at(a.max(b)));
        }

        #[test]
        fn outside_its_knots_a_table_keeps_its_ends_and_below_its_floor_the_floor((current, area) in tables(), far in 0.0..10.0f64) {
            let table = AreaTable::new(&current, &area, 1e-6);
            let (first, last) = (current[0], *current.last().unwrap());
            prop_assert_eq!(table.at(first - far), area[0].max(1e-6));
            prop_assert_eq!(table.at(last + far), table.at(last));
            prop_assert!(table.at(first) >= 1e-6);
        }
    }
}
