//! Integrators: one adaptive and implicit, one with fixed substeps.

mod drop;
pub mod fixed;
pub mod linear;
mod multistep;
pub mod radau;
pub mod statistics;
pub mod vectors;
