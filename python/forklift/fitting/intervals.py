"""What a fit knows: intervals, what moves together, and what these recordings cannot tell.

At the optimum the posterior is taken as normal in θ, with the inverse of the Gauss–Newton matrix JᵀJ as its
covariance; the recordings' own unknowns are marginalised with it. Residuals that are not white carry less
than their number says, so each channel's noise is first widened by the root of their autocorrelation time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from forklift.base.arrays import Floats
from forklift.base.threads import on_one_thread
from forklift.fitting.criteria import CLOCK
from forklift.fitting.observed import by_channel
from forklift.fitting.residuals import ljung_box

if TYPE_CHECKING:
    from forklift.fitting.interface import Problem
    from forklift.plant.parameter import Unknown
    from forklift.recordings.noise import Sensor


LEVEL = 0.95
"""Of every interval."""
QUANTILE = 1.959963984540054
"""Of the normal distribution: 95 % lie within."""

TOLD = 0.5
"""A parameter is told by the recordings if they narrow its prior to less than this."""

TOGETHER = 0.7
"""Correlation from which on two parameters are said to be known only together."""

NUDGE = 0.2
"""How far the first of a group is moved to say how the others follow, in its prior's deviations."""

COLOURED = 1e-3
"""Level of the Ljung–Box test below which residuals of a recording count as coloured."""


@dataclass(frozen=True)
class Estimate:
    """One unknown, estimated."""

    unknown: Unknown
    value: float
    """Of the first of its parameters."""
    lower: float
    """95 % interval."""
    upper: float
    deviation: float
    """Posterior standard deviation, in units of the prior's."""
    alone: float
    """The same if all other unknowns were known."""

    @property
    def name(self) -> str:
        return self.unknown.name

    @property
    def identifiable(self) -> bool:
        """Whether the recordings tell it, and not the prior."""
        return self.deviation < TOLD


@dataclass(frozen=True)
class Group:
    """Parameters that the recordings know only together: moved all `by` this, nothing measured changes."""

    names: tuple[str, ...]
    by: tuple[float, ...]
    """In each one's unit."""
    units: tuple[str, ...]


@dataclass(frozen=True)
class Knowledge:
    """What is known of the shared unknowns at the optimum."""

    covariance: Floats
    """Of θ."""
    estimates: tuple[Estimate, ...]
    groups: tuple[Group, ...]
    unidentifiable: tuple[str, ...]
    """Parameters about which the recordings say nothing, together or alone."""
    widening: Mapping[str, float]
    """Factor on each channel's noise for residuals that are not white; 1 where they are."""
    whole: Floats
    """Covariance of the shared unknowns and of what each recording has of its own."""

    @property
    def correlation(self) -> Floats:
        deviation: Floats = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(deviation, deviation))


@on_one_thread
def knowledge(problem: Problem, x: Floats) -> Knowledge:
    """What is known at the optimum x of `problem`."""
    wide = widening(problem, x)
    if any(factor > 1.0 for factor in wide.values()):
        sigma = {name: noise * wide.get(name, 1.0) for name, noise in problem.sigma.items()}
        problem = problem.weighted(sigma)
    _, jacobian = problem.compressed(x)
    normal = jacobian.T @ jacobian
    shared = len(problem.unknowns)
    whole = inverse(normal)
    covariance = whole[:shared, :shared]
    deviation = np.sqrt(np.diag(covariance))
    alone = 1.0 / np.sqrt(np.diag(normal))[:shared]
    estimates = tuple(
        _estimate(*row) for row in zip(problem.unknowns, x[:shared], deviation, alone, strict=True)
    )
    groups, unidentifiable = _untold(problem.unknowns, covariance, x[:shared], alone)
    return Knowledge(covariance, estimates, groups, unidentifiable, wide, whole)


@on_one_thread
def covariance_at_noise(problem: Problem, x: Floats, sensors: Mapping[str, Sensor]) -> Floats:
    """Covariance of θ as it would be if what is left over were the sensors' noise and nothing else.

    It is what a complete model does not know of its parameters: a model that misses something is granted no
    more.
    """
    problem = problem.weighted({name: sensor.noise for name, sensor in sensors.items()})
    _, jacobian = problem.compressed(x)
    shared = len(problem.unknowns)
    return np.asarray(inverse(jacobian.T @ jacobian)[:shared, :shared])


def inverse(normal: Floats) -> Floats:
    """Of normal equations with a prior of about 1 in every direction; where slopes are so large that rounding
    has lost it, nothing is known of that direction but the prior."""
    try:
        everything = cho_solve(cho_factor(normal), np.eye(len(normal)))
    except LinAlgError:
        values, vectors = np.linalg.eigh(normal)
        values[values < np.finfo(float).eps * len(values) * values[-1]] = 1.0
        everything = (vectors / values) @ vectors.T
    return np.asarray(0.5 * (everything + everything.T))


def widening(problem: Problem, x: Floats) -> dict[str, float]:
    """√(1 + 2 Σ r_k) of each channel's residuals, over the recordings in which they are coloured.

    The sum runs over the problem's lags, with the correlations' mean over the recordings; at least 1. An
    encoder's softness takes up what is left over there, and is not widened.
    """
    correlations: dict[str, list[Floats]] = {}
    for left, sample in zip(problem.residuals(x), problem.samples, strict=True):
        residuals = by_channel(sample.observed, left)
        for seen in sample.observed:
            if seen.sensor.count:
                continue
            residual = residuals[seen.sensor.channel]
            white = ljung_box(residual)
            uncorrelated = white is None or white > COLOURED
            found = np.zeros(problem.lags) if uncorrelated else _autocorrelation(residual, problem.lags)
            correlations.setdefault(seen.sensor.channel, []).append(found)
    return {
        name: float(np.sqrt(max(1.0, 1.0 + 2.0 * np.mean(found, axis=0).sum())))
        for name, found in correlations.items()
    }


def _autocorrelation(residual: Floats, lags: int) -> Floats:
    energy = residual @ residual
    return np.array([residual[k:] @ residual[:-k] / energy for k in range(1, lags + 1)])


def within(unknown: Unknown, theta: float, reach: float) -> Floats:
    """(2, names) least and greatest of each parameter for an unknown within `reach` of θ and its bounds."""
    both = np.clip([theta - reach, theta + reach], unknown.lower, unknown.upper)
    return np.sort([unknown.values(float(end)) for end in both], axis=0)


def interval(unknown: Unknown, theta: float, deviation: float) -> Floats:
    """(2, names) the 95 % interval of each parameter p of an unknown, within its bounds: where p(θ ± 1.96
    deviations) is h away, √(h² + (CLOCK p)²), see `forklift.fitting.criteria.CLOCK`."""
    values = unknown.values(theta)
    lower, upper = within(unknown, theta, QUANTILE * deviation)
    floor = CLOCK * np.abs(values)
    both = values - np.hypot(values - lower, floor), values + np.hypot(upper - values, floor)
    return np.asarray(np.clip(both, unknown.least, unknown.most))


def ends(unknown: Unknown, theta: float, deviation: float) -> tuple[float, float]:
    """The same of the first parameter."""
    lower, upper = interval(unknown, theta, deviation)[:, 0].tolist()
    return lower, upper


def _estimate(unknown: Unknown, theta: float, deviation: float, alone: float) -> Estimate:
    value = float(unknown.values(theta)[0])
    return Estimate(unknown, value, *ends(unknown, theta, deviation), float(deviation), float(alone))


def _untold(
    unknowns: Sequence[Unknown], covariance: Floats, theta: Floats, alone: Floats
) -> tuple[tuple[Group, ...], tuple[str, ...]]:
    """Groups known only together, each around its least known member, which stands alone if there is no
    other: it goes with what recordings have of their own; and what is not known at all."""
    deviation = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(deviation, deviation)
    left = [int(k) for k in np.argsort(-deviation) if deviation[k] >= TOLD]
    groups, unidentifiable = [], []
    while left:
        first = left[0]
        if alone[first] >= TOLD:
            unidentifiable.append(unknowns[first].name)
            left.remove(first)
            continue
        members = [first] + [
            int(k)
            for k in np.argsort(-np.abs(correlation[first]))
            if k != first and abs(correlation[first, k]) >= TOGETHER
        ]
        if len(members) == 1 and len(unknowns) > 1:
            members.append(_closest(correlation, first))
        groups.append(_group(unknowns, covariance, theta, members))
        left = [k for k in left if k not in members]
    return tuple(groups), tuple(unidentifiable)


def _closest(correlation: Floats, first: int) -> int:
    others = np.abs(correlation[first])
    others[first] = 0.0
    return int(np.argmax(others))


def _group(unknowns: Sequence[Unknown], covariance: Floats, theta: Floats, members: Sequence[int]) -> Group:
    """How the members move while the first rises by `NUDGE` deviations of its prior."""
    first = members[0]
    by = []
    for k in members:
        unknown = unknowns[k]
        now = unknown.values(float(theta[k]))[0]
        then = unknown.values(float(theta[k] + NUDGE * covariance[k, first] / covariance[first, first]))[0]
        by.append(float(then - now))
    return Group(
        tuple(unknowns[k].name for k in members), tuple(by), tuple(unknowns[k].unit for k in members)
    )
