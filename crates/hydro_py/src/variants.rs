//! Variants of a truck, run side by side.

use hydro_core::error::Error;
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::variants::{simulate_variants as simulate, Course, Variant};
use hydro_core::run::Solver;
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::raise;
use crate::truck::{command_rows, lifts_of, PyTruck};
use crate::watch::watched;

/// Outputs (variants, n, outputs) of variants of a truck under one command, with fixed substeps, on all cores.
#[pyfunction]
#[pyo3(signature = (truck, values, loads, oil_temperatures, time, command_time, command, *, lifts="both",
                    substeps=Solver::DEFAULT_SUBSTEPS))]
#[allow(clippy::too_many_arguments)] // keyword arguments in Python
fn simulate_variants<'py>(
    py: Python<'py>,
    truck: &PyTruck,
    values: PyReadonlyArray2<'py, f64>,
    loads: PyReadonlyArray1<'py, f64>,
    oil_temperatures: PyReadonlyArray1<'py, f64>,
    time: PyReadonlyArray1<'py, f64>,
    command_time: PyReadonlyArray1<'py, f64>,
    command: PyReadonlyArray2<'py, f64>,
    lifts: &str,
    substeps: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let fail = |error: Error| raise(py, &error);
    let (lifts, _) = lifts_of(lifts).map_err(fail)?;
    let (values, loads, oil) = (values.as_array(), loads.as_array(), oil_temperatures.as_array());
    let count = values.shape()[0];
    for (name, got) in [("loads", loads.len()), ("oil_temperatures", oil.len())] {
        if got != count {
            let expected = format!("{count}, one per variant");
            return Err(fail(Error::Shape { name: name.into(), got: got.to_string(), expected }));
        }
    }
    let own = values.rows().into_iter().zip(loads).zip(oil);
    let variants: Vec<Variant> = own
        .map(|((row, &load_kg), &degc)| Variant { values: row.to_vec(), load_kg, oil_temperature_degc: degc })
        .collect();
    let (time, command_time) = (time.as_array().to_vec(), command_time.as_array().to_vec());
    let command = command_rows(&command).map_err(fail)?;
    let course = Course { truck: truck.core(), lifts, time: &command_time, command: &command, wanted: &time, substeps };
    let found = watched(py, |interrupt| simulate(course, &variants, interrupt))?;
    found.concat().into_pyarray(py).reshape([count, time.len(), OUTPUTS.len()])
}

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(simulate_variants, m)?)
}
