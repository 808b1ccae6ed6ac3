//! The controller as the ECU runs it: integers only, and no scalar of the physics.
//!
//! Chapter 4 of Fri & Fahlén (2017), in fixed point (section 4.8.3). [`settings`] are in the units of the ECU (mm/s,
//! mA), [`config`] the integers they become; [`controller`] is one tick of both lifts, [`lift`] of one. What the
//! thesis leaves open and what goes beyond it is said where it stands.

pub mod c_export;
pub mod config;
pub mod controller;
pub mod fixed;
pub mod lift;
pub mod numbers;
pub mod ranges;
pub mod reference;
pub mod settings;
pub mod table;
pub mod twin;
pub mod vectors;
