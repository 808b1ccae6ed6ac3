//! `forklift._core`: conversions and errors, no arithmetic.

mod case;
mod control;
mod ensemble;
mod errors;
mod fitting;
mod signals;
mod steady;
mod tables;
mod truck;
mod variants;
mod watch;

use pyo3::prelude::*;

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_class::<truck::PyTruck>()?;
    m.add_class::<case::PyCase>()?;
    m.add_class::<case::PyResponses>()?;
    ensemble::register(m)?;
    tables::register(m)?;
    control::register(m)?;
    variants::register(m)?;
    fitting::register(m)?;
    signals::register(m)
}
