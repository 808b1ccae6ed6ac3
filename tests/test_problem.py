"""Recordings as one least-squares problem: costs and derivatives agree, and nothing depends on threads."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign, Recording, Truck
from forklift.fitting.levenberg_marquardt import cost
from forklift.fitting.posing import pose
from forklift.fitting.problem import LeastSquares
from forklift.fitting.residuals import settled
from forklift.fitting.sample import Sample
from forklift.plant.forklift.model import OWN, Forklift
from forklift.plant.forklift.sensors import sensors
from forklift.plant.forklift.unknowns import unknowns

ROOT = Path(__file__).parents[1]
NULL = ROOT / "tests" / "campaigns" / "null"


def shortened(recording: Recording, begin_s: float, seconds: float) -> Recording:
    """A recording's part, from time 0."""
    rows = (recording.time_s >= begin_s) & (recording.time_s < begin_s + seconds)
    channels = {name: values[rows] for name, values in recording.channels.items()}
    time = recording.time_s[rows] - recording.time_s[rows][0]
    return Recording(recording.file, recording.lift, recording.load_kg, recording.role, time, channels)


@cache
def problem(light: str = "free_prms1_800kg_20c.csv") -> LeastSquares:
    """Two recordings from rest until the lift has moved for three seconds, their loads not quite known."""
    thesis = Truck.read("thesis")
    recordings = [
        shortened(recording, 0.0, 4.0)
        for recording in Campaign.read(NULL).recordings
        if recording.file in (light, "free_prms1_1500kg_60c.csv")
    ]
    every = sensors(recordings)
    machine, moved = Forklift(thesis, ("free",), load_width_kg=5.0), unknowns(thesis, ["free"])
    return pose(
        machine, recordings, moved, every, {name: 10.0 * sensor.noise for name, sensor in every.items()}
    )


def somewhere(seed: int) -> np.ndarray:
    return 0.03 * np.random.default_rng(seed).standard_normal(problem().starts[-1])


def uncompressed(problem: LeastSquares, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every sample's residual and its derivatives, one below the other."""
    rho, slope = problem.prior(x)
    residual, jacobian = [rho], [np.diag(slope)]
    for k, at in enumerate(problem.linearise(x)):
        for channel in at.residual:
            rows = np.zeros((len(at.residual[channel]), len(x)))
            rows[:, problem.columns(k)] = at.jacobian[channel]
            residual.append(at.residual[channel])
            jacobian.append(rows)
    return np.concatenate(residual), np.vstack(jacobian)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_compressed_problem_has_the_cost_gradient_and_normal_matrix_of_all_samples(seed):
    x = somewhere(seed)
    residual, jacobian = uncompressed(problem(), x)
    small, slopes = problem().compressed(x)
    assert len(small) < len(residual) / 4
    assert small @ small == pytest.approx(residual @ residual, rel=1e-10)
    scale = np.sqrt(np.diag(jacobian.T @ jacobian))
    gradient = jacobian.T @ residual / scale
    assert slopes.T @ small / scale == pytest.approx(gradient, abs=1e-9 * np.abs(gradient).max())
    normal = jacobian.T @ jacobian / np.outer(scale, scale)
    assert slopes.T @ slopes / np.outer(scale, scale) == pytest.approx(normal, abs=1e-10)


def test_products_and_residuals_are_those_of_the_linearised_problem():
    x = somewhere(3)
    residual, jacobian = uncompressed(problem(), x)
    normal, gradient, square = np.diag(problem().prior(x)[1] ** 2), np.zeros(len(x)), 0.0
    gradient += problem().prior(x)[1] * problem().prior(x)[0]
    for k, run in enumerate(problem().products(x)):
        place = problem().columns(k)
        normal[np.ix_(place, place)] += run.normal
        gradient[place] += run.gradient
        square += run.square
    scale = np.sqrt(np.diag(normal))
    assert normal / np.outer(scale, scale) == pytest.approx(
        jacobian.T @ jacobian / np.outer(scale, scale), abs=1e-10
    )
    assert gradient / scale == pytest.approx(jacobian.T @ residual / scale, rel=1e-8, abs=1e-6)
    assert cost(problem(), x) == pytest.approx(0.5 * residual @ residual, rel=1e-10)


@pytest.mark.parametrize("seed", range(6))
def test_the_gradient_is_the_costs_difference_quotient_along_any_direction(seed):
    x = somewhere(seed)
    direction = np.random.default_rng([seed, 1]).standard_normal(len(x))
    residual, jacobian = problem().compressed(x)
    exact = residual @ jacobian @ direction

    def quotient(step: float) -> float:
        return (cost(problem(), x + step * direction) - cost(problem(), x - step * direction)) / (2.0 * step)

    size = np.linalg.norm(jacobian.T @ residual)  # along some directions nearly nothing is left of it
    # Where one Newton iteration more or less is taken within a step, its quotient jumps: take the middle one.
    quotients = [quotient(step) for step in (1e-3, 1e-5, 1e-6)]
    assert np.median(quotients) == pytest.approx(exact, rel=1e-4, abs=1e-5 * size)


def test_each_unknown_has_its_own_slope():
    """Along one unknown after the other, where a mistake in one place cannot hide among the rest."""
    x = somewhere(7)
    residual, jacobian = problem().compressed(x)
    gradient, step = jacobian.T @ residual, 1e-5
    for k in range(len(x)):
        aside = step * np.eye(len(x))[k]
        quotient = (cost(problem(), x + aside) - cost(problem(), x - aside)) / (2.0 * step)
        assert quotient == pytest.approx(gradient[k], rel=1e-3, abs=1e-6 * np.abs(gradient).max()), k


def test_a_recordings_own_unknowns_touch_no_other_recording():
    x = somewhere(4)
    before = problem().residuals(x)
    x[problem().starts[0]] += 0.5
    after = problem().residuals(x)
    assert np.array_equal(before[1], after[1])
    assert not np.array_equal(before[0], after[0])


def test_no_search_asks_for_a_load_below_zero_or_for_oil_that_none_can_be():
    given = problem("free_prms1_0kg_20c.csv")
    lower, upper = given.bounds()
    first, second, _ = given.starts
    assert lower[first] == 0.0
    assert lower[second] == -300.0
    for start, sample in ((first, given.samples[0]), (second, given.samples[1])):
        oil = sample.names.index("oil_temperature")
        place, read = start + oil, sample.prepared.temperature[0]
        assert read + sample.width[oil] * lower[place] == pytest.approx(-40.0)
        assert read + sample.width[oil] * upper[place] == pytest.approx(130.0)
    bounded = [0, 1, second - first, second - first + 1]
    assert np.isneginf(np.delete(lower[first:], bounded)).all()
    assert np.isposinf(np.delete(upper[first:], [1, second - first + 1])).all()


@pytest.mark.parametrize("load_kg", [0.1, 37.3, 109.67872202431536, 110.0, 729.1, 1590.0])
def test_at_its_bound_a_load_is_none_and_not_a_rounding_less(load_kg):
    whole, place = problem(), OWN.index("load")
    for width in np.random.default_rng(2).uniform(1.0, 300.0, 50):
        samples = []
        for one in whole.samples:
            centre, wide = one.centre.copy(), one.width.copy()
            centre[place], wide[place] = load_kg, width
            samples.append(replace(one, centre=centre, width=wide))
        at_the_end = replace(whole, samples=tuple(samples))
        lower, _ = at_the_end.bounds()
        x = np.where(np.isfinite(lower), lower, 0.0)
        for k in range(len(samples)):
            assert at_the_end.conditions(x, k)[place] == pytest.approx(0.0, abs=1e-9)
            assert at_the_end.conditions(x, k)[place] >= 0.0


def test_samples_that_are_missing_leave_the_variables_of_a_moment_whole():
    """A signal that stood still, or dropped out, has fewer samples than the recording has times."""
    whole = problem()
    recordings = [one.recording for one in whole.samples]
    gaps = {"pressure_free_pa": slice(40, 60), "position_free_m": slice(100, 103)}
    spoilt = []
    for one in recordings:
        channels = {name: values.copy() for name, values in one.channels.items()}
        for name, rows in gaps.items():
            channels[name][rows] = np.nan
        spoilt.append(Recording(one.file, one.lift, one.load_kg, one.role, one.time_s, channels))
    every = sensors(recordings)
    gappy = pose(whole.machine, spoilt, whole.unknowns, every, whole.sigma)
    found = gappy.moments(somewhere(0), "free")
    right = whole.moments(somewhere(0), "free")
    for one, other in zip(found, right, strict=True):
        assert one.keys() == other.keys()
        assert np.array_equal(one["pressure"][60:], other["pressure"][60:])
        assert np.abs(one["position"] - other["position"]).max() < 1e-3
        assert all(np.isfinite(values).all() for values in one.values())


def test_only_what_some_recording_does_not_know_is_differentiated_along():
    """A load that one recording knows and another does not, and temperatures that both know."""
    whole = problem()
    load, temperature = OWN.index("load"), OWN.index("oil_temperature")

    def changed(k: int) -> Sample:
        width = whole.samples[k].width.copy()
        width[temperature] = 0.0
        width[load] *= k
        return replace(whole.samples[k], width=width)

    some = whole.over([changed(0), changed(1)])
    assert OWN[some.carried[0]] == "load"
    assert temperature not in some.carried
    x = 0.03 * np.random.default_rng(5).standard_normal(some.starts[-1])
    for at, k in zip(some.linearise(x), (0, 1), strict=True):
        step = 1e-4 * np.eye(len(x))
        for j, place in enumerate(some.columns(k)[len(some.unknowns) :]):
            there = some.said(x + step[place])[k]["pressure_free_pa"]
            back = some.said(x - step[place])[k]["pressure_free_pa"]
            slope = at.slope["pressure_free_pa"][:, len(some.unknowns) + j]
            assert (there - back) / 2e-4 == pytest.approx(slope, rel=1e-3, abs=1e-3 * np.abs(slope).max())


SEARCH = """
import hashlib, sys
import numpy as np
sys.path.insert(0, "tests")
from test_problem import problem, sensors
from forklift.fitting.search import Stage, search
from forklift.fitting.intervals import knowledge
small = problem()
every = sensors([one.recording for one in small.samples])
stages = (Stage(30.0, 4, 3, 0.2), Stage(3.0, 4, 3, 1.0))
found = search(small, np.zeros(small.starts[-1]), every, stages)
known = knowledge(found.problem, found.x)
bits = found.x.tobytes() + found.residual.tobytes() + found.jacobian.tobytes() + known.covariance.tobytes()
print(hashlib.sha256(bits).hexdigest(), np.abs(found.x).max() > 0.1)
"""


def searched(rayon: int, blas: int) -> str:
    environment = os.environ | {
        "RAYON_NUM_THREADS": str(rayon),
        "OPENBLAS_NUM_THREADS": str(blas),
        "OMP_NUM_THREADS": str(blas),
    }
    done = subprocess.run(
        [sys.executable, "-c", SEARCH],
        cwd=ROOT,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )
    return done.stdout


def test_a_search_does_not_depend_on_any_number_of_threads_to_the_bit():
    alone = searched(1, 1)
    assert alone.endswith("True\n")  # it has moved
    for threads in ((2, 1), (1, 2), (3, 2)):
        assert searched(*threads) == alone


def test_where_recordings_settle_nothing_of_their_own_explains_them_better():
    """What they share stays as given, though it is no optimum."""
    posed = problem()
    theta = np.full(len(posed.unknowns), 0.2)
    x = settled(posed, theta, far=0.01, moves=6)
    n = len(theta)
    np.testing.assert_array_equal(x[:n], theta)
    least = cost(posed, x)
    for k in range(n, len(x)):
        for step in (-0.05, 0.05):
            there = x.copy()
            there[k] += step
            assert cost(posed, there) > least - 1e-3
