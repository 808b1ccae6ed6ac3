"""Profile likelihoods: one parameter held at values around its estimate, all others refitted.

Where the profile is no parabola, the interval of the normal approximation is wrong, and the profile's own,
where −2 ln L rises by 3.84 (Wilks 1938), is given beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.fitting.intervals import QUANTILE

if TYPE_CHECKING:
    from forklift.fitting.interface import Problem


POINTS = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Where the profile is taken, in standard deviations from the estimate."""

REFITS = 3
"""Most Gauss–Newton steps of the others at each point."""


@dataclass(frozen=True)
class Profile:
    """The profile of one unknown."""

    name: str
    values: Floats
    """Of the parameter, rising; the estimate among them."""
    rise: Floats
    """Of −2 ln posterior above its least."""
    lower: float
    """95 % interval from the profile; NaN where it does not rise far enough within three deviations."""
    upper: float


def profile(problem: Problem, x: Floats, k: int, deviation: float) -> Profile:
    """The profile of shared unknown number `k` around the optimum x of `problem`.

    Raises
    ------
    ForkliftError
        If a run fails; a truck that is impossible at a point only ends the profile there.
    """
    residual, _ = problem.compressed(x)
    least = float(residual @ residual)
    thetas, rises = [x[k]], [0.0]
    for side in (-1.0, 1.0):
        at = x
        for point in sorted((p for p in POINTS if p * side > 0), key=abs):
            theta = x[k] + point * deviation
            if not problem.unknowns[k].lower < theta < problem.unknowns[k].upper:
                break
            try:
                at, rise = _held(problem, at, k, theta, least)
            except ForkliftError:
                break
            thetas.append(theta)
            rises.append(rise)
    order = np.argsort(thetas)
    thetas_sorted, rise_sorted = np.array(thetas)[order], np.array(rises)[order]
    unknown = problem.unknowns[k]
    values = np.array([unknown.values(float(theta))[0] for theta in thetas_sorted])
    ends = [_crossing(thetas_sorted, rise_sorted, x[k], side) for side in (-1.0, 1.0)]
    lower, upper = (float(unknown.values(end)[0]) if np.isfinite(end) else float("nan") for end in ends)
    if values[-1] < values[0]:  # the scale falls: ln cos of an angle
        return Profile(unknown.name, values[::-1], rise_sorted[::-1], upper, lower)
    return Profile(unknown.name, values, rise_sorted, lower, upper)


def _held(problem: Problem, x: Floats, k: int, theta: float, least: float) -> tuple[Floats, float]:
    """The best point with unknown k at `theta`, and the rise there."""
    others = np.delete(np.arange(len(x)), k)
    at = x.copy()
    residual, jacobian = problem.compressed(at)
    # Along with k, the others move as the linearised optimum does.
    at[others] -= np.linalg.lstsq(
        jacobian[:, others], residual + jacobian[:, k] * (theta - at[k]), rcond=None
    )[0]
    at[k] = theta
    lower, upper = problem.bounds()
    at = np.clip(at, lower, upper)
    best, best_at = np.inf, at
    for _ in range(REFITS):
        residual, jacobian = problem.compressed(at)
        cost = float(residual @ residual)
        gain = best - cost
        if cost < best:
            best, best_at = cost, at
        if gain < 0.02:
            break
        step = np.zeros(len(at))
        step[others] = -np.linalg.lstsq(jacobian[:, others], residual, rcond=None)[0]
        at = np.clip(at + step, lower, upper)
        at[k] = theta
    return best_at, max(best - least, 0.0)


def _crossing(thetas: Floats, rise: Floats, centre: float, side: float) -> float:
    """Where the profile crosses 3.84 on one side: √rise is interpolated, which is straight for a parabola."""
    here = thetas[(thetas - centre) * side >= 0.0]
    root = np.sqrt(rise[(thetas - centre) * side >= 0.0])
    order = np.argsort(side * here)
    here, root = here[order], np.maximum.accumulate(root[order])
    if root[-1] < QUANTILE:
        return float("nan")
    after = int(np.argmax(root >= QUANTILE))
    share = (QUANTILE - root[after - 1]) / (root[after] - root[after - 1])
    return float(here[after - 1] + share * (here[after] - here[after - 1]))
