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
