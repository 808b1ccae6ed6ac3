"""What the effects of a truck add where they act: the laws that a page draws."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosed import diagnosed
from forklift import _core
from forklift.diagnosis.laws import law as law_of
from forklift.diagnosis.laws import laws
from forklift.plant.forklift.free_curve import FreeCurve
from forklift.plant.forklift.model import OWN
from forklift.plant.subject import Term

BARS = 1e5
EFFECTS = {one["id"]: one for one in _core.effect_table()}
SILENT = {"mast_coupling": "joins the lifts", "valve_delay": "delays"}
"""Effects that add nothing at a port, and why."""
SHAPES = {"free_shape", "fine_shape", "free_response"}
"""Their plausible values are either side of nothing; they have a test of their own."""


@pytest.fixture(scope="module")
def complete():
    return diagnosed("null").selection.baseline


@pytest.fixture(scope="module")
def a_case(complete):
    """The first recording and its conditions, of a machine that lacks nothing."""
    problem, x = complete.found.problem, complete.found.x
    return problem.machine, problem.samples[0], problem.conditions(x, 0)


def ran(machine, case, conditions, values):
    """Outputs by name, with these values."""
    (run,) = machine.run(values, [case], [conditions], substeps=8)
    return dict(zip(machine.outputs, run.outputs.T, strict=True))


def test_the_leak_that_was_found_is_a_straight_line_of_the_pressure_with_its_interval_as_band():
    found = diagnosed("leak")
    (cause,) = found.to_dict()["causes"]
    (size,) = cause["parameters"]
    (law,) = laws(found.machine, found.final)
    assert (law.port, law.variable) == (f"{cause['where']}.cylinder_flow", "pressure")
    assert law.explained > 0.999
    assert law.slope == pytest.approx(-size["value"], rel=1e-3)
    tank = found.machine.at(found.values).values[f"{cause['where']}.tank.pressure"]
    np.testing.assert_allclose(law.added, -size["value"] * (law.values - tank), rtol=1e-3)
    half = 0.5 * (size["upper"] - size["lower"]) / size["value"]
    np.testing.assert_allclose(law.band, half * np.abs(law.added), rtol=0.05)


def test_nothing_is_added_by_a_model_without_effects(complete):
    machine = diagnosed("null").machine
    assert laws(machine, complete) == []


@pytest.mark.parametrize("id", sorted(set(EFFECTS) - SHAPES))
def test_an_effect_adds_nothing_at_its_quiet_value_and_acts_where_it_is_loud(id, a_case):
    machine, case, conditions = a_case
    lift = "free" if case.recording.lift != "main" else "main"
    spec = EFFECTS[id]
    head = f"{lift}.{id}" if spec["scope"] == "lift" else id
    usual = {
        f"{head}.{one['name']}": 0.5 * (one["plausible_lower"] + one["plausible_upper"])
        for one in spec["parameters"]
    }
    amplitudes = list(usual)[: spec["amplitudes"]]
    quiet = usual | dict.fromkeys(amplitudes, spec["quiet"])
    prepared = case.prepared.case(0.0)
    assert machine.at(quiet).core.added(prepared, conditions, [], substeps=2) == []
    core = machine.at(usual).core
    conditions = np.array(conditions)
    conditions[OWN.index(f"{lift}.start")] = 0.3  # from where it reaches the end of the stroke
    told = core.added(prepared, conditions, [core, machine.at(quiet).core], substeps=2)
    assert bool(told) == (id not in SILENT)
    for effect, port, rows in told:
        assert effect == head
        assert rows.shape == (3, len(case.recording.time_s))
        assert np.isfinite(rows).all()
        np.testing.assert_array_equal(rows[0], rows[1])  # the same values in the same states
        if not spec["states"]:  # which the loud one has moved
            assert not rows[2].any(), port


@pytest.mark.parametrize(("port", "join"), [("viscosity", "factor"), ("force", "sum")])
def test_a_curve_is_drawn_as_the_model_has_it_against_its_own_variable(port, join, a_case):
    machine, case, conditions = a_case
    shape = FreeCurve(
        "free", port, "pressure", 10.0 * BARS, 120.0 * BARS, 0.0, (0.1, 0.2, 0.3, 0.1, 0.0, 0.1, 0.2)
    )
    values = dict(shape.parameters())
    pressure = ran(machine, case, conditions, values)["pressure_free_pa"]
    told = machine.terms([values], [case], [conditions], [{"pressure": pressure}], "free")
    ((term,),) = told
    assert (term.name, term.over, list(term.added)) == ("the curve", "pressure", [f"free.{port}"])
    expected = shape.at(pressure) - (1.0 if join == "factor" else 0.0)
    # A curve follows its variable by a fraction of a sample late (`FreeCurve.at`).
    np.testing.assert_allclose(term.added[f"free.{port}"][0], expected, atol=0.02 * np.ptp(expected))
    assert machine.terms([values], [case], [conditions], [{"pressure": pressure}], "main") == [[]]


def test_a_cause_and_the_curve_that_joined_it_are_told_together(a_case):
    machine, case, conditions = a_case
    shape = FreeCurve("free", "viscosity", "pressure", 10.0 * BARS, 120.0 * BARS, 0.0, (0.3,) * 7)
    law = {
        "free.viscosity_law.share": 1.0,
        "free.viscosity_law.vogel": 175.0,
        "free.viscosity_law.expansion": 7e-4,
    }
    curve = dict(shape.parameters())

    def terms(values):
        (found,) = machine.terms([values], [case], [conditions], [{}], "free")
        return {
            term.name: term.added["free.viscosity"][0] for term in found if "free.viscosity" in term.added
        }

    (alone,), (bent,) = terms(law).values(), terms(curve).values()
    ((name, together),) = terms(law | curve).items()
    assert name.endswith(", with the curve that joined it")
    np.testing.assert_allclose(1.0 + together, (1.0 + alone) * (1.0 + bent), rtol=1e-6)


def test_of_a_curve_the_shape_is_drawn_and_a_level_that_nobody_knows_widens_no_band():
    time, pressure = np.linspace(0.0, 5.0, 50), np.linspace(0.0, 1.0, 50)
    draws = [
        Term("a curve", {"free.force": [pressure**2 + level]}, "pressure") for level in (3.0, 90.0, -90.0)
    ]
    law = law_of(draws, "free.force", [{"pressure": pressure}], (time,))
    np.testing.assert_allclose(law.added, pressure**2 - np.mean(pressure**2), atol=1e-12)
    np.testing.assert_allclose(law.band, 0.0, atol=1e-12)
