//! The tables of names, units, bounds and meanings, as lists of dictionaries.

use hydro_core::effects::{Kind, StateSpec, VARIABLES};
use hydro_core::mast::{LiftName, LIFT_STATES};
use hydro_core::outputs::{CHANNELS, OUTPUTS};
use hydro_core::parameters::{Origin, ParameterSpec, Scale, LIFT_PARAMETERS, TABLE_PARAMETERS};
use hydro_core::ports::{Join, PORTS};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

fn parameter<'py>(py: Python<'py>, spec: &ParameterSpec, length: &str) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("name", spec.name)?;
    row.set_item("symbol", spec.symbol)?;
    row.set_item("unit", spec.unit)?;
    row.set_item("lower", spec.lower)?;
    row.set_item("upper", spec.upper)?;
    let scale = match spec.scale {
        Scale::Log => "log",
        Scale::Linear => "linear",
        Scale::LogLog => "loglog",
        Scale::LogCos => "logcos",
    };
    row.set_item("scale", scale)?;
    let origin = match spec.origin {
        Origin::Given => "given",
        Origin::Chosen => "chosen",
        Origin::Steady => "steady",
        Origin::Prms => "prms",
    };
    row.set_item("origin", origin)?;
    row.set_item("equation", spec.equation)?;
    row.set_item("meaning", spec.meaning)?;
    row.set_item("bounds_reason", spec.bounds_reason)?;
    row.set_item("length", length)?;
    Ok(row)
}

fn quantity<'py>(py: Python<'py>, name: &str, unit: &str, meaning: &str) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("name", name)?;
    row.set_item("unit", unit)?;
    row.set_item("meaning", meaning)?;
    Ok(row)
}

fn state<'py>(py: Python<'py>, spec: &StateSpec) -> PyResult<Bound<'py, PyDict>> {
    let row = quantity(py, spec.name, spec.unit, spec.meaning)?;
    row.set_item("scale", spec.scale)?;
    Ok(row)
}

/// The parameters of one lift: scalars, then the knots of the area table.
#[pyfunction]
fn parameter_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for spec in LIFT_PARAMETERS {
        rows.append(parameter(py, spec, "scalar")?)?;
    }
    for spec in &TABLE_PARAMETERS {
        rows.append(parameter(py, spec, "knots")?)?;
    }
    Ok(rows)
}

/// The states of one lift.
#[pyfunction]
fn state_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for spec in LIFT_STATES {
        rows.append(state(py, spec)?)?;
    }
    Ok(rows)
}

/// The outputs of a simulation.
#[pyfunction]
fn output_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for spec in OUTPUTS {
        rows.append(quantity(py, spec.name, spec.unit, spec.meaning)?)?;
    }
    Ok(rows)
}

/// The columns a recording may have.
#[pyfunction]
fn channel_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for spec in CHANNELS {
        let row = quantity(py, spec.name, spec.unit, spec.meaning)?;
        row.set_item("lower", spec.lower)?;
        row.set_item("upper", spec.upper)?;
        row.set_item("typical_lower", spec.typical.map(|t| t.0))?;
        row.set_item("typical_upper", spec.typical.map(|t| t.1))?;
        rows.append(row)?;
    }
    Ok(rows)
}

/// The effects of the catalogue.
#[pyfunction]
fn effect_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for kind in Kind::ALL {
        let spec = kind.spec();
        let row = PyDict::new(py);
        row.set_item("id", spec.id)?;
        row.set_item("scope", spec.scope.as_str())?;
        row.set_item("equation", spec.equation)?;
        row.set_item("source", spec.source)?;
        let parameters = PyList::empty(py);
        for (p, [least, most]) in spec.parameters.iter().zip(spec.plausible) {
            let parameter = parameter(py, p, "scalar")?;
            parameter.set_item("plausible_lower", least)?;
            parameter.set_item("plausible_upper", most)?;
            parameters.append(parameter)?;
        }
        row.set_item("parameters", parameters)?;
        row.set_item("quiet", spec.quiet)?;
        row.set_item("amplitudes", kind.amplitudes())?;
        let states = PyList::empty(py);
        for s in spec.states {
            states.append(state(py, s)?)?;
        }
        row.set_item("states", states)?;
        let shows = PyList::empty(py);
        for (k, output, factor) in spec.shows {
            shows.append((spec.states[*k].name, output, factor))?;
        }
        row.set_item("shows", shows)?;
        rows.append(row)?;
    }
    Ok(rows)
}

/// The ports of one lift.
#[pyfunction]
fn port_table(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for spec in PORTS {
        let row = quantity(py, spec.name, spec.unit, spec.meaning)?;
        let join = match spec.join {
            Join::Sum => "sum",
            Join::Factor => "factor",
        };
        row.set_item("join", join)?;
        row.set_item("typical", spec.typical)?;
        rows.append(row)?;
    }
    Ok(rows)
}

/// What a free shape may be a function of.
#[pyfunction]
fn shape_variables(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let rows = PyList::empty(py);
    for spec in VARIABLES {
        let row = quantity(py, spec.name, spec.unit, spec.meaning)?;
        row.set_item("finest", spec.finest)?;
        let outputs = PyDict::new(py);
        for lift in LiftName::BOTH {
            if let Some((output, factor)) = spec.output(lift) {
                outputs.set_item(lift.as_str(), (output, factor))?;
            }
        }
        row.set_item("outputs", outputs)?;
        rows.append(row)?;
    }
    Ok(rows)
}

pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(parameter_table, m)?)?;
    m.add_function(wrap_pyfunction!(state_table, m)?)?;
    m.add_function(wrap_pyfunction!(output_table, m)?)?;
    m.add_function(wrap_pyfunction!(channel_table, m)?)?;
    m.add_function(wrap_pyfunction!(effect_table, m)?)?;
    m.add_function(wrap_pyfunction!(port_table, m)?)?;
    m.add_function(wrap_pyfunction!(shape_variables, m)?)
}
