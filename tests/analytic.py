"""Estimation problems whose model is a formula: what a search must find and know can be told beforehand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np

from forklift.plant.forklift.problem import Observed, Problem, Sample
from forklift.plant.parameter import Unknown
from forklift.recordings.noise import Sensor

CHANNEL = "pressure_free_pa"


def unknown(name: str, width: float = 1.0, bound: float = np.inf) -> Unknown:
    """On a linear scale from 0, so that its value is θ times its width."""
    return Unknown((name,), "1", "linear", (0.0,), width, -bound, bound)


@dataclass
class Analytic(Problem):
    """One recording per row of measurements, each the same formula of the unknowns' values."""

    formula: Callable[[np.ndarray], np.ndarray] = field(default=lambda values: values)
    slopes: Callable[[np.ndarray], np.ndarray] = field(default=lambda values: np.eye(len(values)))
    runs: list[int] = field(default_factory=list)
    """How many directions each call of the model was differentiated along."""

    def _simulate(self, x: np.ndarray, *, derivatives: bool) -> list[tuple[np.ndarray, np.ndarray]]:
        self.runs.append(len(self.unknowns) if derivatives else 0)
        theta = x[: len(self.unknowns)]
        values = np.array([one.values(float(at))[0] for one, at in zip(self.unknowns, theta, strict=True)])
        said, slopes = self.formula(values), self.slopes(values)
        slopes = np.hstack([slopes, np.zeros((len(said), 4))])  # a recording's own conditions change nothing
        return [(said[:, None], slopes[:, None, :])] * len(self.samples)


def problem(
    measured: np.ndarray,
    unknowns: Sequence[Unknown],
    formula: Callable[[np.ndarray], np.ndarray],
    slopes: Callable[[np.ndarray], np.ndarray],
    sigma: float,
) -> Analytic:
    """Of (recordings, samples) measurements with noise of `sigma`."""
    sensor = Sensor(CHANNEL, sigma, 0.0)
    samples = tuple(
        Sample(
            None,  # type: ignore[arg-type]
            None,  # type: ignore[arg-type]
            np.zeros(4),
            np.zeros(4),
            (Observed(sensor, 0, np.arange(len(row)), row),),
        )
        for row in np.atleast_2d(measured)
    )
    return Analytic(TRUCK, tuple(unknowns), samples, 4, {CHANNEL: sigma}, formula, slopes)


def linear(measured: np.ndarray, matrix: np.ndarray, names: Sequence[str], sigma: float, width: float = 1.0):
    """y = A p with the columns of A by name."""
    unknowns = [unknown(name, width) for name in names]
    return problem(measured, unknowns, lambda p: matrix @ p, lambda p: matrix, sigma)


def sensors(found: Analytic) -> dict[str, Sensor]:
    return {CHANNEL: found.samples[0].observed[0].sensor}


def _moved(values: Mapping[str, Any], source: str) -> Any:
    return TRUCK


TRUCK: Any = SimpleNamespace(values={}, with_values=_moved)
"""A truck that any values are possible of."""
