//! Recordings to be simulated together, with derivatives.

use hydro_core::error::Error;
use hydro_core::mast::LiftName;
use hydro_core::outputs::OUTPUTS;
use hydro_core::ports::PORTS;
use hydro_core::run::added;
use hydro_core::run::responses::{Hats, Responses};
use hydro_core::run::sensitivity::{self, differentiate_all, Case, Direction, Input};
use hydro_core::run::Inputs;
use hydro_core::truck::Truck;
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArray4, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::raise;
use crate::truck::command_rows;
use crate::watch::{watched, Signal};

/// How many unknowns a recording has of its own, and which.
const OWN: usize = 5;
const OWN_MEANING: &str = "load, oil temperature's offset, its warming, start of free and main";

/// The inputs of one recording and the times at which its outputs are wanted.
#[pyclass(name = "Case", module = "forklift._core", frozen)]
pub struct PyCase {
    time: Vec<f64>,
    command_time: Vec<f64>,
    command: Vec<[f64; 2]>,
    oil_temperature: Vec<f64>,
    command_slope: Vec<[f64; 2]>,
}

#[pymethods]
impl PyCase {
    #[new]
    #[pyo3(signature = (time, command_time, command, oil_temperature, command_slope=None))]
    fn new<'py>(
        py: Python<'py>,
        time: PyReadonlyArray1<'py, f64>,
        command_time: PyReadonlyArray1<'py, f64>,
        command: PyReadonlyArray2<'py, f64>,
        oil_temperature: PyReadonlyArray1<'py, f64>,
        command_slope: Option<PyReadonlyArray2<'py, f64>>,
    ) -> PyResult<Self> {
        let slope = command_slope.map(|slope| command_rows(&slope)).transpose();
        Ok(PyCase {
            time: time.as_array().to_vec(),
            command_time: command_time.as_array().to_vec(),
            command: command_rows(&command).map_err(|e| raise(py, &e))?,
            oil_temperature: oil_temperature.as_array().to_vec(),
            command_slope: slope.map_err(|e| raise(py, &e))?.unwrap_or_default(),
        })
    }
}

impl PyCase {
    /// The recording under its own unknowns.
    fn at(&self, unknown: &[f64]) -> Result<Case<'_>, Error> {
        let &[load_kg, warmer, warming, free, main] = unknown else {
            let expected = format!("{OWN}: {OWN_MEANING}");
            return Err(Error::Shape { name: "unknowns".into(), got: unknown.len().to_string(), expected });
        };
        let inputs = Inputs {
            time: &self.command_time,
            command: &self.command,
            oil_temperature_degc: &self.oil_temperature,
            load_kg,
        };
        let start = [free, main];
        Ok(Case { inputs, wanted: &self.time, warmer, warming, start, command_slope: &self.command_slope })
    }
}

/// `load`, `oil_temperature`, `oil_warming`, `free.start`, `main.start`, `command`, or a parameter's name.
fn direction(name: &str, names: &[String]) -> Result<Direction, Error> {
    match name {
        "load" => Ok(Direction::Load),
        "oil_temperature" => Ok(Direction::OilTemperature),
        "oil_warming" => Ok(Direction::OilWarming),
        "free.start" => Ok(Direction::Start(LiftName::Free)),
        "main.start" => Ok(Direction::Start(LiftName::Main)),
        "command" => Ok(Direction::Command),
        _ => names.iter().position(|known| known == name).map(Direction::Parameter).ok_or_else(|| Error::Argument {
            name: "directions".into(),
            value: name.into(),
            requirement:
                "parameters of the truck, load, oil_temperature, oil_warming, free.start, main.start or command".into(),
        }),
    }
}

/// Directions, each of which has been given once: a second would have derivatives of zero.
pub fn once<T>(names: &[String], directions: Vec<T>) -> Result<Vec<T>, Error> {
    match names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        None => Ok(directions),
        Some((_, name)) => {
            Err(Error::Argument { name: "directions".into(), value: name.clone(), requirement: "given once".into() })
        }
    }
}

/// `free.force`: a port of a lift, with its place among the ports.
fn port(name: &str) -> Option<(LiftName, usize)> {
    let (lift, port) = name.split_once('.')?;
    let lift = LiftName::BOTH.into_iter().find(|known| known.as_str() == lift)?;
    Some((lift, PORTS.iter().position(|known| known.name == port)?))
}

/// How one recording answers hats over time at ports.
#[pyclass(name = "Responses", module = "forklift._core", frozen)]
pub struct PyResponses {
    found: Responses,
    times: usize,
    hats: usize,
}

#[pymethods]
impl PyResponses {
    /// Along how many the runs were differentiated.
    #[getter]
    fn directions(&self) -> usize {
        self.found.directions()
    }

    /// Derivatives of the outputs along the hats at a port: (times, outputs, hats).
    fn at<'py>(&self, py: Python<'py>, port: &str) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (lift, place) = known(py, port)?;
        let found = py.detach(|| self.found.at(lift, place)).ok_or_else(|| no_port(py, port))?;
        found.into_pyarray(py).reshape([self.times, OUTPUTS.len(), self.hats])
    }
}

fn no_port(py: Python<'_>, name: &str) -> PyErr {
    let requirement = "a lift and one of its ports, such as free.force".into();
    raise(py, &Error::Argument { name: "ports".into(), value: name.into(), requirement })
}

fn known(py: Python<'_>, name: &str) -> PyResult<(LiftName, usize)> {
    port(name).ok_or_else(|| no_port(py, name))
}

fn wide(py: Python<'_>, width: f64) -> PyResult<f64> {
    if width > 0.0 && width.is_finite() {
        return Ok(width);
    }
    let requirement = "above 0 s and finite".into();
    Err(raise(py, &Error::Argument { name: "width".into(), value: width.to_string(), requirement }))
}

/// How one case answers hats over time, each of which begins and ends at the tops of its neighbours.
#[allow(clippy::too_many_arguments)] // keyword arguments in Python
pub fn hat_responses(
    py: Python<'_>,
    truck: &Truck,
    case: &PyCase,
    unknown: &PyReadonlyArray1<'_, f64>,
    ports: &[String],
    centres: &PyReadonlyArray1<'_, f64>,
    width: f64,
    substeps: usize,
) -> PyResult<PyResponses> {
    let hats = Hats { centres: centres.as_array().to_vec(), width: wide(py, width)? };
    let asked = ports.iter().map(|name| known(py, name)).collect::<PyResult<Vec<_>>>()?;
    let run = case.at(&unknown.as_array().to_vec()).map_err(|error| raise(py, &error))?;
    let signal = Signal::default();
    let found = py.detach(|| Responses::new(truck, &run, substeps, &asked, &hats, &|| signal.raised()));
    let found = signal.or(py, found)?;
    Ok(PyResponses { found, times: case.time.len(), hats: hats.centres.len() })
}

/// Derivatives of one case's outputs along hats over time at ports: (times, outputs, ports, centres).
#[allow(clippy::too_many_arguments)] // keyword arguments in Python
pub fn responses<'py>(
    py: Python<'py>,
    truck: &Truck,
    case: &PyCase,
    unknown: &PyReadonlyArray1<'py, f64>,
    ports: &[String],
    centres: &PyReadonlyArray1<'py, f64>,
    width: f64,
    substeps: usize,
) -> PyResult<Bound<'py, PyArray4<f64>>> {
    let width = wide(py, width)?;
    let mut along = Vec::new();
    let centres = centres.as_array();
    for name in ports {
        let (lift, port) = known(py, name)?;
        along.extend(centres.iter().map(|&centre| Direction::Input(Input { lift, port, centre, width })));
    }
    let run = case.at(&unknown.as_array().to_vec()).map_err(|error| raise(py, &error))?;
    let signal = Signal::default();
    let found = py.detach(|| sensitivity::differentiate(truck, &run, substeps, &along, &|| signal.raised()));
    let found = signal.or(py, found)?;
    found.derivatives.into_pyarray(py).reshape([case.time.len(), OUTPUTS.len(), ports.len(), centres.len()])
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
    if unknowns.shape() != [cases.len(), OWN] {
        let got = format!("{:?}", unknowns.shape());
        let expected = format!("({}, {OWN}): {OWN_MEANING}", cases.len());
        return Err(raise(py, &Error::Shape { name: "unknowns".into(), got, expected }));
    }
    let names = truck.names();
    let along = directions.iter().map(|name| direction(name, &names)).collect::<Result<Vec<_>, _>>();
    let along = along.and_then(|along| once(directions, along)).map_err(|e| raise(py, &e))?;
    let runs = cases.iter().zip(unknowns.rows()).map(|(case, unknown)| case.at(&unknown.to_vec()));
    let runs = runs.collect::<Result<Vec<Case>, Error>>().map_err(|e| raise(py, &e))?;
    let all = |interrupt: &(dyn Fn() -> bool + Sync)| {
        differentiate_all(truck, &runs, substeps, &along, interrupt).map_err(|(_, error)| error)
    };
    watched(py, all)?
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

/// An effect, a port, and what the effect adds there: (draws, times).
pub type Shares<'py> = Vec<(String, String, Bound<'py, PyArray2<f64>>)>;

/// What the effects of the first truck add along a recording, and what those of the others would add there.
pub fn added<'py>(
    py: Python<'py>,
    draws: &[Truck],
    case: &PyCase,
    unknowns: &PyReadonlyArray1<'py, f64>,
    substeps: usize,
) -> PyResult<Shares<'py>> {
    let run = case.at(&unknowns.as_array().to_vec()).map_err(|e| raise(py, &e))?;
    let found = watched(py, |interrupt| added::added(draws, &run, substeps, interrupt))?;
    let of = |one: added::Added| {
        let port = format!("{}.{}", one.lift.as_str(), PORTS[one.port].name);
        let rows = one.values.into_pyarray(py).reshape([draws.len(), case.time.len()])?;
        Ok((one.effect, port, rows))
    };
    found.into_iter().map(of).collect()
}
