//! Integrators: one adaptive and implicit, one with fixed substeps.

pub mod fixed;
pub mod linear;
pub mod radau;
pub mod statistics;
pub mod vectors;
