//! A look-up table over evenly spaced knots, straight between them and held at its ends.

use super::fixed::{clamped, rounded};

/// Most knots of a table.
pub const MOST_KNOTS: usize = 33;

/// y over x: at first + k·2^spacing it is knot k times 2^widen.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Table {
    /// x of the first knot.
    pub first: i32,
    /// The base-2 logarithm of the knots' distance.
    pub spacing: u32,
    /// The base-2 logarithm of a knot's unit: a word of few bits holds large values coarsely.
    pub widen: u32,
    /// 2 to [`MOST_KNOTS`] values.
    pub knots: Vec<i32>,
}

impl Table {
    /// The same everywhere: knot·2^widen.
    pub fn constant(knot: i32, widen: u32) -> Table {
        Table { first: 0, spacing: 0, widen, knots: vec![knot; 2] }
    }

    /// Whether it is zero everywhere.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        self.knots.iter().all(|&y| y == 0)
    }

    /// What it is at a knot.
    #[inline(always)]
    pub fn knot(&self, k: usize) -> i64 {
        i64::from(self.knots[k]) << self.widen
    }

    /// x of the last knot.
    pub fn end(&self) -> i64 {
        i64::from(self.first) + ((self.knots.len() as i64 - 1) << self.spacing)
    }

    /// y at x, rounded.
    #[inline(always)]
    pub fn at(&self, x: i64) -> i64 {
        let segments = self.knots.len() as i64 - 1;
        let from = clamped(x - i64::from(self.first), 0, segments << self.spacing);
        let segment = clamped(from >> self.spacing, 0, segments - 1);
        let (low, high) = (self.knot(segment as usize), self.knot(segment as usize + 1));
        let into = from - (segment << self.spacing);
        low + rounded((high - low) * into, self.spacing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn table() -> impl Strategy<Value = Table> {
        (-1000..1000, 0u32..12, 0u32..14, proptest::collection::vec(-30_000..30_000, 2..=MOST_KNOTS))
            .prop_map(|(first, spacing, widen, knots)| Table { first, spacing, widen, knots })
    }

    proptest! {
        #[test]
        fn a_table_answers_every_integer_within_its_knots_and_holds_its_ends(table in table(), x in any::<i32>()) {
            let y = table.at(i64::from(x));
            let knots = || (0..table.knots.len()).map(|k| table.knot(k));
            prop_assert!(y >= knots().min().unwrap() && y <= knots().max().unwrap());
            prop_assert_eq!(table.at(i64::from(i32::MIN)), table.knot(0));
            prop_assert_eq!(table.at(i64::from(i32::MAX)), table.knot(table.knots.len() - 1));
        }

        #[test]
        fn a_table_is_straight_between_its_knots(table in table(), share in 0.0..1.0f64) {
            let last = table.knots.len() - 1;
            let place = share * last as f64;
            let x = f64::from(table.first) + place * f64::from(1u32 << table.spacing);
            let k = (place as usize).min(last - 1);
            let exact = |x: f64| {
                let into = (x - f64::from(table.first)) / f64::from(1u32 << table.spacing) - k as f64;
                table.knot(k) as f64 + (table.knot(k + 1) - table.knot(k)) as f64 * into
            };
            let x = x.floor();
            if x >= f64::from(table.first) + k as f64 * f64::from(1u32 << table.spacing) {
                prop_assert!((table.at(x as i64) as f64 - exact(x)).abs() <= 0.5 + 1e-6);
            }
        }
    }
}
