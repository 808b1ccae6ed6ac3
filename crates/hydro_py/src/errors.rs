//! The core's errors as `forklift.base.errors.ForkliftError`.

use hydro_core::error::{Error, Fact};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A core error as the exception a Python caller meets; an interrupted run is a KeyboardInterrupt, where no signal's
/// handler raised another.
pub fn raise(py: Python<'_>, error: &Error) -> PyErr {
    if let Error::Interrupted { .. } = error {
        return PyKeyboardInterrupt::new_err(error.to_string());
    }
    let sentence = error.to_string();
    let make = || -> PyResult<PyErr> {
        let facts = PyDict::new(py);
        for (name, fact) in error.facts() {
            match fact {
                Fact::Text(text) => facts.set_item(name, text)?,
                Fact::Number(number) => facts.set_item(name, number)?,
                Fact::Count(count) => facts.set_item(name, count)?,
            }
        }
        let class = py.import("forklift.base.errors")?.getattr("ForkliftError")?;
        Ok(PyErr::from_value(class.call((error.code(), sentence.as_str()), Some(&facts))?))
    };
    make().unwrap_or_else(|failure| failure)
}
