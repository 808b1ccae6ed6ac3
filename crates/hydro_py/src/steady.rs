//! Steady lowering at many points, with derivatives.

use hydro_core::error::Error;
use hydro_core::mast::LiftName;
use hydro_core::steady::{settle, Along, Known, Point, Settled};
use hydro_core::truck::Truck;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::case::once;
use crate::errors::raise;
use crate::truck::argument;

/// Velocities (n,) and their derivatives (n, directions).
pub type Velocities<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);
/// Velocities and pressures (n, 2) and their derivatives (n, 2, directions).
pub type States<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>);

/// The points, a column for each of their quantities; `known` is the pressure or the load.
pub struct Columns {
    pub current: Vec<f64>,
    pub bend: Vec<f64>,
    pub known: Vec<f64>,
    pub rate: Option<Vec<f64>>,
    pub oil_temperature: Vec<f64>,
}

impl Columns {
    fn points(&self, known: (&str, impl Fn(f64, f64) -> Known)) -> Result<Vec<Point>, Error> {
        let n = self.current.len();
        let columns = [("bend", &self.bend), (known.0, &self.known), ("oil_temperature", &self.oil_temperature)];
        let rate = self.rate.as_ref().map(|rate| ("pressure_rate", rate));
        for (name, column) in columns.into_iter().chain(rate) {
            if column.len() != n {
                let (got, expected) = (column.len().to_string(), format!("{n}, one per current"));
                return Err(Error::Shape { name: name.into(), got, expected });
            }
        }
        Ok((0..n)
            .map(|k| Point {
                current: self.current[k],
                bend: self.bend[k],
                known: known.1(self.known[k], self.rate.as_ref().map_or(0.0, |rate| rate[k])),
                oil_temperature_degc: self.oil_temperature[k],
            })
            .collect())
    }
}

fn lift_of(name: &str) -> Result<LiftName, Error> {
    LiftName::BOTH.into_iter().find(|lift| lift.as_str() == name).ok_or_else(|| argument("lift", name, "free or main"))
}

/// `current`, `oil_temperature`, `known` or a parameter's name.
fn along(name: &str, known: &str, names: &[String]) -> Result<Along, Error> {
    match name {
        "current" => Ok(Along::Current),
        "oil_temperature" => Ok(Along::OilTemperature),
        _ if name == known => Ok(Along::Known),
        _ => names.iter().position(|known| known == name).map(Along::Parameter).ok_or_else(|| {
            argument("directions", name, &format!("parameters of the truck, current, {known} or oil_temperature"))
        }),
    }
}

fn settled(
    py: Python<'_>,
    truck: &Truck,
    lift: &str,
    columns: &Columns,
    directions: &[String],
    known: (&str, impl Fn(f64, f64) -> Known + Send + Sync),
) -> PyResult<Vec<Settled>> {
    let names = truck.names();
    let prepare = || {
        let found = directions.iter().map(|name| along(name, known.0, &names)).collect::<Result<Vec<_>, _>>()?;
        let directions = once(directions, found)?;
        Ok((lift_of(lift)?, directions, columns.points(known)?))
    };
    let (lift, directions, points) = prepare().map_err(|e| raise(py, &e))?;
    py.detach(|| settle(truck, lift, &points, &directions)).map_err(|e| raise(py, &e))
}

/// Under measured pressures.
pub fn velocity<'py>(
    py: Python<'py>,
    truck: &Truck,
    lift: &str,
    columns: &Columns,
    directions: &[String],
) -> PyResult<Velocities<'py>> {
    let known = |pressure, rate| Known::Pressure { pressure, rate };
    let found = settled(py, truck, lift, columns, directions, ("pressure", known))?;
    let values: Vec<f64> = found.iter().map(|s| s.values[0]).collect();
    let derivatives: Vec<f64> = found.iter().flat_map(|s| s.derivatives[0].iter().copied()).collect();
    Ok((values.into_pyarray(py), derivatives.into_pyarray(py).reshape([found.len(), directions.len()])?))
}

/// Under loads.
pub fn state<'py>(
    py: Python<'py>,
    truck: &Truck,
    lift: &str,
    columns: &Columns,
    directions: &[String],
) -> PyResult<States<'py>> {
    let found = settled(py, truck, lift, columns, directions, ("load", |load, _| Known::Load(load)))?;
    let values: Vec<f64> = found.iter().flat_map(|s| s.values).collect();
    let derivatives: Vec<f64> = found.iter().flat_map(|s| s.derivatives.iter().flatten().copied()).collect();
    let n = found.len();
    Ok((values.into_pyarray(py).reshape([n, 2])?, derivatives.into_pyarray(py).reshape([n, 2, directions.len()])?))
}
