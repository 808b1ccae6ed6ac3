//! Ensembles: many lowerings, each with its own truck, conditions and noise, in SIMD lanes on all cores.
//!
//! A member is a pure function of a seed and its index. Its bits depend neither on its lane-mates, nor on how the
//! members are cut into chunks, nor on the number of threads. What is asked of a member is worked out while it runs,
//! so that no trajectory is kept. A member that fails has a status and disturbs no other.

pub mod controllers;
pub mod distribution;
pub mod draw;
pub mod linear;
pub mod lowerings;
pub mod measures;
pub mod member;
pub mod open_loop;
pub mod requirement;
pub mod trial;
pub mod verdict;
pub mod window;
