"""A machine whose own search was caught in a local minimum is fitted again from where a name led it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

import analytic
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.plant.protocol import Hypothesis

TIME = np.linspace(0.0, 10.0, 400)
TRUE, NEAR = 9.0, 8.9
"""Angular frequencies [rad/s]: of what was measured, and where a name might end."""


@dataclass(frozen=True)
class Recording:
    """As far as a judgement needs it."""

    file: str
    role: str = "estimate"
    group: str = ""
    blocks: int = 1

    @property
    def time_s(self) -> np.ndarray:
        return TIME

    def __len__(self) -> int:
        return len(TIME)


def ringing(parameters: np.ndarray) -> np.ndarray:
    """A phase that is many turns off by the end has a local minimum at every turn."""
    return np.sin(parameters[0] * TIME)


def slopes(parameters: np.ndarray) -> np.ndarray:
    return (TIME * np.cos(parameters[0] * TIME))[:, None]


def measured_with(noise: float) -> Refitter:
    random = np.random.default_rng(4)
    measured = np.sin(TRUE * TIME) + noise * random.standard_normal((3, len(TIME)))
    problem = analytic.problem(measured, [analytic.unknown("omega", 10.0)], ringing, slopes, 0.01)
    samples = [replace(one, recording=Recording(f"{k}.csv")) for k, one in enumerate(problem.samples)]
    problem = problem.over(samples)
    return Refitter(problem, problem, analytic.sensors(problem))


@pytest.fixture(scope="module")
def refitter() -> Refitter:
    return measured_with(0.01)


def led_to(refitter: Refitter, baseline: Refit, omega: float) -> Refit:
    """As if a name had led the search there."""
    name = Hypothesis.__new__(Hypothesis)
    return replace(baseline, hypotheses=(name,), early=replace(baseline.early, x=np.array([omega / 10.0])))


def test_the_start_is_caught(refitter):
    assert refitter.baseline().worst.mean_square > 100.0


def test_from_where_a_name_ended_the_machine_alone_explains_all(refitter):
    baseline = refitter.baseline()
    alone = refitter.simpler(led_to(refitter, baseline, NEAR), baseline)
    assert alone is not None
    assert alone.hypotheses == ()
    assert alone.complete
    assert alone.found.x[0] * 10.0 == pytest.approx(TRUE, abs=1e-2)
    assert max(alone.costs) < min(baseline.costs)


def test_where_it_ends_no_better_the_first_fit_stands(refitter):
    baseline = refitter.baseline()
    assert refitter.simpler(led_to(refitter, baseline, 10.0 * baseline.early.x[0]), baseline) is None


@pytest.fixture(scope="module")
def noisy() -> Refitter:
    """Most of what the machine alone leaves over is noise that no machine could follow."""
    return measured_with(2.0)


@pytest.mark.parametrize(("share", "stands"), [(1.0, False), (4.0, True)], ids=["all of it", "a quarter"])
def test_the_machine_alone_is_better_there_if_it_gains_half_of_what_the_name_gained(noisy, share, stands):
    baseline = noisy.baseline()
    led = led_to(noisy, baseline, NEAR)
    there = noisy.rough((), led)
    gained = baseline.rough - there.rough
    assert 0.0 < gained < 0.5 * baseline.rough  # half of the cost is out of reach
    name = replace(led, costs=(there.costs[0], baseline.rough - share * gained))
    assert (noisy.simpler(name, baseline) is None) is stands
