"""What a diagnosis may compute is counted, and a descent that will not come down in time is given up."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np
import pytest

import analytic
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.fitting.levenberg_marquardt import descend
from forklift.fitting.search import too_slow
from forklift.fitting.work import DIRECTION, SAMPLES, SUBSTEPS, Work
from test_problem import problem, somewhere


def test_a_problem_counts_what_it_and_those_made_of_it_simulate():
    unknowns = [analytic.unknown(name) for name in ("p0", "p1")]
    problem = analytic.problem(np.zeros((3, 2)), unknowns, lambda p: p, lambda p: np.eye(2), 0.01)
    problem.run(np.zeros(2))
    coarse = problem.work.done
    finer = problem.weighted(problem.sigma, 2 * problem.substeps)
    finer.run(np.zeros(2), derivatives=True)
    assert coarse == pytest.approx(3 * 2 / SAMPLES * problem.substeps / SUBSTEPS)
    assert problem.work.done == pytest.approx(coarse * (1.0 + 2.0 * (1.0 + 2.0 * DIRECTION)))


def test_work_is_granted_from_here_on():
    work = Work()
    work.add(10 * SAMPLES, 0, SUBSTEPS)
    assert not work.spent
    work.grant(5.0)
    work.add(4 * SAMPLES, 0, SUBSTEPS)
    assert not work.spent
    work.add(SAMPLES, 0, SUBSTEPS)
    assert work.spent


def test_what_is_done_beside_leaves_as_much_as_there_was():
    work = Work()
    work.grant(2.0)
    work.add(SAMPLES, 0, SUBSTEPS)
    with work.beside():
        work.add(10 * SAMPLES, 0, SUBSTEPS)
        assert not work.spent
    assert (work.done, work.spent) == (11.0, False)
    work.add(SAMPLES, 0, SUBSTEPS)
    assert work.spent
    with work.beside():
        assert not work.spent
    assert work.spent


@pytest.mark.parametrize(
    ("costs", "left", "given_up"),
    [
        ([100.0, 99.0], 10, False),  # too early to tell
        ([100.0, 99.0, 98.0, 97.0, 96.0], 10, True),
        ([100.0, 99.0, 98.0, 97.0, 96.0], 100, False),
        ([100.0, 80.0, 60.0, 40.0, 35.0], 10, False),
        ([30.0, 20.0, 10.0, 10.0], 1, False),  # already there
    ],
)
def test_who_goes_too_slowly_for_the_evaluations_left_is_given_up(costs, left, given_up):
    assert too_slow(30.0, costs, left) is given_up


def test_a_descent_ends_where_it_is_hopeless():
    problem = analytic.linear(np.ones(4), np.vstack([np.eye(2)] * 2), "ab", 0.1)
    told: list[float] = []
    end = descend(
        problem, np.zeros(2), 50, 1e-12, lambda cost, x: told.append(cost), hopeless=lambda costs, left: True
    )
    assert len(told) == 1
    assert (end == 0.0).all()


@dataclass(frozen=True, eq=False)
class Ended:
    """A refit as far as a race needs it."""

    costs: tuple[float, float]


@dataclass
class Exhausted:
    """A refitter that may compute nothing more."""

    work: Work = field(default_factory=lambda: Work(1.0, 1.0))


def test_nobody_begins_once_the_work_is_done_and_that_is_kept():
    race = Race(cast(Refitter, Exhausted()), lambda said: None)
    assert race.beside(cast(Refit, None), "leak", []) == []
    assert race.skipped == [("leak",)]


def test_a_trial_must_gain_half_of_what_the_best_did():
    best, good = Ended((10.0, 1000.0)), Ended((10.0, 200.0))
    alone, beside = (Race.bars(cast(Refit, best), cast(list[Refit], some)) for some in ([], [good]))
    assert alone[1] > 1000.0
    assert beside == pytest.approx((alone[0], alone[1] - 400.0))


def test_nothing_is_differentiated_twice_at_one_place():
    unknowns = [analytic.unknown(name) for name in ("p0", "p1")]
    problem = analytic.problem(np.zeros((3, 2)), unknowns, lambda p: p, lambda p: np.eye(2), 0.01)
    machine = cast(analytic.Formula, problem.machine)
    first = problem.run(np.ones(2), derivatives=True)
    assert problem.weighted({analytic.CHANNEL: 1.0}).run(np.ones(2), derivatives=True) is first
    assert machine.runs == [2]
    problem.run(np.zeros(2), derivatives=True)
    problem.weighted(problem.sigma, 9).run(np.zeros(2), derivatives=True)
    assert machine.runs == [2, 2, 2]


def test_all_ports_of_a_recording_are_asked_in_one_run():
    whole, x = problem(), somewhere(0)
    ports = ["free.force", "free.opening", "free.viscosity"]
    before = whole.work.done
    centres = np.arange(0.0, 4.0, 0.2)
    found = whole.respond(x, 0, ports, centres, 0.2)
    samples = len(whole.samples[0].recording)
    cost = samples / SAMPLES * (1.0 + DIRECTION * (24 + 2 * len(ports))) * whole.substeps / SUBSTEPS
    assert found.at("free.opening").shape == (samples, len(whole.machine.outputs), len(centres))
    assert whole.work.done - before == pytest.approx(cost)
