"""Slopes are those of half as many substeps, values those of all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign, Truck
from forklift.fitting.posing import pose
from forklift.fitting.problem import Last
from forklift.plant.forklift.model import SLOPES_AT, Forklift
from forklift.plant.forklift.unknowns import unknowns

NULL = Path(__file__).parent / "campaigns" / "null"
USUAL, FINEST = 8, 32


@pytest.fixture(scope="module")
def run():
    truck = Truck.read("thesis")
    model = Forklift(truck, lifts=("free",))
    problem = pose(model, Campaign.read(NULL).recordings[:3], unknowns(truck, ("free",)), {})
    x = np.zeros(problem.starts[-1])

    def run(substeps, slopes):
        """With nothing kept of the run before."""
        return replace(problem, substeps=substeps, last=Last()).run(x, derivatives=slopes)

    return run


@pytest.mark.parametrize("substeps", [SLOPES_AT, USUAL, FINEST])
def test_values_keep_their_bits_whether_or_not_slopes_are_asked_for(run, substeps):
    for with_slopes, without in zip(run(substeps, True), run(substeps, False), strict=True):
        assert (with_slopes.outputs == without.outputs).all()


def test_a_search_loses_nothing_by_the_slopes_of_fewer_substeps(run):
    """Of each output along each unknown that moves it, over the time of a recording: half of them are off by
    less than half a per cent, nineteen in twenty by less than five."""
    usual, finest = ([one.slopes for one in run(substeps, True)] for substeps in (USUAL, 2 * FINEST))
    for slopes, exact in zip(usual, finest, strict=True):
        size = np.sqrt(np.mean(exact**2, axis=0))
        told = size > 0.0
        off = np.sqrt(np.mean((slopes - exact) ** 2, axis=0))
        assert (np.quantile(off[told] / size[told], [0.5, 0.95]) < [0.005, 0.05]).all()


def test_fewer_substeps_have_slopes_of_their_own(run):
    """Up to `SLOPES_AT` nothing is spared: slopes are those of the values, exactly."""
    few, fewer = run(SLOPES_AT, True), run(SLOPES_AT // 2, True)
    assert any((one.slopes != other.slopes).any() for one, other in zip(few, fewer, strict=True))
