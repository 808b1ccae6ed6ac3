"""Estimation problems whose model is a formula: what a search must find and know can be told beforehand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from forklift.fitting.observed import Observed
from forklift.fitting.problem import LeastSquares
from forklift.fitting.sample import Sample
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Run
from forklift.recordings.noise import Sensor

CHANNEL = "pressure_free_pa"


def unknown(name: str, width: float = 1.0, bound: float = np.inf) -> Unknown:
    """On a linear scale from 0, so that its value is θ times its width."""
    return Unknown((name,), "1", "linear", (0.0,), width, -bound, bound)


@dataclass
class Formula:
    """A machine whose output is a formula of its parameters, the same for every recording."""

    names: Sequence[str]
    formula: Callable[[np.ndarray], np.ndarray]
    slopes: Callable[[np.ndarray], np.ndarray]
    runs: list[int] = field(default_factory=list)
    """How many directions each call was differentiated along."""
    outputs: tuple[str, ...] = (CHANNEL,)
    name: str = "formula"

    def check(self, values: Mapping[str, float]) -> None:
        """Everything is possible."""

    def ordered(self, values: Mapping[str, float], unknowns: Sequence[Unknown]) -> Any:
        return np.zeros((0, len(unknowns))), np.zeros(0)

    def run(self, values, cases, conditions, *, substeps, along=(), own=(), steps=None) -> list[Run]:
        self.runs.append(len(along))
        at = np.array([values[name] for name in self.names])
        said, slopes = self.formula(at), self.slopes(at)
        columns = [slopes[:, self.names.index(name)] for name in along]
        wide = np.array([*columns, *(np.zeros(len(said)) for _ in own)]).reshape(-1, len(said)).T
        return [Run(said[:, None], wide[:, None, :]) for _ in cases]


class Apart(Formula):
    """A machine that is linear in its parameters and in its recordings' own conditions, by other columns of
    each recording: `Case.prepared` holds them by name."""

    def run(self, values, cases, conditions, *, substeps, along=(), own=(), steps=None) -> list[Run]:
        found = []
        for case, here in zip(cases, conditions, strict=True):
            columns = case.prepared
            at = {**values, **dict(zip(case.names, here, strict=True))}
            still = np.zeros(len(next(iter(columns.values()))))
            said = sum((at[name] * columns[name] for name in at if name in columns), still)
            names = [*along, *(case.names[k] for k in own)]
            slopes = np.array([columns.get(name, still) for name in names]).reshape(-1, len(still)).T
            found.append(Run(said[:, None], slopes[:, None, :]))
        return found


def apart(
    columns: Sequence[Mapping[str, np.ndarray]],
    measured: Sequence[np.ndarray],
    shared: Sequence[str],
    own: Sequence[str],
    known: Sequence[str],
) -> LeastSquares:
    """Recordings with noise of 1, each linear by `columns` of its own.

    All unknowns have priors about 0 of width 1; those of `own` that are `known` are 0.
    """
    sensor = Sensor(CHANNEL, 1.0, 0.0)
    width = np.array([0.0 if name in known else 1.0 for name in own])
    infinite = np.full(len(own), np.inf)
    samples = tuple(
        Sample(
            None,
            tuple(own),
            np.zeros(len(own)),
            width,
            -infinite,
            infinite,
            prepared=matrix,
            observed=(Observed(sensor, 0, np.arange(len(row)), row),),
        )
        for matrix, row in zip(columns, measured, strict=True)
    )
    machine = Apart(shared, np.zeros_like, np.zeros_like)
    return LeastSquares(machine, tuple(map(unknown, shared)), samples, 4, {CHANNEL: 1.0})


def problem(
    measured: np.ndarray,
    unknowns: Sequence[Unknown],
    formula: Callable[[np.ndarray], np.ndarray],
    slopes: Callable[[np.ndarray], np.ndarray],
    sigma: float,
) -> LeastSquares:
    """Of (recordings, samples) measurements with noise of `sigma`."""
    sensor = Sensor(CHANNEL, sigma, 0.0)
    samples = tuple(
        Sample(
            None,
            ("a", "b", "c", "d"),
            *np.zeros((4, 4)),
            observed=(Observed(sensor, 0, np.arange(len(row)), row),),
        )
        for row in np.atleast_2d(measured)
    )
    machine = Formula([one.name for one in unknowns], formula, slopes)
    return LeastSquares(machine, tuple(unknowns), samples, 4, {CHANNEL: sigma})


def linear(measured: np.ndarray, matrix: np.ndarray, names: Sequence[str], sigma: float, width: float = 1.0):
    """y = A p with the columns of A by name."""
    unknowns = [unknown(name, width) for name in names]
    return problem(measured, unknowns, lambda p: matrix @ p, lambda p: matrix, sigma)


def sensors(found: LeastSquares) -> dict[str, Sensor]:
    return {CHANNEL: found.samples[0].observed[0].sensor}
