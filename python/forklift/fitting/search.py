"""The search: least squares in stages, from heavily tempered noise to the sensors' own.

Each stage goes down the canyon of its likelihood (`forklift.fitting.levenberg_marquardt`). With the noise
thirty times too large, it is smooth enough to be followed from another truck's values; in the end each
channel's noise is the larger of its sensor's and of what its own residuals show, so that a channel the model
cannot follow does not drag the rest along. A trust region with straight steps, which takes no second
derivative, was tried for the first stage: it needs more evaluations, and with leakage among the unknowns it
stalled.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize_scalar

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.fitting import levenberg_marquardt as geodesic
from forklift.fitting import likelihood
from forklift.fitting.criteria import HOPED
from forklift.fitting.interface import Problem

if TYPE_CHECKING:
    from forklift.recordings.noise import Sensor


@dataclass(frozen=True)
class Stage:
    """One descent with weights of its own."""

    temper: float
    """The sensors' noise is multiplied by this; 1: the larger of the noise and of what the residuals show."""
    substeps: int
    evaluations: int
    """Most evaluations with derivatives."""
    gain: float
    """The stage ends where a further step lowers the cost by less than about this."""
    sharpest: float = 0.3
    """Least softness of an encoder's edges, in counts."""
    share: float = 0.0
    """It ends as well where a further step lowers the cost by less than this share of it."""


SEEN = 4
"""Evaluations after which a descent may be given up."""

STAGES = (
    Stage(30.0, 4, 20, 0.2),
    Stage(3.0, 4, 20, 1.0),
    Stage(1.0, 4, 20, 0.5),
    Stage(1.0, 8, 15, 0.02, 0.1),
)
"""An encoder's edges are sharpened last: while the model is further off than they are wide, only the few
samples at the edges pull. They never get sharper than what the simulation itself may be off by."""

Progress = Callable[[Stage, int, float, Floats], None]
"""Told after each evaluation: the stage, its count, the cost, and the unknown vector."""


@dataclass(frozen=True)
class Found:
    """Where a search ended."""

    x: Floats
    problem: Problem
    """With the weights of the last stage."""
    cost: float
    """−ln posterior at x, up to a constant that depends on the weights."""
    residual: Floats
    jacobian: Floats
    evaluations: int
    """With derivatives."""


def search(
    problem: Problem,
    x: Floats,
    sensors: Mapping[str, Sensor],
    stages: tuple[Stage, ...] = STAGES,
    progress: Progress | None = None,
    bars: Sequence[float] = (),
) -> Found:
    """From x through all stages.

    `bars` are costs that the first stages must come down to: a stage that goes so slowly that it will not is
    given up (`too_slow`).

    Raises
    ------
    ForkliftError
        If the truck at x is impossible, or a run fails there.
    """
    evaluations = 0
    with one_thread():
        for place, stage in enumerate(stages):
            bar = bars[place] if place < len(bars) else np.inf
            problem = _weighted(problem, x, sensors, stage)
            counter, late = Counter(stage, progress), partial(too_slow, bar)
            x = geodesic.descend(problem, x, stage.evaluations, stage.gain, counter, stage.share, late)
            evaluations += counter.count
        return ended(problem, x, evaluations)


def too_slow(bar: float, costs: Sequence[float], left: int) -> bool:
    """Whether a descent is still above the bar, and will be after so many further evaluations, `HOPED` times
    as fast as the last two."""
    if len(costs) <= SEEN or costs[-1] <= bar:
        return False
    pace = 0.5 * (costs[-3] - costs[-1])
    return costs[-1] - HOPED * left * pace > bar


def settle(problem: Problem, x: Floats, sensors: Mapping[str, Sensor]) -> Found:
    """What a search that ends at x gives, with the last stage's weights."""
    return ended(_weighted(problem, x, sensors, STAGES[-1]), x, 1)


def ended(problem: Problem, x: Floats, evaluations: int) -> Found:
    """What a search gives that ended at x, with the weights of its last stage."""
    with one_thread():
        residual, jacobian = problem.compressed(x)
    return Found(x, problem, 0.5 * float(residual @ residual), residual, jacobian, evaluations)


def _weighted(problem: Problem, x: Floats, sensors: Mapping[str, Sensor], stage: Stage) -> Problem:
    weights = temper(problem, x, sensors, stage)
    return problem.weighted(weights, stage.substeps)


class Counter:
    """Counts a stage's evaluations and tells of them."""

    def __init__(self, stage: Stage, progress: Progress | None) -> None:
        self.stage, self.progress, self.count = stage, progress, 0

    def __call__(self, cost: float, x: Floats) -> None:
        self.count += 1
        if self.progress:
            self.progress(self.stage, self.count, cost, x)


def temper(problem: Problem, x: Floats, sensors: Mapping[str, Sensor], stage: Stage) -> dict[str, float]:
    """The standard deviation each channel is weighted by in this stage."""
    if stage.temper > 1.0:
        return {name: stage.temper * sensor.noise for name, sensor in sensors.items()}
    said = problem.said(x)
    return {name: _own_noise(name, sensor, problem, said, stage.sharpest) for name, sensor in sensors.items()}


def _own_noise(
    name: str, sensor: Sensor, problem: Problem, every: Sequence[Mapping[str, Floats]], sharpest: float
) -> float:
    """The larger of a sensor's noise and of what its residuals show over all recordings."""
    pairs = [
        (seen.values, every[k][name])
        for k, sample in enumerate(problem.samples)
        for seen in sample.observed
        if seen.sensor.channel == name
    ]
    if not pairs:
        return sensor.noise
    read, said = (np.concatenate(column) for column in zip(*pairs, strict=True))
    if not sensor.count:
        off = np.abs(said - read)
        robust = np.sqrt(np.mean(np.minimum(off, likelihood.HUBER * max(sensor.noise, np.median(off))) ** 2))
        return max(sensor.noise, float(robust))
    count = sensor.count
    best = minimize_scalar(
        lambda log_s: likelihood.interval_cost(read, said, count, np.exp(log_s)),
        bounds=(np.log(sharpest * count), np.log(100.0 * count)),
        method="bounded",
    )
    return float(np.exp(best.x))
