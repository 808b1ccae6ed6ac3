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
def problem():
    truck = Truck.read("thesis")
    model = Forklift(truck, lifts=("free",))
    return pose(model, Campaign.read(NULL).recordings[:3], unknowns(truck, ("free",)), {})


@pytest.fixture(scope="module")
def run(problem):
    x = np.zeros(problem.starts[-1])

    def run(substeps, slopes):
        """With nothing kept of the run before."""
        machine = replace(problem.machine)
        return replace(problem, machine=machine, substeps=substeps, last=Last()).run(x, derivatives=slopes)

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


def test_a_run_without_slopes_is_not_run_again_for_them_but_any_other_is(problem):
    x, machine = np.zeros(problem.starts[-1]), replace(problem.machine)
    usual = replace(problem, machine=machine, substeps=USUAL, last=Last())
    values = usual.run(x)
    assert all(a.outputs is b.outputs for a, b in zip(values, usual.run(x, derivatives=True), strict=True))
    elsewhere, otherwise = x.copy(), x.copy()
    elsewhere[0], otherwise[-1] = 0.1, 0.1  # a parameter; how the last recording starts
    lighter = replace(machine, truck=machine.truck.with_values({"free.gravity.g": 9.7}))
    others = [
        usual.run(elsewhere),
        usual.run(otherwise),
        replace(usual, substeps=2 * USUAL).run(x),
        replace(usual, machine=lighter).run(x),
    ]
    for other in others:
        assert not np.array_equal(other[-1].outputs, values[-1].outputs)
    fewer = replace(usual, samples=usual.samples[1:]).run(x)
    assert [len(one.outputs) for one in fewer] == [len(one.outputs) for one in values[1:]]
