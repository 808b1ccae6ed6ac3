//! The controller: its settings as tables, its integers, its C, and trucks lowered by it.

use std::sync::{Arc, Mutex, PoisonError};

use hydro_core::control::c_export::c_sources;
use hydro_core::control::config::Config;
use hydro_core::control::controller::FixedPoint;
use hydro_core::control::fixed::{Word, MOST_SHIFT};
use hydro_core::control::ranges::{ranges, widest};
use hydro_core::control::settings::{
    Curve, Lift, LiftSettings, SettingSpec, Settings, ShaperSettings, SharedSettings, SwingSettings, LIFT_SETTINGS,
    SHARED_SETTINGS, TICK_S,
};
use hydro_core::control::twin::FloatingPoint;
use hydro_core::control::vectors::{digest, helper_digest, Helper};
use hydro_core::ensemble::member::{Condition, CONDITIONS};
use hydro_core::outputs::OUTPUTS;
use hydro_core::run::closed_loop::{Controller, Reading, Seat};
use hydro_core::run::lowering::{lower, Member};
use hydro_core::run::sensing::Sensors;
use hydro_core::run::ticks::Clock;
use hydro_core::run::Solver;
use hydro_core::sensors::PRESSURE_STEP;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::raise;
use crate::truck::{argument, lifts_of, PyTruck};
use crate::watch::watched;

fn rows<'py>(py: Python<'py>, specs: &[SettingSpec]) -> PyResult<Bound<'py, PyList>> {
    let rows = PyList::empty(py);
    for spec in specs {
        let row = PyDict::new(py);
        row.set_item("name", spec.name)?;
        row.set_item("unit", spec.unit)?;
        row.set_item("lower", spec.lower)?;
        row.set_item("upper", spec.upper)?;
        row.set_item("meaning", spec.meaning)?;
        rows.append(row)?;
    }
    Ok(rows)
}

/// The settings of one lift.
#[pyfunction]
fn lift_setting_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    rows(py, LIFT_SETTINGS)
}

/// The settings that both lifts share.
#[pyfunction]
fn shared_setting_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    rows(py, SHARED_SETTINGS)
}

/// A curve's first place, the base-2 logarithm of its knots' distance, and its values.
pub type GivenCurve = (i32, u32, Vec<f64>);
/// Knots' distance, frequencies, dampings, gains, leads.
pub type GivenSwing = (u32, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);
/// Knots' distance, delays, shares.
pub type GivenShaper = (u32, Vec<f64>, Vec<f64>);
/// Numbers in the order of the table, the speed table, the ratio, the pressure's swing, the shaper.
pub type GivenLift = (Vec<f64>, GivenCurve, GivenCurve, Option<GivenSwing>, Option<GivenShaper>);

/// A controller's integers.
#[pyclass(name = "Controller", module = "forklift._core", frozen)]
pub struct PyController(Config);

fn curve((first, spacing, values): GivenCurve) -> Curve {
    Curve { first, spacing, values }
}

fn lift_of(name: &str, (numbers, table, ratio, swing, shaper): GivenLift) -> Result<Lift, hydro_core::error::Error> {
    let swing = swing.map(|(spacing, frequency, damping, gain, lead)| SwingSettings {
        spacing,
        frequency,
        damping,
        gain,
        lead,
    });
    let shaper = shaper.map(|(spacing, delay, share)| ShaperSettings { spacing, delay, share });
    let numbers = LiftSettings::from_values(name, &numbers)?;
    Ok(Lift { numbers, table: curve(table), ratio: curve(ratio), swing, shaper })
}

/// Settings as Python gives them, and the word that holds them.
pub fn settings(
    shared: &[f64],
    free: GivenLift,
    main: GivenLift,
    word: u32,
) -> Result<(Settings, Word), hydro_core::error::Error> {
    let Some(word) = Word::BOTH.into_iter().find(|known| known.bits() == word) else {
        return Err(argument("word", &word.to_string(), "16 or 32 bits"));
    };
    let shared = SharedSettings::from_values("shared", shared)?;
    let lifts = [lift_of("free", free)?, lift_of("main", main)?];
    Ok((Settings { shared, lifts }, word))
}

fn configured(shared: &[f64], free: GivenLift, main: GivenLift, word: u32) -> Result<Config, hydro_core::error::Error> {
    let (settings, word) = settings(shared, free, main, word)?;
    settings.config(word)
}

#[pymethods]
impl PyController {
    #[new]
    fn new(py: Python<'_>, shared: Vec<f64>, free: GivenLift, main: GivenLift, word: u32) -> PyResult<Self> {
        configured(&shared, free, main, word).map(PyController).map_err(|e| raise(py, &e))
    }

    #[getter]
    fn hash(&self) -> String {
        format!("{:016x}", self.0.hash())
    }

    /// The header, the source, its test, what Frama-C's Eva analyses it with, and the test of its helpers.
    fn c_sources(&self, name: &str) -> (String, String, String, String, String) {
        let sources = c_sources(&self.0, name);
        (sources.header, sources.source, sources.test, sources.eva, sources.helpers)
    }

    /// Of a helper's answers to the upper 16-bit arguments from `first` to before `last` with every lower one.
    ///
    /// `number` is the shift of times, rounded and truncated, the lift of table.
    fn helper_digest(&self, py: Python<'_>, helper: &str, number: u32, first: i64, last: i64) -> PyResult<u64> {
        let known = match (helper, number) {
            ("times", shift @ 0..=MOST_SHIFT) => Helper::Times(shift),
            ("rounded", shift @ 0..=MOST_SHIFT) => Helper::Rounded(shift),
            ("truncated", shift @ 0..=MOST_SHIFT) => Helper::Truncated(shift),
            ("saturated", _) => Helper::Saturated,
            ("table", lift @ 0..=1) => Helper::Table(lift as usize),
            _ => {
                let wanted = "times, rounded or truncated with a shift, saturated, table with a lift";
                return Err(raise(py, &argument("helper", &format!("{helper} {number}"), wanted)));
            }
        };
        let (first, last) = (first.max(i64::from(i16::MIN)), last.min(i64::from(i16::MAX) + 1));
        Ok(py.detach(|| helper_digest(&self.0, known, first..last)))
    }

    /// Of so many ticks from random states.
    fn digest(&self, py: Python<'_>, seed: u64, ticks: u64) -> u64 {
        py.detach(|| digest(&self.0, seed, ticks))
    }

    /// The bits of the widest product or sum.
    #[getter]
    fn widest(&self) -> u32 {
        widest(&self.0)
    }

    /// Every variable of a tick.
    fn ranges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let rows = PyList::empty(py);
        for range in ranges(&self.0) {
            let row = PyDict::new(py);
            row.set_item("lift", ["", "free", "main"][range.owner])?;
            row.set_item("variable", range.variable)?;
            row.set_item("reach", (range.reach.0, range.reach.1))?;
            row.set_item("kept", (range.kept.0, range.kept.1))?;
            row.set_item("scale", range.scale)?;
            row.set_item("unit", range.unit)?;
            row.set_item("saturates", range.saturates())?;
            rows.append(row)?;
        }
        Ok(rows)
    }

    /// From its start through requests (n,) and readings (n, 5): positions, pressures, temperature. Gives currents and
    /// references, each of free and main.
    #[pyo3(signature = (requests, readings, floating=false))]
    #[allow(clippy::type_complexity)]
    fn ticks(
        &self,
        py: Python<'_>,
        requests: Vec<i32>,
        readings: PyReadonlyArray2<'_, i32>,
        floating: bool,
    ) -> PyResult<(Vec<[i32; 2]>, Vec<[i32; 2]>)> {
        let readings = readings.as_array();
        if readings.shape() != [requests.len(), 5] {
            let got = format!("{:?}", readings.shape());
            let expected = format!("({}, 5), a row per request", requests.len());
            return Err(raise(py, &hydro_core::error::Error::Shape { name: "readings".into(), got, expected }));
        }
        let mut controller = seated(&self.0, floating);
        let answers = requests.iter().zip(readings.rows()).map(|(&request, row)| {
            let reading = Reading { position: [row[0], row[1]], pressure: [row[2], row[3]], temperature: row[4] };
            (controller.tick(request, &reading), controller.reference())
        });
        Ok(answers.unzip())
    }
}

/// A controller whose readings are written down, row by row as [`Controller::tick`] has them.
struct Noted<'a> {
    inner: Box<dyn Controller + 'a>,
    readings: Arc<Mutex<Vec<i32>>>,
}

impl Controller for Noted<'_> {
    fn tick(&mut self, request: i32, reading: &Reading) -> [i32; 2] {
        let Reading { position, pressure, temperature } = *reading;
        let row = [position[0], position[1], pressure[0], pressure[1], temperature];
        // A poisoned lock has lost no row that anyone will read.
        self.readings.lock().unwrap_or_else(PoisonError::into_inner).extend(row);
        self.inner.tick(request, reading)
    }
    fn reference(&self) -> [i32; 2] {
        self.inner.reference()
    }
}

fn seated(config: &Config, floating: bool) -> Box<dyn Controller + '_> {
    match floating {
        true => Box::new(FloatingPoint::new(config)),
        false => Box::new(FixedPoint::new(config)),
    }
}

/// Lowers trucks by controllers, all ticks of 20 ms. Every list has an entry per member; `requests` [mm/s] is (members,
/// ticks). Gives outputs (members, ticks, outputs) at each tick, references and currents (members, ticks, 2).
#[pyfunction]
#[pyo3(signature = (trucks, controllers, loads, oil_temperatures, starts, requests, delays, noises, zeros, streams, *,
                    seed, lifts="both", substeps=Solver::DEFAULT_SUBSTEPS, floating=false, noted=false))]
#[allow(clippy::too_many_arguments)] // keyword arguments in Python
fn closed_loop<'py>(
    py: Python<'py>,
    trucks: Vec<PyRef<'py, PyTruck>>,
    controllers: Vec<PyRef<'py, PyController>>,
    loads: Vec<f64>,
    oil_temperatures: Vec<f64>,
    starts: Vec<[f64; 2]>,
    requests: PyReadonlyArray2<'py, i32>,
    delays: Vec<usize>,
    noises: Vec<[f64; 2]>,
    zeros: Vec<[f64; 2]>,
    streams: Vec<u64>,
    seed: u64,
    lifts: &str,
    substeps: usize,
    floating: bool,
    noted: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (n, ticks) = (trucks.len(), requests.as_array().shape()[1]);
    let lengths =
        [controllers.len(), loads.len(), oil_temperatures.len(), starts.len(), requests.as_array().shape()[0]];
    let others = [delays.len(), noises.len(), zeros.len(), streams.len()];
    if lengths.iter().chain(&others).any(|&length| length != n) {
        let error = argument("members", &format!("{lengths:?}, {others:?}"), &format!("{n} of each, one per truck"));
        return Err(raise(py, &error));
    }
    for (name, values, (lower, upper)) in
        [("load", &loads, (0.0, 2e4)), ("oil_temperature", &oil_temperatures, (-50.0, 150.0))]
    {
        if let Some(value) = values.iter().find(|value| !(lower..=upper).contains(*value)) {
            return Err(raise(py, &argument(name, &value.to_string(), &format!("between {lower} and {upper}"))));
        }
    }
    let (_, _, _, _, most, _) = CONDITIONS[Condition::Delay as usize];
    if let Some(delay) = delays.iter().find(|delay| **delay > most as usize) {
        let requirement = format!("at most {most} ticks");
        return Err(raise(py, &argument("delay", &delay.to_string(), &requirement)));
    }
    let (which, _) = lifts_of(lifts).map_err(|e| raise(py, &e))?;
    let rows: Vec<Vec<i32>> = requests.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
    let time: Vec<f64> = (0..ticks).map(|k| k as f64 * TICK_S).collect();
    let zero = vec![0.0; ticks];
    let readings: Vec<Arc<Mutex<Vec<i32>>>> = (0..n).map(|_| Arc::default()).collect();
    let members: Vec<Member> = (0..n)
        .map(|k| {
            let [pressure, temperature] = noises[k];
            let inner = seated(&controllers[k].0, floating);
            let seat = Seat {
                controller: if noted { Box::new(Noted { inner, readings: readings[k].clone() }) } else { inner },
                sensors: Sensors::noisy(pressure, temperature, zeros[k], seed, streams[k]),
                request: &rows[k],
                delay: delays[k],
            };
            let (truck, load_kg) = (trucks[k].core(), loads[k]);
            Member { truck, load_kg, warmer: oil_temperatures[k], start: starts[k], seat }
        })
        .collect();
    let clock = Clock { time: &time, oil_temperature_degc: &zero };
    let traces = watched(py, |interrupt| lower(members, which, clock, substeps, interrupt))?;
    let answer = PyDict::new(py);
    let outputs: Vec<f64> = traces.iter().flat_map(|trace| trace.outputs.iter().copied()).collect();
    answer.set_item("outputs", outputs.into_pyarray(py).reshape([n, ticks, OUTPUTS.len()])?)?;
    let orders = || traces.iter().flat_map(|trace| &trace.orders);
    let reference: Vec<i32> = orders().flat_map(|order| order.reference).collect();
    let current: Vec<i32> = orders().flat_map(|order| order.current).collect();
    answer.set_item("reference", reference.into_pyarray(py).reshape([n, ticks, 2])?)?;
    answer.set_item("current", current.into_pyarray(py).reshape([n, ticks, 2])?)?;
    let written = |own: &Arc<Mutex<Vec<i32>>>| {
        let mut rows = own.lock().unwrap_or_else(PoisonError::into_inner).clone();
        // A truck that ran away reads nothing more.
        rows.resize(if noted { 5 * ticks } else { 0 }, 0);
        rows
    };
    let readings: Vec<i32> = readings.iter().flat_map(written).collect();
    answer.set_item("readings", readings.into_pyarray(py).reshape([n, if noted { ticks } else { 0 }, 5])?)?;
    Ok(answer)
}

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("CONTROL_TICK_S", TICK_S)?;
    m.add("PRESSURE_STEP_PA", PRESSURE_STEP)?;
    m.add_class::<PyController>()?;
    m.add_function(wrap_pyfunction!(lift_setting_table, m)?)?;
    m.add_function(wrap_pyfunction!(shared_setting_table, m)?)?;
    m.add_function(wrap_pyfunction!(closed_loop, m)?)
}
