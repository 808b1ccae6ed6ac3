"""What a fit may move: scales, bounds and names, over the whole ranges of the parameter table."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from forklift import ForkliftError, Truck
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.unknowns import ESTIMATED, LEAST_ANGLE, move, unknowns
from forklift.plant.parameter import SCALES, Unknown
from forklift.recordings.channels import LIFTS
from small_campaign import raised

THESIS = Truck.read("thesis")
MOVED = unknowns(THESIS, LIFTS)
KNOTS = [found for found in MOVED if "table" in found.name]
SCALARS = [
    name for name in THESIS.values if parameters()[name]["origin"] in ESTIMATED and "table" not in name
]
RANGES = {
    "linear": st.floats(-1e6, 1e6),
    "log": st.floats(1e-12, 1e12),
    "loglog": st.floats(1.01, 1e12),
    "logcos": st.floats(LEAST_ANGLE, 1.57),
}
"""Where each scale is used, and beyond."""

scaled = st.sampled_from(sorted(RANGES)).flatmap(lambda scale: st.tuples(st.just(scale), RANGES[scale]))


@st.composite
def within(draw: st.DrawFn, name: str) -> float:
    """A value between the parameter's bounds, small ones as likely as large ones."""
    spec = parameters()[name]
    lower, upper = spec["lower"], spec["upper"]
    if draw(st.booleans()):
        return draw(st.floats(lower, upper))
    return min(max(upper * math.exp(-20.0 * draw(st.floats(0.0, 1.0))), lower), upper)


starts = st.sampled_from(SCALARS).flatmap(lambda name: st.tuples(st.just(name), within(name)))
thetas = st.floats(-4.0, 4.0)
timeless = settings(deadline=None)


def unknown(name: str, truck: Truck = THESIS) -> Unknown:
    return next(found for found in unknowns(truck, LIFTS) if found.name == name)


def inside(found: Unknown, theta: float) -> float:
    return float(np.clip(theta, found.lower, found.upper))


@timeless
@given(scaled)
def test_a_scale_forth_and_back_is_the_value(drawn):
    scale, value = drawn
    forth, back, _ = SCALES[scale]
    # Near 0 an angle's cosine is 1 − x²/2 and rounded at 2e-16.
    tolerance = 1e-9 if scale == "logcos" else 1e-12
    assert back(np.array([forth(value)])) == pytest.approx(value, rel=tolerance, abs=1e-300)


@timeless
@given(scaled)
def test_the_slope_of_a_scale_is_its_difference_quotient(drawn):
    scale, value = drawn
    forth, back, slope = SCALES[scale]
    at = forth(value)
    step = {"logcos": min(1e-6, -1e-2 * at), "linear": 1.0}.get(scale, 1e-5)
    ends = back(np.array([at - step, at + step]))
    assert (ends[1] - ends[0]) / (2.0 * step) == pytest.approx(slope(np.array([value]))[0], rel=1e-3)


@timeless
@given(starts)
def test_a_search_begins_at_the_trucks_own_values_and_within_the_bounds(drawn):
    name, value = drawn
    found = unknown(name, THESIS.with_values({name: value}))
    assert found.lower <= 0.0 <= found.upper
    # An angle too small or too large for its cosine is moved to where the cosine tells it.
    angle = found.scale == "logcos"
    assert found.values(0.0)[0] == pytest.approx(value, rel=1e-9, abs=1.02 * LEAST_ANGLE * angle)


@timeless
@given(starts, thetas)
def test_values_stay_between_the_tables_bounds_wherever_the_search_may_go(drawn, theta):
    name, value = drawn
    found = unknown(name, THESIS.with_values({name: value}))
    spec = parameters()[name]
    for at in (found.lower, found.upper, inside(found, theta)):
        if np.isfinite(at):  # a truck takes it, to the last bit
            assert spec["lower"] <= found.values(at)[0] <= spec["upper"]


@timeless
@given(st.sampled_from(MOVED), thetas)
def test_the_slope_of_an_unknown_is_its_difference_quotient(found, theta):
    theta = inside(found, theta)
    assume(found.lower + 1e-4 < theta < found.upper - 1e-4)
    step = 1e-5
    quotient = (found.values(theta + step) - found.values(theta - step)) / (2.0 * step)
    assert quotient == pytest.approx(found.slopes(theta), rel=1e-4)


@timeless
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_a_moved_truck_has_tables_that_rise_or_there_is_none(seed, size):
    random = np.random.default_rng(seed)
    theta = np.array([inside(found, size * random.standard_normal()) for found in KNOTS])
    asked = {
        name: value
        for found, at in zip(KNOTS, theta, strict=True)
        for name, value in zip(found.names, found.values(at), strict=True)
    }
    try:
        truck = move(THESIS, KNOTS, theta, "moved")
    except ForkliftError as error:
        if error.code != "table-not-rising":
            raise
        return
    got = dict(zip(truck.core.names, truck.core.values, strict=True))
    assert all(got[name] == pytest.approx(value, rel=1e-12) for name, value in asked.items())
    assert all(
        got[name] == value
        for name, value in zip(THESIS.core.names, THESIS.core.values, strict=True)
        if name not in asked
    )
    for lift in LIFTS:
        assert (np.diff(truck.values[f"{lift}.valve.table_current"]) > 0.0).all()
        assert (np.diff(truck.values[f"{lift}.valve.table_area"]) >= 0.0).all()


def test_knots_that_cross_are_refused():
    crossed = np.array([8.0 * (found.name == "free.valve.table_current.1") for found in KNOTS])
    error = raised(move, THESIS, KNOTS, crossed, "moved")
    assert error.code == "table-not-rising"
    assert "free.valve.table_current must rise" in error.message


def test_what_the_thesis_estimated_is_moved_and_nothing_else():
    names = {found.name for found in unknowns(THESIS, ["free"])}
    assert {name for name in names if "table" not in name} == {
        name for name in SCALARS if name.startswith("free.")
    }
    areas, currents = (THESIS.values[f"free.valve.table_{what}"] for what in ("area", "current"))
    assert {name for name in names if "area" in name} == {
        f"free.valve.table_area.{k}" for k, area in enumerate(areas) if area > 0.0
    }
    assert {name for name in names if "current" in name} == {
        f"free.valve.table_current.{k}" for k in range(1, len(currents) - 1)
    }


def test_what_is_held_is_not_moved():
    held = ["free.bulk.a_1", "free.valve.table_area", "free.valve.table_current.3"]
    left = {found.name for found in unknowns(THESIS, ["free"], hold=held)}
    gone = {found.name for found in unknowns(THESIS, ["free"])} - left
    assert gone == {
        "free.bulk.a_1",
        "free.valve.table_current.3",
        *(f"free.valve.table_area.{k}" for k in range(2, 8)),
    }


def test_what_is_asked_for_is_moved_besides():
    before = unknowns(THESIS, ["free"])
    after = unknowns(THESIS, ["free"], also=["free.compensator.p_set"])
    assert {found.name for found in after} - {found.name for found in before} == {"free.compensator.p_set"}


def test_a_group_moves_by_one_factor():
    group = ["free.viscosity.nu_0", "main.viscosity.nu_0"]
    found = next(one for one in unknowns(THESIS, LIFTS, together=[group]) if len(one.names) > 1)
    assert found.names == tuple(group)
    assert found.values(0.0) == pytest.approx([THESIS.values[name] for name in group])
    factors = found.values(1.3) / found.values(0.0)
    assert factors[0] == pytest.approx(factors[1], rel=1e-12)
    assert factors[0] > 1.1


@pytest.mark.parametrize(("end", "narrow"), [("lower", 1.1e-6), ("upper", 1.9e-3)])
def test_the_bounds_of_a_group_are_those_of_its_narrowest(end, narrow):
    group = ["free.viscosity.nu_0", "main.viscosity.nu_0"]
    truck = THESIS.with_values({group[1]: narrow})
    found = next(one for one in unknowns(truck, LIFTS, together=[group]) if len(one.names) > 1)
    spec = parameters()[group[0]]
    values = found.values(getattr(found, end))
    assert values[1] == pytest.approx(spec[end])
    assert spec["lower"] < values[0] < spec["upper"]


def test_a_group_of_unlike_scales_is_refused():
    group = ["free.viscosity.nu_0", "free.viscosity.lambda"]
    scales = {unknown(name).scale for name in group} | {unknown("free.compensator.theta").scale}
    assert len(scales) > 1
    error = raised(unknowns, THESIS, ["free"], together=[["free.viscosity.nu_0", "free.compensator.theta"]])
    assert error.code == "argument-invalid"
    assert "scales differ" in error.message


@pytest.mark.parametrize("how", ["hold", "also", "together"])
def test_an_unknown_name_is_refused(how):
    names = ["free.bulk.a_9"]
    error = raised(unknowns, THESIS, LIFTS, **{how: [names] if how == "together" else names})
    assert error.code == "parameter-unknown"
    assert error.facts["name"] == "free.bulk.a_9"


def test_an_effect_of_the_truck_is_estimated_with_it():
    names = {found.name for found in unknowns(THESIS, LIFTS)}
    truck = THESIS.with_values({"free.leakage.coefficient": 1e-13})
    assert {found.name for found in unknowns(truck, LIFTS)} - names == {"free.leakage.coefficient"}
