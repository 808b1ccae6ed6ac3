"""Along a canyon of the likelihood: Levenberg–Marquardt with geodesic acceleration.

Openings, critical Reynolds numbers and viscosity nearly make up for one another: the likelihood is a canyon,
ten thousand times longer than wide, and bent. A step that is straight leaves it after a hundredth of the way,
so that a trust region crawls. Here each step δ₁ is bent after it by δ₂ = −½ (JᵀJ + μ)⁻¹ Jᵀ r″, with r″ the
second derivative of the residuals along δ₁ from one further simulation (Transtrum & Sethna 2012, section 4).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError

if TYPE_CHECKING:
    from forklift.fitting.interface import Problem
    from forklift.fitting.limits import Limits
    from forklift.fitting.linearised import Products


PROBE = 0.1
"""Share of the step at which the second derivative is taken."""
BENT = 0.75
"""Largest 2|δ₂|/|δ₁| of an accepted step: beyond it the series is not to be trusted."""
DAMPING = 1.0
"""μ at the start, in units of the prior."""
RELAX, STIFFEN = 5.0, 3.0
"""μ is divided by the one after a step taken, multiplied by the other after one refused."""
MOST_REFUSED = 24
"""Refusals in a row after which it ends: μ has then grown by eleven orders of magnitude."""
LOST = 1e15
"""Beside an entry of the normal equations that is larger, the prior's 1 is lost in rounding. Slopes grow so
where a truck swings up by itself: no step leads on from there."""


@dataclass(frozen=True)
class Point:
    """A place with what a step from it needs."""

    x: Floats
    runs: list[Products]
    normal: Floats
    gradient: Floats
    cost: float

    @property
    def lost(self) -> bool:
        """Whether the slopes have grown beyond what a step can be worked out from."""
        return not float(np.diag(self.normal).max()) < LOST

    def step(self, limits: Limits, damping: float = 0.0) -> Floats:
        """The straight step within the limits."""
        return limits.step(self.normal + damping * np.eye(len(self.x)), self.gradient, self.x)

    def gain(self, step: Floats) -> float:
        """By how much a straight step would lower the cost."""
        return float(-step @ (self.gradient + 0.5 * self.normal @ step))


def descend(
    problem: Problem,
    x: Floats,
    evaluations: int,
    gain: float,
    progress: Callable[[float, Floats], None],
    share: float = 0.0,
    hopeless: Callable[[Sequence[float], int], bool] = lambda costs, left: False,
) -> Floats:
    """From x down to where a step lowers the cost, as predicted or twice in a row, by less than `gain`, or by
    less than this share of the cost; or until it is `hopeless`, given all costs so far and how many
    evaluations are left.

    Raises
    ------
    ForkliftError
        If x itself is impossible.
    """
    here = _point(problem, x)
    progress(here.cost, x)
    limits, damping, small = problem.limits(), DAMPING, 0
    costs = [here.cost]
    for done in range(1, evaluations):
        enough = max(gain, share * here.cost)
        if here.lost or small > 1 or here.gain(here.step(limits)) < enough:
            break
        if hopeless(costs, evaluations - done):
            break
        then, damping = _downhill(problem, here, limits, damping, enough)
        if then is None:
            break
        before, here = here.cost, then
        progress(here.cost, here.x)
        costs.append(here.cost)
        damping /= RELAX
        small = small + 1 if before - here.cost < enough else 0
    return here.x


def _point(problem: Problem, x: Floats) -> Point:
    """Normal equations, gathered recording by recording."""
    rho, slope = problem.prior(x)
    normal, gradient, square = np.diag(slope**2), slope * rho, float(rho @ rho)
    runs = problem.products(x)
    for k, run in enumerate(runs):
        place = problem.columns(k)
        normal[np.ix_(place, place)] += run.normal
        gradient[place] += run.gradient
        square += run.square
    return Point(x, runs, normal, gradient, 0.5 * square)


def _downhill(
    problem: Problem, here: Point, limits: Limits, damping: float, gain: float
) -> tuple[Point | None, float]:
    """Where the first of ever shorter steps leads that goes down, and its damping; None if there is nothing
    to gain."""
    for _ in range(MOST_REFUSED):
        straight = here.step(limits, damping)
        x = _taken(problem, here, limits, damping, straight)
        if x is not None and not (then := _point(problem, x)).lost:
            return then, damping
        if here.gain(straight) < gain:
            break
        damping *= STIFFEN
    return None, damping


def _taken(problem: Problem, here: Point, limits: Limits, damping: float, straight: Floats) -> Floats | None:
    """Where the bent step ends, if the cost is lower there."""
    matrix = here.normal + damping * np.eye(len(here.x))

    def bent() -> Floats:
        return limits.step(matrix, 0.5 * _curvature(problem, here, straight), here.x + straight)

    # The bent step first; the straight one only where the bend is not to be trusted: over the smallest steps
    # it is lost in the simulation's own roughness. Where a bend that is to be trusted leads nowhere, a
    # straight step hardly ever leads further.
    for bend in (bent, lambda: np.zeros_like(straight)):
        try:
            second = bend()
            if 2.0 * np.linalg.norm(second) <= BENT * np.linalg.norm(straight):
                then: Floats = np.clip(here.x + straight + second, *problem.bounds())  # against rounding
                return then if cost(problem, then) < here.cost else None
        except ForkliftError:  # no way there
            continue
    return None


def _curvature(problem: Problem, here: Point, step: Floats) -> Floats:
    """Jᵀ r″ along `step`."""
    ahead = here.x + PROBE * step
    rho, slope = problem.prior(here.x)
    there, _ = problem.prior(ahead)
    out: Floats = slope * (2.0 / PROBE) * ((there - rho) / PROBE - slope * step)
    for k, (run, residual) in enumerate(zip(here.runs, problem.residuals(ahead), strict=True)):
        place = problem.columns(k)
        bend = (2.0 / PROBE) * ((residual - run.residual) / PROBE - run.jacobian @ step[place])
        out[place] += run.jacobian.T @ bend
    return out


def cost(problem: Problem, x: Floats) -> float:
    """−ln posterior at x, up to a constant."""
    rho, _ = problem.prior(x)
    squares = (float(residual @ residual) for residual in problem.residuals(x))
    return 0.5 * (float(rho @ rho) + sum(squares))
