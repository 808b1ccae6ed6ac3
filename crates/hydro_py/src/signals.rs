//! Commands and sensors.

use hydro_core::{commands, sensors};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors::raise;

type Floats<'py> = Bound<'py, PyArray1<f64>>;
type Steps<'py> = Bound<'py, PyArray1<i64>>;

#[pyfunction]
#[pyo3(signature = (n_samples, seed, low=58, high=174, levels=8, switching_probability=0.05))]
fn prms(
    py: Python<'_>,
    n_samples: usize,
    seed: u64,
    low: i64,
    high: i64,
    levels: usize,
    switching_probability: f64,
) -> PyResult<Steps<'_>> {
    let steps = commands::prms(n_samples, seed, low, high, levels, switching_probability);
    Ok(steps.map_err(|e| raise(py, &e))?.into_pyarray(py))
}

#[pyfunction]
fn staircase(py: Python<'_>, levels: Vec<i64>, samples_per_level: usize) -> PyResult<Steps<'_>> {
    let steps = commands::staircase(&levels, samples_per_level);
    Ok(steps.map_err(|e| raise(py, &e))?.into_pyarray(py))
}

#[pyfunction]
fn steps_to_current(py: Python<'_>, steps: Vec<i64>) -> PyResult<Floats<'_>> {
    let current = commands::steps_to_current(&steps);
    Ok(current.map_err(|e| raise(py, &e))?.into_pyarray(py))
}

#[pyfunction]
fn quantise_current<'py>(py: Python<'py>, current: PyReadonlyArray1<'py, f64>) -> PyResult<Floats<'py>> {
    Ok(commands::quantise_current(&current.as_array().to_vec()).into_pyarray(py))
}

#[pyfunction]
fn low_pass<'py>(
    py: Python<'py>,
    current: PyReadonlyArray1<'py, f64>,
    sample_rate_hz: f64,
    cutoff_hz: f64,
) -> PyResult<Floats<'py>> {
    let filtered = commands::low_pass(&current.as_array().to_vec(), sample_rate_hz, cutoff_hz);
    Ok(filtered.map_err(|e| raise(py, &e))?.into_pyarray(py))
}

#[pyfunction]
fn dither<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    current: PyReadonlyArray1<'py, f64>,
    amplitude: f64,
    frequency_hz: f64,
) -> PyResult<(Floats<'py>, Floats<'py>)> {
    let (time, current) = (time.as_array().to_vec(), current.as_array().to_vec());
    let (t, u) = commands::dither(&time, &current, amplitude, frequency_hz).map_err(|e| raise(py, &e))?;
    Ok((t.into_pyarray(py), u.into_pyarray(py)))
}

#[pyfunction]
fn encoder<'py>(py: Python<'py>, position: PyReadonlyArray1<'py, f64>) -> Floats<'py> {
    sensors::encoder(&position.as_array().to_vec()).into_pyarray(py)
}

macro_rules! sensor {
    ($name:ident, $noise:expr, $step:expr) => {
        #[pyfunction]
        #[pyo3(signature = (signal, seed, stream, noise=$noise, step=$step))]
        fn $name<'py>(
            py: Python<'py>,
            signal: PyReadonlyArray1<'py, f64>,
            seed: u64,
            stream: u64,
            noise: f64,
            step: f64,
        ) -> Floats<'py> {
            sensors::noisy(&signal.as_array().to_vec(), noise, step, seed, stream).into_pyarray(py)
        }
    };
}
sensor!(pressure_sensor, sensors::PRESSURE_NOISE, sensors::PRESSURE_STEP);
sensor!(temperature_sensor, sensors::TEMPERATURE_NOISE, sensors::TEMPERATURE_STEP);
sensor!(height_sensor, sensors::HEIGHT_NOISE, 0.0);

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("ENCODER_COUNT_M", sensors::ENCODER_COUNT)?;
    m.add_function(wrap_pyfunction!(prms, m)?)?;
    m.add_function(wrap_pyfunction!(staircase, m)?)?;
    m.add_function(wrap_pyfunction!(steps_to_current, m)?)?;
    m.add_function(wrap_pyfunction!(quantise_current, m)?)?;
    m.add_function(wrap_pyfunction!(low_pass, m)?)?;
    m.add_function(wrap_pyfunction!(dither, m)?)?;
    m.add_function(wrap_pyfunction!(encoder, m)?)?;
    m.add_function(wrap_pyfunction!(pressure_sensor, m)?)?;
    m.add_function(wrap_pyfunction!(temperature_sensor, m)?)?;
    m.add_function(wrap_pyfunction!(height_sensor, m)?)
}
