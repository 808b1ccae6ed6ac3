//! The hydraulic lowering function of a forklift: physics, integrators, test signals and sensors.
//!
//! After Fri & Fahlén, *Modelling and Control of a Forklift's Hydraulic Lowering Function*
//! (Linköping University, LiTH-ISY-EX--17/5050--SE, 2017). Equation numbers in brackets are the
//! thesis's. SI units; positions and velocities upward positive.

// Unit tests share the integration tests' truck, which names this crate as they do.
#[cfg(test)]
extern crate self as hydro_core;

pub mod commands;
pub mod control;
pub mod dual;
pub mod effects;
pub mod elementary;
pub mod ensemble;
pub mod error;
pub mod integer;
pub mod lanes;
pub mod mast;
pub mod outputs;
pub mod parameters;
pub mod parts;
pub mod ports;
pub mod random;
pub mod run;
pub mod scalar;
pub mod sensors;
pub mod slopes;
pub mod solver;
pub mod steady;
pub mod streams;
pub mod truck;
