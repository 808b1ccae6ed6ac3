"""A parameter from two regimes: the same on a truck that is one, and not on one that is two."""

import json
from dataclasses import replace

import numpy as np
import pytest

from forklift import Truck, commands, simulate
from forklift.app.demo import measured
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.regimes import AGREE, Split, regimes
from forklift.fitting.intervals import knowledge
from forklift.fitting.posing import pose
from forklift.fitting.residuals import judge
from forklift.fitting.search import STAGES, search
from forklift.plant.forklift.model import Forklift
from forklift.plant.forklift.sensors import sensors
from forklift.plant.forklift.splits import splits
from forklift.plant.forklift.unknowns import unknowns
from forklift.recordings.recording import Recording

PLAN = tuple((load, degc) for load in (0.0, 1500.0) for degc in (20.0, 60.0))
VOLUME = "free.cylinder.V_0"


def fitted(warmer):
    """A refit on recordings of the thesis's truck, whose values are `warmer` where the oil is warm."""
    thesis = Truck.read("thesis")
    recordings = []
    for stream, (load, degc) in enumerate(PLAN):
        truck = thesis.with_values(warmer) if degc > 40.0 else thesis
        command = commands.generate("prms", "free", duration_s=8.0, seed=stream + 1)
        run = simulate(truck, command, load_kg=load, oil_temperature_degc=degc)
        columns = measured(run, 1, stream).to_dict(as_series=False)
        at = np.array(columns.pop("time_s"))
        recordings.append(Recording(f"{load:g}_{degc:g}.csv", "free", load, "estimate", at, columns))
    every = sensors(recordings)
    # The oil is known not to warm: asked is whether regimes agree, not what could make up for it.
    machine = Forklift(thesis, ("free",), warming_width_k=0.0)
    problem = pose(machine, recordings, unknowns(thesis, ["free"]), every)
    found = search(problem, np.zeros(problem.starts[-1]), every, STAGES[2:3])
    known = knowledge(found.problem, found.x)
    theta = found.x[: len(problem.unknowns)]
    seen = tuple(judge(found.problem, theta, known.covariance, every))
    return Refit((), found, known, seen, (0.0, 0.0), True, found)


@pytest.fixture(scope="module")
def one():
    return fitted({})


@pytest.fixture(scope="module")
def two():
    return fitted({VOLUME: 1.1 * Truck.read("thesis").values[VOLUME]})


def parted(refit):
    return splits([seen.recording for seen in refit.found.problem.samples], refit.found.problem.machine.truck)


def test_a_truck_that_is_one_agrees_with_itself(one):
    for parameter in (VOLUME, "free.friction.sigma_2", "free.valve.omega"):
        rows = regimes(one, parameter, parted(one))
        assert [row.split for row in rows] == ["load", "oil temperature", "motion"]
        for row in rows:
            assert row.agree is not False, row.sentence
            assert row.first.lower <= row.first.value <= row.first.upper
        json.dumps([row.to_dict() for row in rows])


def test_a_parameter_that_differs_between_cold_and_warm_is_caught_where_it_differs(two):
    rows = {row.split: row for row in regimes(two, VOLUME, parted(two))}
    warm = rows["oil temperature"]
    assert warm.agree is False
    assert warm.z < -AGREE
    assert warm.second.value / warm.first.value == pytest.approx(1.1, abs=0.03)
    assert "disagrees across the oil temperature" in warm.sentence
    assert abs(rows["motion"].z) < abs(warm.z)


def test_swapped_regimes_swap_sides(one):
    split = parted(one)[0]
    other = Split(split.name, split.second, split.first, tuple(~rows for rows in split.rows))
    there, back = (regimes(one, VOLUME, [given])[0] for given in (split, other))
    assert back.z == pytest.approx(-there.z, abs=0.02)
    assert back.first.value == pytest.approx(there.second.value, rel=1e-3)


def test_what_a_regime_cannot_tell_is_no_disagreement(one):
    split = parted(one)[0]
    few = tuple(
        np.arange(len(rows)) < (5 if k == 0 else 0) for k, rows in enumerate(split.rows)
    )  # a tenth of a second
    row = regimes(one, VOLUME, [replace(split, rows=few)])[0]
    assert row.agree is None
    assert "do not tell it" in row.sentence


def test_a_split_with_nothing_on_one_side_is_left_out(one):
    split = parted(one)[0]
    everything = tuple(np.ones_like(rows) for rows in split.rows)
    assert regimes(one, VOLUME, [replace(split, rows=everything)]) == ()
    with pytest.raises(ValueError, match="no unknown"):
        regimes(one, "free.nothing", [split])


def test_recordings_without_a_temperature_are_split_by_the_rest(one):
    bare = []
    for seen in one.found.problem.samples:
        channels = {
            name: values for name, values in seen.recording.channels.items() if name != "oil_temperature_degc"
        }
        bare.append(replace(seen.recording, channels=channels, sha256=""))
    assert [split.name for split in splits(bare, one.found.problem.machine.truck)] == ["load", "motion"]
