"""What a fit knows: on problems whose covariance can be written down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

import analytic
from forklift.fitting.intervals import QUANTILE, knowledge, widening
from forklift.fitting.levenberg_marquardt import descend
from forklift.fitting.residuals import LAGS, ljung_box

SIGMA = 0.1
PRIOR = 1.25
"""Curvature of the prior, Student's with four degrees of freedom, at its middle."""


def optimum(problem: analytic.Analytic) -> np.ndarray:
    return descend(problem, np.zeros(len(problem.unknowns)), 100, 1e-12, lambda *_: None)


def design(n: int = 200, columns: int = 3, seed: int = 5) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((n, columns))


def test_a_linear_problem_with_gaussian_noise_has_exactly_its_covariance():
    matrix, width = design(), 0.7
    problem = analytic.linear(np.zeros(200), matrix, "abc", SIGMA, width)
    known = knowledge(problem, np.zeros(3))
    exact = np.linalg.inv(width**2 * matrix.T @ matrix / SIGMA**2 + PRIOR * np.eye(3))
    assert known.covariance == pytest.approx(exact, rel=1e-10)
    deviation = width * np.sqrt(np.diag(exact))
    for estimate, sd in zip(known.estimates, deviation, strict=True):
        assert (estimate.lower, estimate.value, estimate.upper) == pytest.approx(
            (-QUANTILE * sd, 0.0, QUANTILE * sd), rel=1e-10, abs=1e-15
        )
    assert known.correlation == pytest.approx(exact / np.outer(deviation, deviation) * width**2)
    assert not known.groups
    assert not known.unidentifiable


def test_the_deviation_alone_is_the_one_if_all_others_were_known():
    matrix = design()
    matrix[:, 1] = matrix[:, 0] + 0.2 * matrix[:, 1]
    known = knowledge(analytic.linear(np.zeros(200), matrix, "abc", SIGMA), np.zeros(3))
    for k, estimate in enumerate(known.estimates):
        assert estimate.alone == pytest.approx((matrix[:, k] @ matrix[:, k] / SIGMA**2 + PRIOR) ** -0.5)
    assert known.estimates[0].deviation > 3.0 * known.estimates[0].alone


def test_ninety_five_of_a_hundred_intervals_hold_the_truth():
    random = np.random.default_rng(11)
    matrix, truth = design(60), np.array([0.5, -0.3, 0.1])
    covered = 0
    for _ in range(300):
        measured = matrix @ truth + SIGMA * random.standard_normal(60)
        problem = analytic.linear(measured, matrix, "abc", SIGMA, width=10.0)
        known = knowledge(problem, optimum(problem))
        covered += sum(
            one.lower <= true <= one.upper for one, true in zip(known.estimates, truth, strict=True)
        )
    assert binomtest(covered, 900, 0.95).pvalue > 0.01


def test_two_parameters_that_enter_only_as_a_product_are_known_only_together():
    """ln a + ln b: moving the one up and the other down changes nothing."""
    slope = np.linspace(0.5, 1.5, 200)
    matrix = np.column_stack([slope, slope, np.ones(200)])
    problem = analytic.linear(np.zeros(200), matrix, ["ln a", "ln b", "c"], SIGMA)
    known = knowledge(problem, np.zeros(3))
    assert [set(group.names) for group in known.groups] == [{"ln a", "ln b"}]
    assert known.groups[0].by[0] == pytest.approx(-known.groups[0].by[1], rel=1e-2)
    assert abs(known.groups[0].by[0]) > 0.01
    assert known.estimates[2].identifiable
    assert not known.estimates[0].identifiable
    assert not known.unidentifiable


def test_what_changes_nothing_is_untold_and_in_no_group():
    matrix = np.column_stack([np.ones(200), np.zeros(200)])
    known = knowledge(analytic.linear(np.zeros(200), matrix, ["told", "never"], SIGMA), np.zeros(2))
    assert known.unidentifiable == ("never",)
    assert not known.groups
    assert known.estimates[1].deviation == pytest.approx(PRIOR**-0.5)


def test_an_interval_ends_at_the_parameters_bound():
    problem = analytic.linear(np.zeros(20), np.full((20, 1), 0.01), ["a"], SIGMA)
    bounded = replace(problem, unknowns=(analytic.unknown("a", bound=0.5),))
    estimate = knowledge(bounded, np.zeros(1)).estimates[0]
    assert (estimate.lower, estimate.upper) == (-0.5, 0.5)


def autoregressive(random: np.random.Generator, n: int, phi: float) -> np.ndarray:
    """Stationary with unit variance."""
    out, last = np.empty(n), random.standard_normal()
    shocks = np.sqrt(1.0 - phi**2) * random.standard_normal(n)
    for k in range(n):
        out[k] = last = phi * last + shocks[k]
    return out


@pytest.mark.parametrize("phi", [0.3, 0.6, 0.8])
def test_coloured_residuals_widen_by_the_root_of_their_autocorrelation_time(phi):
    random = np.random.default_rng(8)
    rows = np.array([SIGMA * autoregressive(random, 2000, phi) for _ in range(20)])
    matrix = np.ones((2000, 1))
    problem = analytic.linear(rows, matrix, ["mean"], SIGMA)
    wide = widening(problem, np.zeros(1))[analytic.CHANNEL]
    exact = np.sqrt(1.0 + 2.0 * sum(phi**k for k in range(1, LAGS + 1)))
    assert wide == pytest.approx(exact, rel=0.05)
    told = knowledge(problem, np.zeros(1)).estimates[0].deviation
    assert told == pytest.approx((20 * 2000 / (wide * SIGMA) ** 2 + PRIOR) ** -0.5, rel=1e-9)


def test_the_mean_of_coloured_residuals_is_as_uncertain_as_its_interval_says():
    random = np.random.default_rng(9)
    phi, n = 0.6, 2000
    z = []
    for _ in range(200):
        measured = SIGMA * autoregressive(random, n, phi)
        problem = analytic.linear(measured, np.ones((n, 1)), ["mean"], SIGMA, width=10.0)
        estimate = knowledge(problem, optimum(problem)).estimates[0]
        z.append(estimate.value / ((estimate.upper - estimate.lower) / (2.0 * QUANTILE)))
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.15)


def test_white_residuals_are_hardly_ever_widened():
    random = np.random.default_rng(10)
    wide = [
        widening(
            analytic.linear(SIGMA * random.standard_normal((8, 500)), np.ones((500, 1)), ["mean"], SIGMA),
            np.zeros(1),
        )[analytic.CHANNEL]
        for _ in range(100)
    ]
    assert sum(factor > 1.0 for factor in wide) <= 5


def test_the_whiteness_of_white_noise_is_uniform_and_of_a_little_colour_nought():
    random = np.random.default_rng(12)
    p = np.sort([ljung_box(random.standard_normal(600)) for _ in range(500)])
    assert np.abs(p - (np.arange(500) + 0.5) / 500).max() < 1.63 / np.sqrt(500)  # Kolmogorov, 1 %
    assert ljung_box(autoregressive(random, 600, 0.3)) < 1e-3


def test_the_slow_noise_of_a_sensor_is_no_colour_and_what_rings_is():
    random = np.random.default_rng(13)
    slow = [autoregressive(random, 600, 0.7) for _ in range(300)]
    p = np.sort([ljung_box(one, slow=True) for one in slow])
    assert np.abs(p - (np.arange(300) + 0.5) / 300).max() < 1.63 / np.sqrt(300)  # Kolmogorov, 1 %
    ringing = np.sin(2.0 * np.pi * 2.5 * 0.02 * np.arange(600))
    assert ljung_box(slow[0] + 0.7 * ringing, slow=True) < 1e-3
