//! Recordings to be simulated together, with derivatives.

use hydro_core::error::Error;
use hydro_core::mast::LiftName;
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::sensitivity::{differentiate_all, Case, Direction};
use hydro_core::run::Inputs;
use hydro_core::truck::Truck;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::raise;
use crate::truck::command_rows;

/// The inputs of one recording and the times at which its outputs are wanted.
#[pyclass(name = "Case", module = "forklift._core", frozen)]
pub struct PyCase {
    time: Vec<f64>,
    command_time: Vec<f64>,
    command: Vec<[f64; 2]>,
    oil_temperature: Vec<f64>,
}

#[pymethods]
impl PyCase {
    #[new]
    fn new<'py>(
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        command_time: PyReadonlyArray1<'py, f64>,
        command: PyReadonlyArray2<'py, f64>,
        oil_temperature: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Self> {
        Ok(PyCase {
            time: time.as_array().to_vec(),
            command_time: command_time.as_array().to_vec(),
            command: command_rows(&command).map_err(|e| raise(py, &e))?,
            oil_temperature: oil_temperature.as_array().to_vec(),
        })
    }
}

/// `load`, `oil_temperature`, `free.start`, `main.start`, or a parameter's name.
fn direction(name: &str, names: &[String]) -> Result<Direction, Error> {
    match name {
        "load" => Ok(Direction::Load),
        "oil_temperature" => Ok(Direction::OilTemperature),
        "free.start" => Ok(Direction::Start(LiftName::Free)),
        "main.start" => Ok(Direction::Start(LiftName::Main)),
        _ => names.iter().position(|known| known == name).map(Direction::Parameter).ok_or_else(|| Error::Argument {
            name: "directions".into(),
            value: name.into(),
            requirement: "parameters of the truck, load, oil_temperature, free.start or main.start".into(),
        }),
    }
}

type Derived<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>);

/// Outputs and exact derivatives of each case, on all cores.
pub fn differentiate<'py>(
    py: Python<'py>,
    truck: &Truck,
    cases: &[PyRef<'py, PyCase>],
    unknowns: &PyReadonlyArray2<'py, f64>,
    directions: &[String],
    substeps: usize,
) -> PyResult<Vec<Derived<'py>>> {
    let unknowns = unknowns.as_array();
    if unknowns.shape() != [cases.len(), 4] {
        let got = format!("{:?}", unknowns.shape());
        let expected = format!("({}, 4): load, oil temperature's offset, start of free and main", cases.len());
        return Err(raise(py, &Error::Shape { name: "unknowns".into(), got, expected }));
    }
    let names = truck.names();
    let along = directions.iter().map(|name| direction(name, &names)).collect::<Result<Vec<_>, _>>();
    let along = along.map_err(|e| raise(py, &e))?;
    let runs: Vec<Case> = cases
        .iter()
        .zip(unknowns.rows())
        .map(|(case, unknown)| Case {
            inputs: Inputs {
                time: &case.command_time,
                command: &case.command,
                oil_temperature_degc: &case.oil_temperature,
                load_kg: unknown[0],
            },
            wanted: &case.time,
            warmer: unknown[1],
            start: [unknown[2], unknown[3]],
        })
        .collect();
    let interrupt = || Python::attach(|py| py.check_signals().is_err());
    let result = py.detach(|| differentiate_all(truck, &runs, substeps, &along, &interrupt));
    let results = result.map_err(|(_, e)| raise(py, &e))?;
    results
        .into_iter()
        .zip(cases)
        .map(|(found, case)| {
            let (n, m) = (case.time.len(), OUTPUTS.len());
            let outputs = found.outputs.into_pyarray(py).reshape([n, m])?;
            let derivatives = found.derivatives.into_pyarray(py).reshape([n, m, along.len()])?;
            Ok((outputs, derivatives))
        })
        .collect()
}
