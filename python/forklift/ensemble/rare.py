"""Failures of a sweep that are too rare to count, and its worst case: both on its least scaled margin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.ensemble.members import Members, Streams
from forklift.ensemble.subset import LEAST_REPLICATES, RareFailures, subset_simulation

OUT = -1e3
"""Margin of a member without numbers, in scales: worse than any other."""


def margin_of(members: Members, uniform: Floats, streams: Streams) -> Floats:
    """(n,) the least scaled margin at uniform numbers (n, varied) and sequences of noise (n,)."""
    values = members.core.values(np.ascontiguousarray(uniform))
    _, numbers = members.core.run(values, streams)
    scales = np.array([require.scale for require in members.specification.require])
    least: Floats = np.min(numbers[:, : len(scales)] / scales, axis=1)
    return np.nan_to_num(least, nan=OUT, neginf=OUT)


def rare_failures(members: Members, *, size: int = 1000, runs: int = LEAST_REPLICATES) -> RareFailures:
    """The probability that a member of a sweep fails, by subset simulation; its noise moves with it.

    Parameters
    ----------
    size
        Members of a level.
    runs
        Independent ones.
    """
    from scipy.special import ndtr

    def margin(u: Floats, streams: Streams) -> Floats:
        return margin_of(members, np.clip(ndtr(u), 2.0**-54, 1.0 - 2.0**-53), streams)

    spec = members.specification
    return subset_simulation(margin, len(spec.vary), seed=spec.seed, members=size, runs=runs)


@dataclass(frozen=True)
class WorstCase:
    """What `worst_case` gives: the least scaled margin found, and where."""

    margin: float
    varied: dict[str, float]
    evaluations: int


def worst_case(members: Members, *, generations: int = 40, stream: int = 0) -> WorstCase:
    """The values within their ranges that come nearest to a failure, or fail the most.

    Differential evolution (Storn & Price 1997, as SciPy has it) with one sequence of noise, which is frozen:
    the worst case is that of the values, such as the levels of a reference. A search finds a case; it proves
    no bound.
    """
    from scipy.optimize import differential_evolution

    dimensions = len(members.specification.vary)

    def objective(u: Floats) -> Floats:
        streams = np.full(u.shape[1], stream, np.uint64)
        return margin_of(members, np.ascontiguousarray(u.T), streams)

    found = differential_evolution(
        objective,
        [(2.0**-54, 1.0 - 2.0**-53)] * dimensions,
        maxiter=generations,
        rng=np.random.default_rng(members.specification.seed),
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0.0,
    )
    values = members.core.values(found.x[None, :])[0]
    names = members.specification.vary
    return WorstCase(float(found.fun), dict(zip(names, map(float, values), strict=True)), int(found.nfev))
