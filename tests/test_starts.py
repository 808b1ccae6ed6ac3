"""Several starts: whether all end in the same place is recognised, and said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import analytic
from forklift import ForkliftError
from forklift.fitting.levenberg_marquardt import descend
from forklift.fitting.search import Found
from forklift.fitting.starts import SCATTER, End, compare_ends, from_starts, scattered

SIGMA = 0.05


def square(weight: float = 0.0) -> analytic.Analytic:
    """p² is measured, so that p and −p explain it alike; `weight` p besides tells which it is."""
    rows = np.array([1.0, weight])
    return analytic.problem(
        np.tile(rows, 20),
        [analytic.unknown("p")],
        lambda p: np.tile([p[0] ** 2, weight * p[0]], 20),
        lambda p: np.tile([2.0 * p[0], weight], 20)[:, None],
        SIGMA,
    )


def found(problem: analytic.Analytic, start: float) -> Found:
    x = descend(problem, np.array([start]), 100, 1e-12, lambda *_: None)
    residual, jacobian = problem.compressed(x)
    return Found(x, problem, 0.5 * float(residual @ residual), residual, jacobian, 1)


def test_ends_in_one_place_are_the_same():
    ends = [found(square(), start) for start in (0.3, 1.0, 2.5)]
    compared = compare_ends(ends, ends)
    assert sum(end.same for end in compared.ends) == 3
    assert [end.start for end in compared.ends] == [0, 1, 2]


def test_an_equally_good_end_elsewhere_is_not_the_same():
    problem = square()
    ends = [found(problem, start) for start in (0.5, -0.5)]
    compared = compare_ends(ends, ends)
    other = next(end for end in compared.ends if not end.same)
    assert sum(end.same for end in compared.ends) == 1
    assert other.cost == pytest.approx(0.0, abs=1e-6)
    deviation = 1.0 / np.sqrt(20 * (2.0 * ends[0].x[0]) ** 2 / SIGMA**2 + 1.25)
    assert other.distance == pytest.approx(2.0 * abs(ends[0].x[0]) / deviation, rel=0.02)


def test_an_end_nearby_that_is_far_less_likely_is_not_the_same():
    """A little off in many unknowns, each by less than a deviation."""
    problem = analytic.linear(np.zeros(8), np.eye(8), "abcdefgh", SIGMA)
    ends = []
    for off in (0.0, 0.9):
        x = np.full(8, off * SIGMA)
        residual, jacobian = problem.compressed(x)
        ends.append(Found(x, problem, 0.5 * float(residual @ residual), residual, jacobian, 1))
    other = compare_ends(ends, ends).ends[1]
    assert other.distance < 1.0
    assert other.cost == pytest.approx(8 * 0.5 * 0.9**2, rel=0.01)
    assert not other.same


def test_a_worse_end_is_left_out_and_its_cost_told():
    ends = [found(square(0.05), start) for start in (-0.5, 0.5)]
    compared = compare_ends(ends, ends)
    assert compared.best is ends[1]
    assert compared.ends[0].cost == pytest.approx(ends[0].cost - ends[1].cost, rel=1e-9)
    assert compared.ends[0].cost > 2.0
    assert [end.same for end in compared.ends] == [False, True]


def test_ends_searched_with_other_weights_are_compared_with_the_sharpest():
    """A search gone astray weighs its channels less, and seems to cost less."""
    astray = found(replace(square(), sigma={analytic.CHANNEL: 100.0 * SIGMA}), 0.0)
    good = found(square(), 0.5)
    assert astray.cost < good.cost + 20.0
    compared = compare_ends([astray, good], [astray, good])
    assert compared.best is good
    assert compared.ends[0].cost > 100.0


def test_a_start_that_fails_is_counted_and_its_fellows_are_not():
    good = found(square(), 0.5)
    compared = compare_ends([good], [good, None])
    assert [end.same for end in compared.ends] == [True, False]
    assert compared.ends[1].cost == compared.ends[1].distance == float("inf")


def test_scattered_starts_are_drawn_as_told_and_within_bounds():
    unknowns = [analytic.unknown(str(k), bound=0.5) for k in range(400)]
    problem = analytic.problem(np.zeros(1), unknowns, lambda p: p[:1], lambda p: np.eye(400)[:1], 1.0)
    assert not scattered(problem, 0, 1).any()
    drawn = [scattered(problem, start, 1) for start in (1, 2)]
    assert not np.array_equal(*drawn)
    assert np.array_equal(drawn[0], scattered(problem, 1, 1))
    assert np.abs(drawn[0]).max() <= 0.45
    assert np.median(np.abs(drawn[0])) == pytest.approx(0.6745 * SCATTER, rel=0.15)


def test_searches_from_scattered_starts_find_both_places_and_recognise_the_other():
    problem = square()
    ends = from_starts(problem, analytic.sensors(problem), 12, 1)
    places = [end.distance < 1.0 for end in ends.ends]
    assert 0 < sum(places) < 12
    assert [end.same for end in ends.ends] == places


def test_if_every_start_fails_the_first_error_is_raised():
    def fails(p: np.ndarray) -> np.ndarray:
        raise ForkliftError("not-finite", "no run succeeds")

    problem = analytic.problem(np.zeros(1), [analytic.unknown("p")], fails, lambda p: np.eye(1), 1.0)
    with pytest.raises(ForkliftError, match="no run succeeds"):
        from_starts(problem, analytic.sensors(problem), 3, 1)


def test_the_verdict_says_which_start_ended_elsewhere_and_which_failed(null_fit):
    inf = float("inf")
    ends = (
        End(0, 0.0, 0.0, True),
        End(1, 0.3, 0.1, True),
        End(2, 12.5, 7.25, False),
        End(3, inf, inf, False),
    )
    said = " ".join(replace(null_fit, ends=ends).sentences)
    assert "2 of 4 starts ended in the same place." in said
    assert "Start 3 ended elsewhere: its likelihood is lower by a factor of e^12.5" in said
    assert "7.25 standard deviations away; it is left out." in said
    assert "Start 4 failed on the way; it is left out." in said
    assert "starts ended" not in " ".join(replace(null_fit, ends=ends[:1]).sentences)
