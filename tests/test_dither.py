"""A dither that no recording shows is an unknown of the whole campaign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign, Truck
from forklift.fitting.posing import pose
from forklift.plant.forklift.dither import DITHER, dither, dithered, without_dither
from forklift.plant.forklift.model import Forklift
from forklift.plant.forklift.unknowns import unknown

NULL = Path(__file__).parent / "campaigns" / "null"


@pytest.fixture(scope="module")
def posed():
    truck = Truck.read("thesis")
    model = Forklift(truck, lifts=("free",))
    recordings = Campaign.read(NULL).recordings[:2]
    unknowns = (unknown(truck, "free.valve.f_hs"), dither())
    problem = pose(model, recordings, unknowns, {})
    return problem, np.zeros(problem.starts[-1])


def test_only_an_open_valve_is_shaken_and_the_faster_the_more():
    command = np.array([[0.0, 0.4], [0.0, 0.4], [0.5, 0.0]])
    shaken = dithered(command, 0.002, 0.02)
    assert np.abs(shaken - command).max(axis=0) == pytest.approx([0.002, 0.002])
    assert not shaken[command == 0.0].any()
    assert np.allclose(dithered(command, 0.002, 0.005) - command, 4.0 * (shaken - command))
    assert dithered(command, 0.0, 0.02) is command


def test_it_lessens_what_the_hysteresis_holds_back_and_a_fit_can_follow_it(posed):
    problem, x = posed
    place = [one.name for one in problem.unknowns].index(DITHER)
    runs = problem.run(x, derivatives=True)
    more = x.copy()
    more[place] += 0.01
    for run, then in zip(runs, problem.run(more), strict=True):
        slope = run.slopes[:, :, place] * problem.unknowns[place].slopes(0.0)[0]
        moved = (then.outputs - run.outputs) / 0.01
        assert np.abs(moved).max() > 0.0
        assert np.allclose(moved, slope, atol=0.05 * np.abs(moved).max())


def test_the_truck_has_no_dither_of_its_own(posed):
    problem, x = posed
    values = problem.values(x)
    assert DITHER in values
    assert DITHER not in without_dither(values)
    assert problem.machine.at(values).values == problem.machine.at(without_dither(values)).values
