//! The curve of any shape with many narrow splines, for what repeats along a stroke.

use super::free_shape::{Curve, FINE};

/// The same law as [`super::free_shape::FreeShape`], on 37 intervals.
pub type FineShape<S> = Curve<S, FINE>;
