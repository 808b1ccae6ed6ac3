//! What a search over recordings works out at every place, of any model: it knows no machine.
//!
//! [`likelihood`] turns a sample and what the model says of it into a residual; [`linearised`] does so for all
//! samples of many recordings, with the residuals' derivatives along the unknowns, on all cores.

pub mod likelihood;
pub mod linearised;
mod normal;
