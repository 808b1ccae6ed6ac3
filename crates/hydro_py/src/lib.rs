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

/// Looks NumPy's functions up while the module is imported: at their first use Python code would run, and panic where a
/// Ctrl-C falls into it.
fn find_numpy(py: Python) -> PyResult<()> {
    numpy::get_array_module(py)?;
    numpy::npyffi::is_numpy_2(py);
    Ok(())
}

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    find_numpy(m.py())?;
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
