//! Ensembles: many lowerings, drawn, run and judged.

use std::collections::BTreeMap;

use hydro_core::control::settings::TICK_S;
use hydro_core::ensemble::controllers::{self, Fleet};
use hydro_core::ensemble::distribution::Distribution;
use hydro_core::ensemble::lowerings::Make;
use hydro_core::ensemble::measures::{Settling, MEASURES};
use hydro_core::ensemble::member::{Column, Makeup, CONDITIONS, DEFAULTS};
use hydro_core::ensemble::open_loop::OpenLoop;
use hydro_core::ensemble::requirement::{Requirement, Signal, Template, SIGNALS};
use hydro_core::ensemble::trial::{whole_ticks, Trial};
use hydro_core::ensemble::verdict::VERDICTS;
use hydro_core::ensemble::{draw, linear};
use hydro_core::error::Error;
use hydro_core::lanes::Precision;
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::closed_loop::Controller;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::ThreadPool;

use crate::control::{self, GivenLift};
use crate::errors::raise;
use crate::truck::{argument, lifts_of, PyTruck};
use crate::watch::watched;

/// Of a sweep: more than any one machine has, so that more are a mistake.
const MOST_THREADS: usize = 1024;

/// Lowerings of one truck, varied.
#[pyclass(name = "Ensemble", module = "forklift._core", frozen)]
pub struct PyEnsemble {
    trial: Trial,
    fleet: Option<Fleet>,
    names: Vec<String>,
    pool: ThreadPool,
}

/// Members whose uniform numbers are drawn at a time.
const MOST_AT_ONCE: usize = 1 << 30;

/// Shared numbers, both lifts, bits of the word.
type GivenController = (Vec<f64>, GivenLift, GivenLift, u32);
type Varied = (String, String, Vec<f64>);
type Asked = BTreeMap<String, Scalar>;

#[derive(FromPyObject, Clone)]
enum Scalar {
    Number(f64),
    Text(String),
}

fn distribution(name: &str, kind: &str, of: &[f64]) -> Result<Distribution, Error> {
    let infinite = f64::INFINITY;
    let found = match (kind, of) {
        ("uniform", &[lower, upper]) => Distribution::Uniform { lower, upper },
        ("log_uniform", &[lower, upper]) => Distribution::LogUniform { lower, upper },
        ("normal", &[mean, deviation]) => Distribution::Normal { mean, deviation, lower: -infinite, upper: infinite },
        ("normal", &[mean, deviation, lower, upper]) => Distribution::Normal { mean, deviation, lower, upper },
        ("log_normal", &[median, deviation]) => {
            Distribution::LogNormal { median, deviation, lower: 0.0, upper: infinite }
        }
        ("log_normal", &[median, deviation, lower, upper]) => {
            Distribution::LogNormal { median, deviation, lower, upper }
        }
        ("choice", values) => Distribution::Choice(values.to_vec()),
        (kind, of) => {
            let requirement =
                "uniform or log_uniform with two numbers, normal or log_normal with two or four, or choice";
            return Err(argument(name, &format!("{kind} with {} numbers", of.len()), requirement));
        }
    };
    found.check(name)?;
    Ok(found)
}

fn column(name: &str, trucks: &[String], stretches: usize, controlled: bool) -> Result<Column, Error> {
    let controller = name.strip_prefix("controller.").filter(|_| controlled);
    if let Some(k) = controller.and_then(|own| controllers::names().iter().position(|known| known == own)) {
        return Ok(Column::Controller(k));
    }
    if let Some(k) = trucks.iter().position(|known| known == name) {
        return Ok(Column::Parameter(k));
    }
    if let Some((condition, ..)) = CONDITIONS.iter().find(|(_, known, ..)| *known == name) {
        return Ok(Column::Condition(*condition));
    }
    match name.strip_prefix("profile.").map(str::parse::<usize>) {
        Some(Ok(k)) if k < stretches => Ok(Column::Level(k)),
        _ => Err(argument(
            "vary",
            name,
            "a parameter of the truck, a condition, controller.SETTING such as controller.main.delay where there is \
             a controller, or profile.K with the number of one of its stretches, from 0",
        )),
    }
}

/// An error of a requirement, that says of which.
fn of_requirement(whose: &str, error: Error) -> Error {
    match error {
        Error::Argument { name, value, requirement } => {
            Error::Argument { name: format!("{name} of [[require]] \"{whose}\""), value, requirement }
        }
        other => other,
    }
}

/// A requirement as a dictionary of numbers and words.
struct Wanted(Asked);

impl Wanted {
    fn number(&mut self, name: &str, default: Option<f64>) -> Result<f64, Error> {
        match (self.0.remove(name), default) {
            (Some(Scalar::Number(number)), _) if !number.is_nan() => Ok(number),
            (None, Some(number)) => Ok(number),
            (None, None) => Err(argument(name, "missing", "given for this template")),
            _ => Err(argument(name, "no number", "a number")),
        }
    }

    fn text(&mut self, name: &str) -> Result<String, Error> {
        match self.0.remove(name) {
            Some(Scalar::Text(text)) => Ok(text),
            Some(Scalar::Number(number)) => Err(argument(name, &number.to_string(), "a word")),
            None => Err(argument(name, "missing", "given")),
        }
    }

    /// What the requirement is called, and what is asked.
    fn named(mut self) -> Result<(String, Requirement), Error> {
        let name = self.text("name")?;
        let asked = self.requirement().map_err(|e| of_requirement(&name, e))?;
        Ok((name, asked))
    }

    fn requirement(mut self) -> Result<Requirement, Error> {
        let infinite = f64::INFINITY;
        let template = self.text("template")?;
        let signal = self.text("signal")?;
        let Some((signal, ..)) = SIGNALS.iter().find(|(_, name, ..)| *name == signal) else {
            let known: Vec<&str> = SIGNALS.iter().map(|(_, name, ..)| *name).collect();
            return Err(argument("signal", &signal, &known.join(", ")));
        };
        let lift = match self.number("lift", Some(0.0))? {
            0.0 => 0,
            1.0 => 1,
            other => return Err(argument("lift", &other.to_string(), "0 or 1")),
        };
        let peak_to_peak_s = match self.number("peak_to_peak_s", Some(0.0))? {
            0.0 => None,
            window => Some(window),
        };
        let either = |lower: f64, upper: f64| {
            if lower == -infinite && upper == infinite {
                return Err(argument("upper", "missing", "given, or lower"));
            }
            if lower >= upper {
                return Err(argument("upper", &upper.to_string(), &format!("above lower, {lower}")));
            }
            Ok(())
        };
        let positive = |name: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                return Ok(value);
            }
            Err(argument(name, &value.to_string(), "above 0"))
        };
        let behind_the_step = |name: &str, after_s: f64| match peak_to_peak_s.filter(|window| *window > after_s) {
            None => Ok(()),
            Some(window) => {
                let requirement = format!("at most {name}, {after_s}: it must not look back over the step");
                Err(argument("peak_to_peak_s", &window.to_string(), &requirement))
            }
        };
        let template = match template.as_str() {
            "always" | "stays_inside" | "reaches" => {
                let (low, high) = match template.as_str() {
                    "stays_inside" => (None, None),
                    _ => (Some(-infinite), Some(infinite)),
                };
                let (lower, upper) = (self.number("lower", low)?, self.number("upper", high)?);
                either(lower, upper)?;
                let (from_s, to_s) = (self.number("from_s", Some(0.0))?, self.number("to_s", Some(infinite))?);
                match template.as_str() {
                    "always" => Template::Always { lower, upper, from_s, to_s },
                    "stays_inside" => Template::StaysInside { lower, upper, from_s, to_s },
                    _ => Template::Reaches { lower, upper, from_s, to_s },
                }
            }
            "never_after_settling" => {
                let after_s = positive("after_s", self.number("after_s", None)?)?;
                behind_the_step("after_s", after_s)?;
                Template::NeverAfterSettling { upper: self.number("upper", None)?, after_s }
            }
            "settles" => {
                let within_s = positive("within_s", self.number("within_s", None)?)?;
                behind_the_step("within_s", within_s)?;
                Template::Settles { band: positive("band", self.number("band", None)?)?, within_s }
            }
            "responds" => {
                let share = self.number("share", None)?;
                if *signal != Signal::Speed || !(share > 0.0 && share < 1.0) {
                    return Err(argument("share", &share.to_string(), "between 0 and 1, of the signal speed"));
                }
                if let Some(window) = peak_to_peak_s {
                    return Err(argument(
                        "peak_to_peak_s",
                        &window.to_string(),
                        "left out: it is the speed that responds",
                    ));
                }
                Template::Responds { share, within_s: positive("within_s", self.number("within_s", None)?)? }
            }
            other => {
                return Err(argument(
                    "template",
                    other,
                    "always, stays_inside, never_after_settling, settles, responds or reaches",
                ))
            }
        };
        match self.0.into_keys().next() {
            Some(name) => Err(argument("require", &name, "a key that this template has")),
            None => Ok(Requirement { lift, signal: *signal, peak_to_peak_s, template }),
        }
    }
}

fn open_loop(_: &[f64]) -> Result<Box<dyn Controller>, Error> {
    Ok(Box::new(OpenLoop))
}

impl PyEnsemble {
    fn with_make<T>(&self, run: impl FnOnce(Make<'_>) -> T) -> T {
        match &self.fleet {
            Some(fleet) => run(&|numbers: &[f64]| fleet.controller(numbers)),
            None => run(&open_loop),
        }
    }

    fn rows(&self, name: &str, given: &PyReadonlyArray2<'_, f64>) -> Result<Vec<f64>, Error> {
        let array = given.as_array();
        let width = self.trial.makeup.columns.len();
        if array.shape()[1] != width {
            let (got, expected) =
                (format!("{:?}", array.shape()), format!("(n, {width}), one column per varied quantity"));
            return Err(Error::Shape { name: name.into(), got, expected });
        }
        Ok(array.iter().copied().collect())
    }
}

#[pymethods]
impl PyEnsemble {
    #[new]
    #[pyo3(signature = (truck, lifts, *, conditions, profile, vary, require, settle_s, band_m_s, duration_s, substeps,
                        seed, controller=None, threads=0, precision="double"))]
    #[allow(clippy::too_many_arguments)] // keyword arguments in Python
    fn new(
        py: Python<'_>,
        truck: &PyTruck,
        lifts: &str,
        conditions: BTreeMap<String, f64>,
        profile: Vec<(f64, f64)>,
        vary: Vec<Varied>,
        require: Vec<Asked>,
        settle_s: f64,
        band_m_s: f64,
        duration_s: f64,
        substeps: usize,
        seed: u64,
        controller: Option<GivenController>,
        threads: usize,
        precision: &str,
    ) -> PyResult<Self> {
        let make = || -> Result<PyEnsemble, Error> {
            let (lifts, _) = lifts_of(lifts)?;
            let mut fixed = DEFAULTS;
            for (name, value) in &conditions {
                let Some(k) = CONDITIONS.iter().position(|(_, known, ..)| known == name) else {
                    return Err(argument("conditions", name, "one of the conditions that a member has"));
                };
                fixed[k] = *value;
            }
            let fleet = match controller {
                None => None,
                Some((shared, free, main, word)) => {
                    let lifts = [free.0.clone(), main.0.clone()];
                    let (settings, word) = control::settings(&shared, free, main, word)?;
                    Some(Fleet::new(settings, &shared, [&lifts[0], &lifts[1]], word)?)
                }
            };
            let numbers = fleet.as_ref().map_or(Vec::new(), |fleet| fleet.numbers().to_vec());
            let known = truck.core().names();
            let mut columns = Vec::new();
            for (name, kind, of) in &vary {
                columns.push((column(name, &known, profile.len(), fleet.is_some())?, distribution(name, kind, of)?));
            }
            let required = require.into_iter().map(|asked| Wanted(asked).named()).collect::<Result<Vec<_>, _>>()?;
            let (titles, requirements): (Vec<_>, Vec<_>) = required.into_iter().unzip();
            let makeup = Makeup::new(truck.core().clone(), lifts, fixed, profile.clone(), numbers, columns, seed)?;
            let ticks = whole_ticks(duration_s, TICK_S)?;
            let settling = Settling { after_s: settle_s, band_m_s };
            let precision = match precision {
                "double" => Precision::Double,
                "single" => Precision::Single,
                other => return Err(argument("precision", other, "double or single")),
            };
            let followed = fleet.is_some();
            let trial = Trial { makeup, requirements, settling, tick_s: TICK_S, ticks, substeps, precision, followed };
            for (name, requirement) in titles.iter().zip(&trial.requirements) {
                trial.check_of(requirement).map_err(|e| of_requirement(name, e))?;
            }
            trial.check()?;
            if threads > MOST_THREADS {
                return Err(argument("threads", &threads.to_string(), &format!("at most {MOST_THREADS}; 0 takes all")));
            }
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.map_err(|e| argument("threads", &threads.to_string(), &format!("possible here ({e})")))?;
            Ok(PyEnsemble { trial, fleet, names: vary.into_iter().map(|(name, ..)| name).collect(), pool })
        };
        make().map_err(|e| raise(py, &e))
    }

    #[getter]
    fn columns(&self) -> Vec<String> {
        self.names.clone()
    }

    #[getter]
    fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    fn uniform<'py>(&self, py: Python<'py>, first: u64, count: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dimensions = self.trial.makeup.columns.len();
        if count > MOST_AT_ONCE || first > u64::MAX / 3 - count as u64 {
            let requirement = format!("at most {MOST_AT_ONCE} members at a time, of those before 2^62");
            return Err(raise(py, &argument("count", &count.to_string(), &requirement)));
        }
        let numbers = py.detach(|| draw::uniform(self.trial.makeup.seed, first, count, dimensions));
        numbers.into_pyarray(py).reshape([count, dimensions])
    }

    fn values<'py>(&self, py: Python<'py>, uniform: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let numbers = self.rows("uniform", &uniform).map_err(|e| raise(py, &e))?;
        let (count, dimensions) = (uniform.as_array().shape()[0], self.trial.makeup.columns.len());
        let makeup = &self.trial.makeup;
        let values: Vec<f64> = py.detach(|| numbers.chunks(dimensions.max(1)).flat_map(|u| makeup.at(u)).collect());
        values.into_pyarray(py).reshape([count, dimensions])
    }

    #[pyo3(signature = (values, streams, *, lanes=None))]
    #[allow(clippy::type_complexity)] // a pair of arrays
    fn run<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray2<'py, f64>,
        streams: PyReadonlyArray1<'py, u64>,
        lanes: Option<usize>,
    ) -> PyResult<(Bound<'py, PyArray1<u8>>, Bound<'py, PyArray2<f64>>)> {
        let fail = |e: Error| raise(py, &e);
        let columns = self.rows("values", &values).map_err(fail)?;
        let streams = streams.as_array().to_vec();
        if streams.len() != values.as_array().shape()[0] {
            let expected = format!("{}, one per member", values.as_array().shape()[0]);
            return Err(fail(Error::Shape { name: "streams".into(), got: streams.len().to_string(), expected }));
        }
        let widths = self.trial.precision.widths();
        let width = match lanes {
            None => self.trial.precision.widest(),
            Some(lanes) => *widths.iter().find(|width| width.lanes() == lanes).ok_or_else(|| {
                let known: Vec<String> = widths.iter().map(|width| width.lanes().to_string()).collect();
                fail(argument("lanes", &lanes.to_string(), &known.join(" or ")))
            })?,
        };
        let outcomes = watched(py, |interrupt| {
            self.pool.install(|| self.with_make(|make| self.trial.run(&columns, &streams, make, width, interrupt)))
        })?;
        let verdicts: Vec<u8> = outcomes.iter().map(|outcome| outcome.verdict as u8).collect();
        let numbers: Vec<f64> = outcomes.into_iter().flat_map(|outcome| outcome.numbers).collect();
        let numbers = numbers.into_pyarray(py).reshape([streams.len(), self.trial.numbers()])?;
        Ok((verdicts.into_pyarray(py), numbers))
    }

    fn trace<'py>(
        &self,
        py: Python<'py>,
        values: PyReadonlyArray1<'py, f64>,
        stream: u64,
    ) -> PyResult<Bound<'py, PyDict>> {
        let columns = values.as_array().to_vec();
        if columns.len() != self.names.len() {
            let expected = format!("{}, one per varied quantity", self.names.len());
            let got = columns.len().to_string();
            return Err(raise(py, &Error::Shape { name: "values".into(), got, expected }));
        }
        let (outcome, trace) =
            watched(py, |interrupt| self.with_make(|make| self.trial.trace(&columns, stream, make, &|| interrupt())))?;
        let ticks = trace.orders.len();
        let answer = PyDict::new(py);
        answer.set_item("verdict", outcome.verdict as u8)?;
        answer.set_item("numbers", outcome.numbers.into_pyarray(py))?;
        answer.set_item("outputs", trace.outputs.into_pyarray(py).reshape([ticks, OUTPUTS.len()])?)?;
        let si = |f: &dyn Fn(usize) -> [i32; 2]| -> Vec<f64> {
            (0..ticks).flat_map(|k| f(k).map(|milli| 1e-3 * f64::from(milli))).collect()
        };
        let reference = si(&|k| trace.orders[k].reference);
        let current = si(&|k| trace.orders[k].current);
        answer.set_item("reference", reference.into_pyarray(py).reshape([ticks, 2])?)?;
        answer.set_item("current", current.into_pyarray(py).reshape([ticks, 2])?)?;
        let request: Vec<f64> = trace.request.iter().map(|milli| 1e-3 * f64::from(*milli)).collect();
        answer.set_item("request", request.into_pyarray(py))?;
        answer.set_item("tick_s", TICK_S)?;
        Ok(answer)
    }
}

/// What a sweep may vary, ask and measure: rows of dictionaries.
#[pyfunction]
fn ensemble_tables(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let tables = PyDict::new(py);
    let row = |pairs: &[(&str, &str)]| -> PyResult<Bound<'_, PyDict>> {
        let row = PyDict::new(py);
        for (key, value) in pairs {
            row.set_item(key, value)?;
        }
        Ok(row)
    };
    let mut conditions = Vec::new();
    for (k, (_, name, unit, lower, upper, meaning)) in CONDITIONS.iter().enumerate() {
        let found = row(&[("name", name), ("unit", unit), ("meaning", meaning)])?;
        found.set_item("lower", lower)?;
        found.set_item("upper", upper)?;
        found.set_item("default", DEFAULTS[k])?;
        conditions.push(found);
    }
    tables.set_item("conditions", conditions)?;
    let all = |rows: Vec<[(&str, &str); 3]>| rows.iter().map(|pairs| row(pairs)).collect::<PyResult<Vec<_>>>();
    let signals =
        SIGNALS.iter().map(|(_, name, unit, meaning)| [("name", *name), ("unit", *unit), ("meaning", *meaning)]);
    tables.set_item("signals", all(signals.collect())?)?;
    let measures =
        MEASURES.iter().map(|(name, unit, meaning)| [("name", *name), ("unit", *unit), ("meaning", *meaning)]);
    tables.set_item("measures", all(measures.collect())?)?;
    let verdicts = VERDICTS.iter().map(|(_, name, meaning)| [("name", *name), ("unit", "1"), ("meaning", *meaning)]);
    tables.set_item("verdicts", all(verdicts.collect())?)?;
    tables.set_item("tick_s", TICK_S)?;
    Ok(tables)
}

type LinearArrays<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// Rates, and their derivatives along the states and the command, of one lift about a state.
#[pyfunction]
fn linearise<'py>(
    py: Python<'py>,
    truck: &PyTruck,
    lift: &str,
    state: PyReadonlyArray1<'py, f64>,
    command: f64,
    load: f64,
    oil_temperature: f64,
) -> PyResult<LinearArrays<'py>> {
    let make = || match lifts_of(lift)?.1[..] {
        [lift] => linear::linearise(truck.core(), lift, &state.as_array().to_vec(), command, load, oil_temperature),
        _ => Err(argument("lift", lift, "free or main")),
    };
    let found = make().map_err(|e| raise(py, &e))?;
    let n = found.rates.len();
    let a = found.a.into_pyarray(py).reshape([n, n])?;
    Ok((found.rates.into_pyarray(py), a, found.b.into_pyarray(py)))
}

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("LANES", Precision::Double.widest().lanes())?;
    m.add("SINGLE_LANES", Precision::Single.widest().lanes())?;
    m.add_class::<PyEnsemble>()?;
    m.add_function(wrap_pyfunction!(linearise, m)?)?;
    m.add_function(wrap_pyfunction!(ensemble_tables, m)?)
}
