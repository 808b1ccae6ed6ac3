"""Curves over what was a while ago: what they are over, and which are worth a simulation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forklift.diagnosis.criteria import MOST_PAST
from forklift.diagnosis.curves import variables
from forklift.diagnosis.foreseen import foreseen
from forklift.diagnosis.locate import hats
from forklift.diagnosis.screening import screen
from forklift.plant.forklift.variables import LAGS_S, PAST, lagging
from test_problem import problem, somewhere

TICK = 0.02
TIME = TICK * np.arange(500)


@given(st.sampled_from(LAGS_S), st.integers(1, 200))
def test_after_a_step_the_past_follows_and_the_change_is_forgotten(lag, moved):
    values = np.where(np.arange(len(TIME)) >= moved, 3.0, 1.0)
    named = [one for one in PAST.values() if one.variable == "command" and one.lag_s == lag]
    seen = {one.fades: one.of(values, lagging(TIME, values, lag)) for one in named}
    np.testing.assert_allclose(seen[True] + seen[False], values)
    assert np.all(seen[True][:moved] == 0.0)
    # A step is a straight line from one sample to the next.
    kept = np.exp(-TICK / lag)
    first = 2.0 * lag * (1.0 - kept) / TICK
    np.testing.assert_allclose(seen[True][moved:], first * kept ** np.arange(len(TIME) - moved))


@pytest.mark.parametrize(
    "time",
    [
        np.unique(np.r_[TIME, 0.013 + 0.1 * np.arange(90), 0.007 + 0.05 * np.arange(190)]),
        np.r_[TIME[:100], 4.0 + TIME[:100]],
    ],
    ids=["three clocks", "a gap"],
)
@pytest.mark.parametrize("lag", LAGS_S)
def test_the_past_of_an_uneven_clock_is_that_of_its_steps(time, lag):
    values = np.interp(time, [0.5, 1.5, 6.0], [0.0, 1.0, -2.0])
    behind = 0.0
    for k, found in enumerate(lagging(time, values, lag)[1:], 1):
        tick = time[k] - time[k - 1]
        kept = np.exp(-tick / lag)
        behind = behind * kept + (values[k] - values[k - 1]) / tick * lag * (1.0 - kept)
        assert found == pytest.approx(behind, abs=1e-12)


@pytest.mark.parametrize(
    "port", ["force", "dry_friction", "cylinder_flow", "opening", "current", "viscosity"]
)
def test_what_promises_most_is_among_what_hats_foresee_most_of(port):
    at, x = problem(), somewhere(0)
    machine = at.machine
    place = next(one for one in machine.places if one.name == f"free.{port}")
    width_s = machine.hat_width_s(at.samples)
    seen = variables(at, x, "free", [hats(sample, width_s) for sample in at.samples])
    past = [{name: values for name, values in one.items() if name in PAST} for one in seen]
    promised = foreseen(at, x, {place.name: past}, {place.name: place.size}, width_s)
    moments = at.moments(x, "free")
    ends = {name: (min(m[name].min() for m in moments), max(m[name].max() for m in moments)) for name in PAST}
    curves = {name: machine.curves(place, name, *ends[name])[0] for name in PAST}
    simulated = {one.hypotheses[0]: one.evidence for one in screen(at, x, list(curves.values()), 0).ranked}
    names = [name for name in PAST if curves[name] in simulated]
    assert len(names) > 25
    foreseen_first = sorted(names, key=lambda name: -promised[place.name, name])[:MOST_PAST]
    most = max(simulated[curves[name]] for name in names)
    assert max(simulated[curves[name]] for name in foreseen_first) >= 0.99 * most
