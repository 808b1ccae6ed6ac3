"""Several starts: the same search from scattered values, and whether all end in the same place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.fitting.intervals import inverse
from forklift.fitting.search import Found, Progress, search

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from forklift.fitting.interface import Problem
    from forklift.fitting.problem import LeastSquares
    from forklift.recordings.noise import Sensor


SCATTER = 0.4
"""Standard deviation of a scattered start, in those of the prior: parameters by 20 %, knots by 14 mA."""

SAME_COST = 2.0
"""Two ends are the same place if their costs differ by less than this: a likelihood ratio of e²."""
SAME_PLACE = 1.0
"""And if no unknown differs by more than this many standard deviations."""


@dataclass(frozen=True)
class End:
    """Where one start ended."""

    start: int
    cost: float
    """−ln posterior with the best end's weights, less the best's; infinite if the search failed."""
    distance: float
    """From the best end: the largest over the shared unknowns, in their standard deviations."""
    same: bool


@dataclass(frozen=True)
class Ends:
    """The best end, and how the others compare."""

    best: Found
    ends: tuple[End, ...]


def from_starts(
    problem: LeastSquares,
    sensors: Mapping[str, Sensor],
    count: int,
    seed: int,
    progress: Callable[[int], Progress | None] = lambda _: None,
    earlier: Found | None = None,
) -> Ends:
    """Search from the machine itself (unless that was done `earlier`) and from `count` − 1 scattered ones.

    Raises
    ------
    ForkliftError
        Of the search from the machine itself, if no other start succeeds either.
    """
    found: list[Found | None] = [earlier] if earlier else []
    first: ForkliftError | None = None
    for start in range(len(found), count):
        try:
            found.append(search(problem, scattered(problem, start, seed), sensors, progress=progress(start)))
        except ForkliftError as error:
            first = first or error
            found.append(None)
    good = [end for end in found if end is not None]
    if not good:
        assert first is not None
        raise first
    return compare_ends(good, found)


def scattered(problem: LeastSquares, start: int, seed: int) -> Floats:
    """Where start number `start` begins: 0 is the machine itself; nearer to it where knots would cross."""
    x = np.zeros(problem.starts[-1])
    if start:
        shared = len(problem.unknowns)
        random = np.random.default_rng([seed, start])
        lower, upper = (bound[:shared] for bound in problem.bounds())
        x[:shared] = np.clip(SCATTER * random.standard_normal(shared), 0.9 * lower, 0.9 * upper)
        while not _possible(problem, x[:shared]):
            x[:shared] *= 0.8
    return x


def _possible(problem: LeastSquares, theta: Floats) -> bool:
    try:
        problem.machine.check(problem.values(theta))
    except ForkliftError:
        return False
    return True


def compare_ends(good: Sequence[Found], found: Sequence[Found | None]) -> Ends:
    """The best of the ends, and the others measured from it."""
    # Each search weighted the channels by its own residuals: compare with the smallest of these weights.
    sharpest = {name: min(end.problem.sigma[name] for end in good) for name in good[0].problem.sigma}
    common = good[0].problem.weighted(sharpest)
    costs = [_cost(common, end) for end in good]
    best = good[int(np.argmin(costs))]
    least = min(costs)
    shared = len(best.problem.unknowns)
    deviation = np.sqrt(np.diag(inverse(best.jacobian.T @ best.jacobian))[:shared])
    ends = []
    for number, end in enumerate(found):
        if end is None:
            ends.append(End(number, float("inf"), float("inf"), False))
            continue
        cost = costs[[candidate is end for candidate in good].index(True)] - least
        distance = float(np.max(np.abs(end.x - best.x)[:shared] / deviation))
        ends.append(End(number, float(cost), distance, bool(cost < SAME_COST and distance < SAME_PLACE)))
    return Ends(best, tuple(ends))


def _cost(problem: Problem, end: Found) -> float:
    residual, _ = problem.compressed(end.x)
    return 0.5 * float(residual @ residual)
