//! The truck: checked parameters, and its simulation.

use std::collections::BTreeMap;

use hydro_core::error::Error;
use hydro_core::mast::LiftName;
use hydro_core::outputs::{Readings, OUTPUTS};
use hydro_core::run::{simulate, Inputs, Lifts, Solver};
use hydro_core::truck::{Truck, Value};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::case::{self, PyCase, PyResponses};
use crate::errors::raise;
use crate::steady;
use crate::watch::Signal;

/// A truck's parameters, checked against the tables; its effects are those whose parameters are given.
#[pyclass(name = "Truck", module = "forklift._core", frozen)]
pub struct PyTruck(pub Truck);

#[derive(FromPyObject)]
enum Given {
    Number(f64),
    Table(Vec<f64>),
}

pub fn argument(name: &str, value: &str, requirement: &str) -> Error {
    Error::argument(name, value, requirement)
}

pub fn lifts_of(name: &str) -> Result<(Lifts, Vec<LiftName>), Error> {
    match name {
        "both" => Ok((Lifts::Both, LiftName::BOTH.to_vec())),
        "free" => Ok((Lifts::One(LiftName::Free), vec![LiftName::Free])),
        "main" => Ok((Lifts::One(LiftName::Main), vec![LiftName::Main])),
        other => Err(argument("lifts", other, "both, free or main")),
    }
}

fn solver_of(name: &str, tolerance: f64, substeps: usize) -> Result<Solver, Error> {
    match name {
        "adaptive" => Ok(Solver::Adaptive { tolerance }),
        "fixed" => Ok(Solver::Fixed { substeps }),
        other => Err(argument("solver", other, "adaptive or fixed")),
    }
}

/// Rows of an (m, 2) array: free and main.
pub fn command_rows(command: &PyReadonlyArray2<'_, f64>) -> Result<Vec<[f64; 2]>, Error> {
    let rows = command.as_array();
    if rows.shape()[1] != 2 {
        let got = format!("{:?}", rows.shape());
        return Err(Error::Shape { name: "command".into(), got, expected: "(m, 2), free and main".into() });
    }
    Ok(rows.rows().into_iter().map(|row| [row[0], row[1]]).collect())
}

impl PyTruck {
    pub fn core(&self) -> &Truck {
        &self.0
    }
}

#[pymethods]
impl PyTruck {
    #[new]
    fn new(py: Python<'_>, values: BTreeMap<String, Given>) -> PyResult<Self> {
        let values = values
            .into_iter()
            .map(|(name, given)| match given {
                Given::Number(number) => (name, Value::Number(number)),
                Given::Table(table) => (name, Value::Table(table)),
            })
            .collect();
        Truck::from_values(values).map(PyTruck).map_err(|e| raise(py, &e))
    }

    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.names()
    }

    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.values().into_pyarray(py)
    }

    #[getter]
    fn effects(&self) -> Vec<String> {
        self.0.effects().map(|effect| effect.name()).collect()
    }

    #[pyo3(signature = (time, command_time, command, oil_temperature, load, *, lifts="both", solver="adaptive",
                        tolerance=Solver::DEFAULT_TOLERANCE, substeps=Solver::DEFAULT_SUBSTEPS, start=None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments in Python
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        command_time: PyReadonlyArray1<'py, f64>,
        command: PyReadonlyArray2<'py, f64>,
        oil_temperature: PyReadonlyArray1<'py, f64>,
        load: f64,
        lifts: &str,
        solver: &str,
        tolerance: f64,
        substeps: usize,
        start: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let fail = |error: Error| raise(py, &error);
        let (lifts, which) = lifts_of(lifts).map_err(fail)?;
        let solver = solver_of(solver, tolerance, substeps).map_err(fail)?;
        let (time, command_time) = (time.as_array().to_vec(), command_time.as_array().to_vec());
        let command = command_rows(&command).map_err(fail)?;
        let temperature = oil_temperature.as_array().to_vec();
        let start = start.map(|start| start.as_array().to_vec());
        let signal = Signal::default();
        let result = py.detach(|| {
            let inputs =
                Inputs { time: &command_time, command: &command, oil_temperature_degc: &temperature, load_kg: load };
            let asked = std::cell::Cell::new(0u32);
            // Signals are looked at now and then: taking the interpreter's lock costs more than a step.
            let now_and_then = || {
                asked.set(asked.get().wrapping_add(1));
                asked.get().is_multiple_of(512) && signal.raised()
            };
            simulate(&self.0, lifts, &inputs, &time, solver, start.as_deref(), &now_and_then)
        });
        let run = signal.or(py, result)?;
        let n = run.state_names.len();
        let readings = Readings::new(&which, self.0.effects());
        let rows: Vec<f64> = run.states.chunks_exact(n).flat_map(|x| readings.read(x)).collect();
        let statistics = PyDict::new(py);
        for (name, count) in run.statistics.rows() {
            statistics.set_item(name, count)?;
        }
        let answer = PyDict::new(py);
        answer.set_item("outputs", rows.into_pyarray(py).reshape([time.len(), OUTPUTS.len()])?)?;
        answer.set_item("states", run.states.into_pyarray(py).reshape([time.len(), n])?)?;
        answer.set_item("state_names", run.state_names)?;
        answer.set_item("statistics", statistics)?;
        Ok(answer)
    }

    #[pyo3(signature = (lift, current, bend, pressure, oil_temperature, *, pressure_rate=None, directions=None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments in Python
    fn steady_velocity<'py>(
        &self,
        py: Python<'py>,
        lift: &str,
        current: PyReadonlyArray1<'py, f64>,
        bend: PyReadonlyArray1<'py, f64>,
        pressure: PyReadonlyArray1<'py, f64>,
        oil_temperature: PyReadonlyArray1<'py, f64>,
        pressure_rate: Option<PyReadonlyArray1<'py, f64>>,
        directions: Option<Vec<String>>,
    ) -> PyResult<steady::Velocities<'py>> {
        let columns = steady::Columns {
            current: current.as_array().to_vec(),
            bend: bend.as_array().to_vec(),
            known: pressure.as_array().to_vec(),
            rate: pressure_rate.map(|rate| rate.as_array().to_vec()),
            oil_temperature: oil_temperature.as_array().to_vec(),
        };
        steady::velocity(py, &self.0, lift, &columns, &directions.unwrap_or_default())
    }

    #[pyo3(signature = (lift, current, bend, load, oil_temperature, *, directions=None))]
    #[allow(clippy::too_many_arguments)] // keyword arguments in Python
    fn steady_state<'py>(
        &self,
        py: Python<'py>,
        lift: &str,
        current: PyReadonlyArray1<'py, f64>,
        bend: PyReadonlyArray1<'py, f64>,
        load: PyReadonlyArray1<'py, f64>,
        oil_temperature: PyReadonlyArray1<'py, f64>,
        directions: Option<Vec<String>>,
    ) -> PyResult<steady::States<'py>> {
        let columns = steady::Columns {
            current: current.as_array().to_vec(),
            bend: bend.as_array().to_vec(),
            known: load.as_array().to_vec(),
            rate: None,
            oil_temperature: oil_temperature.as_array().to_vec(),
        };
        steady::state(py, &self.0, lift, &columns, &directions.unwrap_or_default())
    }

    #[pyo3(signature = (cases, unknowns, directions, *, substeps=Solver::DEFAULT_SUBSTEPS))]
    #[allow(clippy::type_complexity)] // one pair of arrays per case
    fn differentiate<'py>(
        &self,
        py: Python<'py>,
        cases: Vec<PyRef<'py, PyCase>>,
        unknowns: PyReadonlyArray2<'py, f64>,
        directions: Vec<String>,
        substeps: usize,
    ) -> PyResult<Vec<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray3<f64>>)>> {
        case::differentiate(py, &self.0, &cases, &unknowns, &directions, substeps)
    }

    #[pyo3(signature = (case, unknowns, ports, centres, width, *, substeps=Solver::DEFAULT_SUBSTEPS))]
    #[allow(clippy::too_many_arguments)] // keyword arguments in Python
    fn hat_responses(
        &self,
        py: Python<'_>,
        case: PyRef<'_, PyCase>,
        unknowns: PyReadonlyArray1<'_, f64>,
        ports: Vec<String>,
        centres: PyReadonlyArray1<'_, f64>,
        width: f64,
        substeps: usize,
    ) -> PyResult<PyResponses> {
        case::hat_responses(py, &self.0, &case, &unknowns, &ports, &centres, width, substeps)
    }

    #[pyo3(signature = (case, unknowns, ports, centres, width, *, substeps=Solver::DEFAULT_SUBSTEPS))]
    #[allow(clippy::too_many_arguments)] // keyword arguments in Python
    fn responses<'py>(
        &self,
        py: Python<'py>,
        case: PyRef<'py, PyCase>,
        unknowns: PyReadonlyArray1<'py, f64>,
        ports: Vec<String>,
        centres: PyReadonlyArray1<'py, f64>,
        width: f64,
        substeps: usize,
    ) -> PyResult<Bound<'py, PyArray4<f64>>> {
        case::responses(py, &self.0, &case, &unknowns, &ports, &centres, width, substeps)
    }

    #[pyo3(signature = (case, unknowns, others, *, substeps=Solver::DEFAULT_SUBSTEPS))]
    fn added<'py>(
        &self,
        py: Python<'py>,
        case: PyRef<'py, PyCase>,
        unknowns: PyReadonlyArray1<'py, f64>,
        others: Vec<PyRef<'py, PyTruck>>,
        substeps: usize,
    ) -> PyResult<case::Shares<'py>> {
        let draws: Vec<Truck> = [&self.0].into_iter().chain(others.iter().map(|one| &one.0)).cloned().collect();
        case::added(py, &draws, &case, &unknowns, substeps)
    }
}
