"""Residuals of the likelihood: against its definition in sixty digits, and what robustness promises."""

from __future__ import annotations

import math
from decimal import MIN_EMIN, Decimal, getcontext
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm
from scipy.stats import t as students

from forklift import _core
from forklift.fitting.likelihood import HUBER, gaussian, interval, interval_cost, student
from forklift.fitting.observed import Observed

getcontext().prec = 60
getcontext().Emin = MIN_EMIN
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459")

softnesses = st.floats(-4.0, 3.0).map(lambda power: 10.0**power)
"""In counts: from edges as sharp as a step to noise that hides the count."""
timeless = settings(deadline=None)
distances = st.floats(-40.0, 40.0)
"""Of the model from the middle of the interval, in the larger of half a count and softness."""


def density(z: float) -> Decimal:
    return (-(Decimal(z) ** 2) / 2).exp() / (2 * PI).sqrt()


def error_integral(z: Decimal) -> Decimal:
    """∫₀ᶻ φ by its series, which has terms of one sign only: nothing cancels."""
    term, total, k = z, z, 1
    while abs(term) > abs(total) * Decimal(10) ** -58:
        k += 2
        term *= z * z / k
        total += term
    return total * (-z * z / 2).exp() / (2 * PI).sqrt()


def upper_tail(z: Decimal) -> Decimal:
    """1 − Φ(z) for large z, by Lentz's continued fraction z + 1/(z + 2/(z + …))."""
    fraction = z
    for k in range(400, 0, -1):
        fraction = z + k / fraction
    return (-z * z / 2).exp() / (2 * PI).sqrt() / fraction


def log_probability(low: Decimal, high: Decimal) -> float:
    """ln(Φ(high) − Φ(low)) for low < high."""
    if low + high < 0:
        low, high = -high, -low
    if low > 8:
        return float((upper_tail(low) - upper_tail(high)).ln())
    if low < -8:
        return float((1 - upper_tail(-low) - upper_tail(high)).ln())
    if high > 8:
        return float((Decimal("0.5") - error_integral(low) - upper_tail(high)).ln())
    return float((error_integral(high) - error_integral(low)).ln())


@cache
def most(half: float) -> float:
    return log_probability(Decimal(-half), Decimal(half))


def witness(read: float, model: float, count: float, softness: float) -> float:
    """ρ² of an interval, by definition and without rounding to speak of."""
    low = (Decimal(read) - Decimal(model)) / Decimal(softness)
    high = low + Decimal(count) / Decimal(softness)
    return -2.0 * (log_probability(low, high) - most(0.5 * count / softness))


def one(function, measured: float, model: float, *others: float) -> tuple[float, float]:
    rho, slope = function(np.array([measured]), np.array([model]), *others)
    return float(rho[0]), float(slope[0])


def test_the_witness_itself_is_the_normal_distribution():
    for low, high in ((-1.0, 2.0), (3.0, 3.5), (7.0, 9.0), (-9.0, -8.5), (-20.0, 1.0)):
        assert log_probability(Decimal(low), Decimal(high)) == pytest.approx(
            math.log(quad(norm.pdf, low, high, epsabs=0.0, epsrel=1e-12)[0]), rel=1e-10
        )


@timeless
@given(distances, softnesses)
def test_an_interval_is_as_unlikely_as_the_normal_distribution_says(distance, softness):
    read = 0.25
    model = read + 0.5 + distance * max(0.5, softness)
    rho, _ = one(interval, read, model, 1.0, softness)
    # Of an interval much narrower than its edges the probability is a difference of nearly equal numbers.
    rounding = 1e-14 * (1.0 + softness)
    assert rho**2 == pytest.approx(witness(read, model, 1.0, softness), rel=1e-9, abs=rounding)


@timeless
@given(distances, softnesses)
def test_the_slope_of_an_interval_is_its_difference_quotient(distance, softness):
    model = 0.5 + distance * max(0.5, softness)
    step = 1e-4 * softness
    rho, slope = one(interval, 0.0, model, 1.0, softness)
    ends = [witness(0.0, model + side * step, 1.0, softness) for side in (-1.0, 1.0)]
    rounding = 2.0 * np.sqrt(1e-14 * (1.0 + softness))  # of ρ, where ρ² is lost
    quotient = (ends[1] - ends[0]) / (2.0 * step)  # of ρ², which is smooth where ρ is lost in rounding
    assert 2.0 * rho * slope * softness == pytest.approx(quotient * softness, rel=1e-5, abs=rounding)


@timeless
@given(softnesses.filter(lambda s: s >= 0.05), st.floats(-1e-3, 1e-3))
def test_an_interval_is_smooth_through_its_middle(softness, off):
    _, at = one(interval, 0.0, 0.5, 1.0, softness)
    _, beside = one(interval, 0.0, 0.5 + off * softness, 1.0, softness)
    assert beside == pytest.approx(at, rel=1e-2, abs=1e-4 / softness)


def test_soft_edges_are_gaussian_noise_around_the_middle():
    models = np.linspace(-300.0, 300.0, 61)
    rho, slope = interval(np.zeros(61), models, 1.0, 100.0)
    assert rho == pytest.approx((models - 0.5) / 100.0, abs=1e-4)
    assert slope == pytest.approx(np.full(61, 0.01), rel=1e-4)


def test_sharp_edges_tell_nothing_inside():
    rho, slope = interval(np.zeros(3), np.array([0.1, 0.5, 0.9]), 1.0, 0.01)
    assert np.abs(rho).max() < 1e-6
    assert np.abs(slope).max() < 1e-6


def test_the_cost_of_softness_is_the_likelihood_itself():
    random = np.random.default_rng(2)
    truth = random.uniform(-50.0, 50.0, 4000)
    read = np.floor(truth + 0.4 * random.standard_normal(4000))
    costs = {s: interval_cost(read, truth, 1.0, s) for s in (0.1, 0.2, 0.4, 0.8, 1.6)}
    assert min(costs, key=costs.__getitem__) == 0.4
    said = -2.0 * np.sum(np.log(norm.cdf(read + 1.0, truth, 0.4) - norm.cdf(read, truth, 0.4)))
    assert costs[0.4] == pytest.approx(said, rel=1e-9)


@timeless
@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e3))
def test_gaussian_noise_is_least_squares_up_to_hubers_bend_and_a_distance_beyond(off, sigma):
    rho, _ = one(gaussian, 1.0, 1.0 + off * sigma, sigma)
    size = abs((1.0 + off * sigma) - 1.0) / sigma
    huber = size**2 if size <= HUBER else 2.0 * HUBER * size - HUBER**2
    assert rho**2 == pytest.approx(huber, rel=1e-9, abs=1e-12)
    assert rho * off >= 0.0


@timeless
@given(st.floats(-1e9, 1e9), st.floats(1e-3, 1e3))
def test_no_sample_pulls_harder_than_one_at_hubers_bend(off, sigma):
    rho, slope = one(gaussian, 0.0, off * sigma, sigma)
    assert abs(rho * slope) * sigma <= HUBER * (1.0 + 1e-12)


@timeless
@given(st.floats(-50.0, 50.0), st.floats(1e-3, 1e3))
def test_the_slope_of_gaussian_noise_is_its_difference_quotient(off, sigma):
    step = 1e-5 * sigma
    _, slope = one(gaussian, 0.0, off * sigma, sigma)
    ends = [one(gaussian, 0.0, off * sigma + side * step, sigma)[0] for side in (-1.0, 1.0)]
    assert slope * sigma == pytest.approx((ends[1] - ends[0]) / (2.0 * step) * sigma, rel=1e-4)


@timeless
@given(st.floats(-1e3, 1e3), st.floats(1.0, 30.0))
def test_the_prior_is_students_distribution(theta, degrees):
    rho, _ = student(np.array([theta]), degrees)
    said = -2.0 * (students.logpdf(theta, degrees) - students.logpdf(0.0, degrees))
    assert float(rho[0]) ** 2 == pytest.approx(said, rel=1e-9, abs=1e-9)


@timeless
@given(st.floats(-1e3, 1e3), st.floats(1.0, 30.0))
def test_the_slope_of_the_prior_is_its_difference_quotient(theta, degrees):
    step = 1e-5 * max(1.0, abs(theta))
    ends, _ = student(np.array([theta - step, theta + step]), degrees)
    _, slope = student(np.array([theta]), degrees)
    assert slope[0] == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-4, abs=1e-9)


def test_the_prior_lets_go_of_what_is_far_away():
    at = np.array([1.0, 3.0, 10.0, 100.0])
    rho, slope = student(at, 4.0)
    pull = rho * slope
    assert pull[1] > pull[2] > pull[3]
    assert pull.max() < 2.0


@timeless
@given(
    st.lists(distances, min_size=1, max_size=20),
    softnesses,
    st.sampled_from([0.0, 1.0]),
    st.sampled_from([(-math.inf, math.inf), (-math.inf, 0.0), (0.0, 1.0)]),
)
def test_the_residual_alone_is_that_beside_the_slope(
    off: list[float], softness: float, count: float, ends: tuple[float, float]
) -> None:
    """Of an encoder, of a sensor that reads all there is, and of one that reads between two ends."""
    model, read = np.array(off) * max(0.5, softness), np.zeros(len(off))
    seen = Observed(SimpleNamespace(count=count), 0, np.arange(len(off)), read, ends)
    alone = _core.residuals([(model[:, None], [seen.weighted(softness)])])[0]
    assert np.array_equal(alone, seen.misfit(model, softness)[0])
