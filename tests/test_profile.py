"""Profile likelihoods: a parabola where the problem is linear, and right where it is not."""

from __future__ import annotations

import numpy as np
import pytest

import analytic
from forklift.fitting.intervals import knowledge
from forklift.fitting.levenberg_marquardt import descend
from forklift.fitting.profile import profile

SIGMA = 0.1


def linear(columns: int = 3) -> tuple[analytic.Analytic, np.ndarray]:
    """With a prior too wide to be seen, and correlated columns."""
    random = np.random.default_rng(5)
    matrix = random.standard_normal((200, columns)) + random.standard_normal((200, 1))
    measured = matrix @ np.full(columns, 0.4) + SIGMA * random.standard_normal(200)
    problem = analytic.linear(measured, matrix, "abc"[:columns], SIGMA, width=50.0)
    return problem, descend(problem, np.zeros(columns), 100, 1e-14, lambda *_: None)


@pytest.mark.parametrize("k", [0, 1, 2])
def test_the_profile_of_a_linear_problem_is_the_parabola_and_its_interval_the_normal_one(k):
    problem, x = linear()
    estimate = knowledge(problem, x).estimates[k]
    found = profile(problem, x, k, estimate.deviation)
    off = np.array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
    assert found.values == pytest.approx(estimate.value + off * estimate.deviation * 50.0)
    # Samples further off than four deviations count by their distance: that bends it a little.
    assert found.rise == pytest.approx(off**2, rel=1e-2, abs=1e-3)
    assert (found.lower, found.upper) == pytest.approx((estimate.lower, estimate.upper), rel=1e-3)


def test_a_curved_problem_has_the_interval_of_its_likelihood():
    """y = e^p: the interval of e^p is y ± 1.96 σ, and that of p is not symmetric."""
    sigma, measured = 0.25, 1.0
    problem = analytic.problem(
        np.array([measured]), [analytic.unknown("p", 1e3)], np.exp, lambda p: np.exp(p)[:, None], sigma
    )
    x = descend(problem, np.zeros(1), 100, 1e-14, lambda *_: None)
    estimate = knowledge(problem, x).estimates[0]
    found = profile(problem, x, 0, estimate.deviation)
    exact = np.log(measured + 1.959963984540054 * sigma * np.array([-1.0, 1.0]))
    assert (found.lower, found.upper) == pytest.approx(exact, abs=0.02)
    assert abs(estimate.lower - exact[0]) > 0.1


def test_a_profile_ends_at_a_bound_and_says_that_it_does_not_cross():
    problem, x = linear(1)
    deviation = knowledge(problem, x).estimates[0].deviation
    bound = (x[0] + 1.5 * deviation) * 50.0
    problem.unknowns = (analytic.Unknown(("a",), "1", "linear", (0.0,), 50.0, -np.inf, bound / 50.0),)
    found = profile(problem, x, 0, deviation)
    assert found.values.max() <= bound
    assert np.isnan(found.upper)
    assert np.isfinite(found.lower)
