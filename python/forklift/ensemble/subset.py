"""Subset simulation: probabilities too small to count failures of independent members.

A probability is a product of larger ones, of a margin falling below one threshold after the other; each
level is explored by Markov chains that start from what the level before found (Au & Beck 2001). The chains
propose by conditional sampling in standard normal space (Papaioannou et al. 2015). Noise belongs to a member
and moves with it, as an independent proposal. Where margins jump, ties are broken by one more uniform number
of the member that moves too, so that every level has the share it is meant to have (Walter 2015).

Every random number is a function of seed, run, level and step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.ensemble.intervals import LEAST_REPLICATES, LEVEL, Interval, over_replicates

Streams = NDArray[np.uint64]
Margin = Callable[[Floats, Streams], Floats]
"""Margins (n,) of members at standard normal coordinates (n, d) and sequences of noise (n,); negative is a
failure."""

SHARE = 0.1
"""Of a level that lies below the next threshold (Au & Beck 2001, section 4: 0.1)."""
CORRELATION = 0.8
"""Between a member and its proposal: near where the acceptance is 0.44 (Papaioannou et al. 2015, section
4)."""
MOST_LEVELS = 20
"""After which a run is given up: a probability below SHARE^20."""


@dataclass(frozen=True, eq=False)
class Level:
    """Where a run stands: the members of one level.

    Attributes
    ----------
    number
        0 for the independent members.
    u, stream, jitter, margin
        (n, d) coordinates, (n,) sequences of noise, (n,) uniform numbers that break ties, (n,) margins.
    log_p
        ln of the probability of the level's threshold.
    probability
        The estimate, once the run has ended; 0 if it was given up.
    """

    number: int
    u: Floats
    stream: Streams
    jitter: Floats
    margin: Floats
    log_p: float = 0.0
    probability: float | None = None


@dataclass(frozen=True)
class RareFailures:
    """What `subset_simulation` gives: a probability with an interval over independent runs.

    Attributes
    ----------
    probabilities, levels
        Of each run: its estimate, and how many levels it took.
    evaluations
        Members run.
    likeliest
        Of all failures that the last levels hold the one nearest to the middle, in standard normal
        coordinates, where members are densest (the design point of Hasofer & Lind 1974, as far as it was
        sampled): its coordinates (d,), and its sequence of noise. None if no run came to a failure with a
        margin that is finite.
    """

    interval: Interval
    probabilities: tuple[float, ...]
    levels: tuple[int, ...]
    evaluations: int
    likeliest: tuple[Floats, int] | None = None


def subset_simulation(
    margin: Margin,
    dimensions: int,
    *,
    seed: int,
    members: int = 1000,
    runs: int = LEAST_REPLICATES,
    level: float = LEVEL,
    ended: Callable[[int], None] | None = None,
) -> RareFailures:
    """The probability that a margin is negative, from independent runs of subset simulation.

    Parameters
    ----------
    margin
        Must fall without steps towards the failures: a peak less its bound, not a verdict.
    dimensions
        d of the standard normal coordinates.
    members
        Of each level; a multiple of 1/`SHARE`.
    runs
        Independent ones; ten or more give an interval that holds.
    ended
        Called after each with how many are over.
    """
    last = []
    for run in range(runs):
        last.append(list(levels(margin, dimensions, seed=seed, run=run, members=members))[-1])
        if ended:
            ended(run + 1)
    probabilities = tuple(float(one.probability or 0.0) for one in last)
    taken = sum(members + one.number * (members - round(SHARE * members)) for one in last)
    return RareFailures(
        over_replicates(probabilities, level),
        probabilities,
        tuple(one.number for one in last),
        taken,
        _likeliest(last),
    )


def levels(
    margin: Margin,
    dimensions: int,
    *,
    seed: int,
    run: int,
    members: int = 1000,
) -> Iterator[Level]:
    """One run, level by level; the last has its probability."""
    seeds = round(SHARE * members)
    if seeds < 1 or members % seeds:
        raise ValueError(
            f"{members} members cannot be chains of {seeds} seeds; take a multiple of {1 / SHARE:g}"
        )
    draw = _numbers(seed, run, 0, 0)
    u = draw.standard_normal((members, dimensions))
    stream, jitter = _streams(draw, members), draw.random(members)
    level = _judged(Level(0, u, stream, jitter, margin(u, stream)))
    yield level
    while level.probability is None:
        level = _judged(_next(margin, level, seed, run, seeds))
        yield level


def _likeliest(last: Sequence[Level]) -> tuple[Floats, int] | None:
    """Of the failures that these levels hold, the one nearest to the middle."""
    failed = [(one.margin < 0.0) & np.isfinite(one.margin) for one in last]
    u = np.concatenate([one.u[which] for one, which in zip(last, failed, strict=True)])
    stream = np.concatenate([one.stream[which] for one, which in zip(last, failed, strict=True)])
    if not len(u):
        return None
    nearest = int(np.argmin((u * u).sum(axis=1)))
    return u[nearest], int(stream[nearest])


def _judged(level: Level) -> Level:
    """With its probability, if enough of it fails."""
    failed = int((level.margin < 0.0).sum())
    if failed >= SHARE * len(level.margin):
        return replace(level, probability=float(np.exp(level.log_p) * failed / len(level.margin)))
    return replace(level, probability=0.0) if level.number == MOST_LEVELS else level


def _next(margin: Margin, level: Level, seed: int, run: int, seeds: int) -> Level:
    """The members below the threshold that the worst of a level set."""
    members, dimensions = level.u.shape
    order = np.lexsort((level.jitter, level.margin))
    # The best of the seeds is the threshold: a pair, so that no two members are alike.
    worst = order[:seeds]
    threshold = level.margin[worst[-1]], level.jitter[worst[-1]]
    u, stream, jitter, found = level.u[worst], level.stream[worst], level.jitter[worst], level.margin[worst]
    kept = [(u, stream, jitter, found)]
    for step in range(1, members // seeds):
        draw = _numbers(seed, run, level.number + 1, step)
        moved = draw.standard_normal((seeds, dimensions))
        new_u = CORRELATION * u + np.sqrt(1.0 - CORRELATION**2) * moved
        new_stream, new_jitter = _streams(draw, seeds), draw.random(seeds)
        new = margin(new_u, new_stream)
        below = (new < threshold[0]) | ((new == threshold[0]) & (new_jitter <= threshold[1]))
        u = np.where(below[:, None], new_u, u)
        stream, jitter = np.where(below, new_stream, stream), np.where(below, new_jitter, jitter)
        found = np.where(below, new, found)
        kept.append((u, stream, jitter, found))
    log_p = level.log_p + float(np.log(seeds / members))
    return Level(
        level.number + 1,
        np.concatenate([one[0] for one in kept]),
        np.concatenate([one[1] for one in kept]),
        np.concatenate([one[2] for one in kept]),
        np.concatenate([one[3] for one in kept]),
        log_p,
    )


def _numbers(seed: int, run: int, level: int, step: int) -> np.random.Generator:
    """The random numbers of one step (Philox, Salmon et al. 2011)."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, run, level, step))))


def _streams(draw: np.random.Generator, count: int) -> Streams:
    """Sequences of noise, each a number of its own."""
    return draw.integers(0, 2**62, count, dtype=np.uint64)
