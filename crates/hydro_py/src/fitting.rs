//! Residuals of recordings and their derivatives.

use fit_core::likelihood::{Interval, Rule, HUBER};
use fit_core::linearised::{linearised, residuals, Chain, Channel, Said, Slopes};
use hydro_core::error::Error;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

use crate::errors::raise;

type Floats<'py> = Bound<'py, PyArray1<f64>>;
type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// One channel as Python gives it.
#[derive(FromPyObject)]
struct Seen<'py> {
    column: usize,
    rows: Option<PyReadonlyArray1<'py, i64>>,
    read: PyReadonlyArray1<'py, f64>,
    count: f64,
    ends: [f64; 2],
    sigma: f64,
}

/// Residual, model, Jacobian, and the model's slopes; of those no rows if they were not asked for.
type Found<'py> = (Floats<'py>, Floats<'py>, Rows<'py>, Rows<'py>);

fn shape(name: &str, got: String, expected: &str) -> Error {
    Error::Shape { name: name.into(), got, expected: expected.into() }
}

fn scattered(name: &str) -> Error {
    shape(name, "gaps between its numbers".into(), "numbers that follow each other in memory")
}

fn flat<'a>(name: &str, array: Option<&'a [f64]>) -> Result<&'a [f64], Error> {
    array.ok_or_else(|| scattered(name))
}

fn said<'a>(values: &'a PyReadonlyArray2<'_, f64>, channels: &'a [Seen<'_>]) -> Result<Said<'a>, Error> {
    let &[times, outputs] = values.as_array().shape() else { unreachable!("two dimensions") };
    let channels = channels
        .iter()
        .map(|seen| {
            let read = flat("read", seen.read.as_slice().ok())?;
            let rows = seen.rows.as_ref().map(|rows| rows.as_slice()).transpose();
            let rows = rows.map_err(|_| scattered("rows"))?;
            let known = rows.map_or(read.len() <= times, |rows| {
                rows.len() == read.len() && rows.iter().all(|&row| (0..times as i64).contains(&row))
            });
            if !known || seen.column >= outputs {
                let got = format!("column {} and {} samples", seen.column, read.len());
                return Err(shape("channels", got, &format!("within the model's {times} times and {outputs} outputs")));
            }
            Ok(Channel { column: seen.column, rows, read, rule: Rule::of(seen.sigma, seen.count, seen.ends) })
        })
        .collect::<Result<_, _>>()?;
    Ok(Said { values: flat("values", values.as_slice().ok())?, outputs, channels })
}

#[pyfunction]
#[pyo3(signature = (read, model, sigma, *, count=0.0, ends=[f64::NEG_INFINITY, f64::INFINITY]))]
fn misfit<'py>(
    py: Python<'py>,
    read: PyReadonlyArray1<'py, f64>,
    model: PyReadonlyArray1<'py, f64>,
    sigma: f64,
    count: f64,
    ends: [f64; 2],
) -> (Floats<'py>, Floats<'py>) {
    let rule = Rule::of(sigma, count, ends);
    let (read, model) = (read.as_array(), model.as_array());
    let (rho, slope): (Vec<_>, Vec<_>) = read.iter().zip(model).map(|(&read, &model)| rule.misfit(read, model)).unzip();
    (rho.into_pyarray(py), slope.into_pyarray(py))
}

#[pyfunction]
fn interval_cost(read: PyReadonlyArray1<'_, f64>, model: PyReadonlyArray1<'_, f64>, count: f64, softness: f64) -> f64 {
    Interval::new(count, softness).cost(read.as_array().iter().zip(model.as_array()))
}

#[pyfunction]
#[pyo3(name = "residuals")]
fn all_residuals<'py>(
    py: Python<'py>,
    recordings: Vec<(PyReadonlyArray2<'py, f64>, Vec<Seen<'py>>)>,
) -> PyResult<Vec<Floats<'py>>> {
    let all: Vec<Said<'_>> = recordings
        .iter()
        .map(|(values, channels)| said(values, channels))
        .collect::<Result<_, _>>()
        .map_err(|e| raise(py, &e))?;
    let found = py.detach(|| residuals(&all));
    Ok(found.into_iter().map(|one| one.into_pyarray(py)).collect())
}

/// A recording with its slopes, which directions are its own, and how far one unit of each goes.
type Given<'py> = (PyReadonlyArray2<'py, f64>, PyReadonlyArray3<'py, f64>, Vec<Seen<'py>>, Vec<usize>, Vec<f64>);

#[pyfunction]
#[pyo3(name = "linearised", signature = (recordings, unknown_of, factors, unknowns, *, slopes_too=false))]
fn all_linearised<'py>(
    py: Python<'py>,
    recordings: Vec<Given<'py>>,
    unknown_of: Vec<usize>,
    factors: Vec<f64>,
    unknowns: usize,
    slopes_too: bool,
) -> PyResult<Vec<Found<'py>>> {
    if unknown_of.len() != factors.len() || unknown_of.iter().any(|&one| one >= unknowns) {
        let got = format!("{} unknowns and {} factors", unknown_of.len(), factors.len());
        return Err(raise(py, &shape("factors", got, &format!("one for each parameter, of {unknowns} unknowns"))));
    }
    let chain = Chain::new(unknown_of.into_iter().zip(factors).collect(), unknowns);
    let all: Vec<(Said<'_>, Slopes<'_>)> = recordings
        .iter()
        .map(|(values, slopes, channels, own, widths)| {
            let said = said(values, channels)?;
            let &[times, outputs, directions] = slopes.as_array().shape() else { unreachable!("three dimensions") };
            let fits = [times, outputs] == *values.as_array().shape() && directions >= chain.of.len();
            if !fits || own.len() != widths.len() || own.iter().any(|&one| one >= directions) {
                let got = format!("{times} by {outputs} by {directions}");
                return Err(shape("slopes", got, "as the values, with a direction for each parameter and condition"));
            }
            let own = own.iter().copied().zip(widths.iter().copied()).collect();
            Ok((said, Slopes { slopes: flat("slopes", slopes.as_slice().ok())?, directions, own }))
        })
        .collect::<Result<_, Error>>()
        .map_err(|e| raise(py, &e))?;
    let found = py.detach(|| linearised(&all, &chain, slopes_too));
    found
        .into_iter()
        .zip(&all)
        .map(|(one, (_, along))| {
            let (rows, wide) = (one.residual.len(), unknowns + along.own.len());
            let jacobian = one.jacobian.into_pyarray(py).reshape([rows, wide])?;
            let slope = one.slope.into_pyarray(py).reshape([if slopes_too { rows } else { 0 }, wide])?;
            Ok((one.residual.into_pyarray(py), one.model.into_pyarray(py), jacobian, slope))
        })
        .collect()
}

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("HUBER", HUBER)?;
    m.add_function(wrap_pyfunction!(misfit, m)?)?;
    m.add_function(wrap_pyfunction!(interval_cost, m)?)?;
    m.add_function(wrap_pyfunction!(all_residuals, m)?)?;
    m.add_function(wrap_pyfunction!(all_linearised, m)?)
}
