"""Intervals of a failure probability that hold, one for each way of sampling.

Fixed number of independent members: `clopper_pearson`. Watched live and stopped at will:
`ConfidenceSequence`. Scrambled Sobol points: `over_scrambles`. Subset simulation: `over_replicates`. None of
them rests on a printed coefficient of variation; `proofs/sweep_intervals.py` counts how often each covers a
known probability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sqrt

import numpy as np

from forklift.base.arrays import Floats

LEVEL = 0.95
"""The usual level of an interval."""
LEAST_REPLICATES = 10
"""Fewer independent runs give a Student interval whose factor alone exceeds 2.3 (t of 8 degrees of
freedom)."""
SPENDING = 3
"""Power of the share of a planned run with which what may be missed is spent (Kim & DeMets 1987)."""


@dataclass(frozen=True)
class Interval:
    """A probability with its interval.

    Attributes
    ----------
    estimate, lower, upper
        Probabilities.
    level
        How often intervals of this kind hold the true value, at least where the method says so.
    method
        What kind of interval it is.
    """

    estimate: float
    lower: float
    upper: float
    level: float
    method: str

    def __contains__(self, probability: float) -> bool:
        return self.lower <= probability <= self.upper

    def to_dict(self) -> dict[str, float | str]:
        return {
            "estimate": self.estimate,
            "lower": self.lower,
            "upper": self.upper,
            "level": self.level,
            "method": self.method,
        }

    def __str__(self) -> str:
        return f"{self.estimate:.3g} ({100 * self.level:g} % interval {self.lower:.3g} to {self.upper:.3g})"


def clopper_pearson(failures: int, members: int, level: float = LEVEL) -> Interval:
    """The interval of a binomial share, for a number of independent members that was fixed beforehand.

    Its ends are where a binomial tail holds (1 − level)/2: it covers with at least `level` (Clopper &
    Pearson 1934). Without a failure, or without a success, all of 1 − level is given to the one end that
    there is, so that the upper end without failures is 1 − (1 − level)^(1/n), nearly 3/n; for a probability
    a little above that end it covers with half as much again missed, at most.

    Parameters
    ----------
    failures, members
        Counts; one member or more.
    """
    _counts(failures, members)
    lower, upper = _tails(failures, members, (1.0 - level) / 2.0)
    if failures == 0:
        upper = 1.0 - (1.0 - level) ** (1.0 / members)
    if failures == members:
        lower = (1.0 - level) ** (1.0 / members)
    return Interval(failures / members, lower, upper, level, "Clopper-Pearson")


class ConfidenceSequence:
    """Intervals that hold together at every moment of a run whose length is planned: one may look after
    every member, and stop at will.

    The interval is renewed at …, an eighth, a quarter, a half and all of the N members, or as soon as it can
    be; in between it stays, up to √2 times as wide as it might be. After n members a share (n/N)³ of what may
    be missed (1 − level) is spent (Lan & DeMets 1983; the power is Kim & DeMets 1987's, near O'Brien &
    Fleming), and each renewal is the Clopper-Pearson interval with what is spent since the one before, half
    of it on either side. All hold together with at least `level`, as their misses add up to 1 − level at
    most (repeated confidence intervals: Jennison & Turnbull 1989); they are intersected. The last has some
    7/8 of it, and is hardly wider than one that was looked at once.

    Parameters
    ----------
    planned
        The number of members at the end; more cannot be added.
    """

    def __init__(self, planned: int, level: float = LEVEL) -> None:
        if planned < 1:
            raise ValueError(f"{planned} members planned")
        self.planned, self.level = planned, level
        self.failures = self.members = 0
        self.lower, self.upper = 0.0, 1.0
        self._renewed = 0

    def add(self, failures: int, members: int) -> Interval:
        """More members have been seen, `failures` of them failed."""
        _counts(failures, members)
        if self.members + members > self.planned:
            raise ValueError(f"{self.members + members} members where {self.planned} were planned")
        self.failures, self.members = self.failures + failures, self.members + members
        if self._halvings(self.members) < self._halvings(self._renewed):
            missed = (1.0 - self.level) * (self._spent(self.members) - self._spent(self._renewed))
            lower, upper = _tails(self.failures, self.members, missed / 2.0)
            # Where the true value was lost before, the intersection may be empty: its nearest point stays.
            self.lower = min(max(self.lower, lower), self.upper)
            self.upper = max(min(self.upper, upper), self.lower)
            self._renewed = self.members
        return self.interval

    @property
    def interval(self) -> Interval:
        share = self.failures / self.members if self.members else 0.5
        return Interval(share, self.lower, self.upper, self.level, "confidence sequence")

    def _halvings(self, members: int) -> int:
        """How often the planned number is halved before it is no more than so many."""
        return (-(-self.planned // members) - 1).bit_length() if members else self.planned.bit_length() + 1

    def _spent(self, members: int) -> float:
        return (members / self.planned) ** SPENDING


def over_scrambles(shares: Sequence[float], level: float = LEVEL) -> Interval:
    """Student's interval of the mean over independent scrambles of a Sobol sequence, cut off at 0 and 1.

    Points of one scramble depend on each other, so that only the scrambles count (Owen 1997; L'Ecuyer et al.
    2023: 16 or more). Where all n are alike no scatter shows, and each end lies 1 − ((1 − level)/2)^(1/n) of
    the way to 0 or 1: n shares that are at most s have a probability of (1 − P)^n where one is above s with
    P, and their mean is at most s + (1 − s) P. At 0 or 1 the one end that is left has all of 1 − level.
    """
    found = np.asarray(shares, np.float64)
    if (end := _one_end(found, level, "scrambles")) is not None:
        return end
    if len(found) > 1 and np.ptp(found) == 0.0:
        share, far = float(found[0]), 1.0 - (0.5 * (1.0 - level)) ** (1.0 / len(found))
        upper = share + (1.0 - share) * far
        return Interval(share, share * (1.0 - far), upper, level, f"{len(found)} scrambles, all alike")
    mean, half = _student(found, level)
    return Interval(
        mean, max(mean - half, 0.0), min(mean + half, 1.0), level, f"t over {len(found)} scrambles"
    )


def _one_end(found: Floats, level: float, what: str) -> Interval | None:
    """The interval of a mean p of independent shares that are all 0, or all 1; None of others.

    A share is at most 1, so that it is above 0 with a probability of p at least: n that are all 0 have one of
    (1 − p)^n at most, which 1 − level rules out above p = 1 − (1 − level)^(1/n). No scatter shows, so that
    Student's interval would have no width.
    """
    n, method = len(found), f"{len(found)} {what}, all alike"
    far = 1.0 - (1.0 - level) ** (1.0 / n)
    if not found.any():
        return Interval(0.0, 0.0, far, level, method)
    if (found == 1.0).all():
        return Interval(1.0, 1.0 - far, 1.0, level, method)
    return None


def over_replicates(probabilities: Sequence[float], level: float = LEVEL) -> Interval:
    """The interval of a probability from independent runs of subset simulation, on the logarithm.

    The estimates are right in the mean and nearly lognormal, so that their mean is exp(m + s²/2) and the
    variance of its logarithm s²/n + s⁴/(2 (n − 1)), with mean m and variance s² of the logarithms (Cox's
    interval: Zhou & Gao 1997; with Student's factor: Olsson 2005). Where some runs missed a part of the
    failures their logarithms have a long tail, of which that is no mean: the interval is then widened to
    Student's of the runs themselves, cut off at 0. A run that found no failure makes the lower end 0.

    Parameters
    ----------
    probabilities
        One estimate of each run; `LEAST_REPLICATES` or more.
    """
    from scipy.stats import t

    found = np.asarray(probabilities, np.float64)
    n = len(found)
    if n < 2:
        raise ValueError("an interval over replicates needs two of them or more")
    mean = float(found.mean())
    if (end := _one_end(found, level, "runs")) is not None:
        return end
    if (found <= 0.0).any():
        _, half = _student(found, level)
        return Interval(mean, 0.0, min(mean + half, 1.0), level, f"t over {n} runs, some without a failure")
    logs = np.log(found)
    m, s2 = float(logs.mean()), float(logs.var(ddof=1))
    half = float(t.ppf(0.5 + level / 2.0, n - 1)) * sqrt(s2 / n + s2 * s2 / (2.0 * (n - 1)))
    middle = m + s2 / 2.0
    lower, upper, method = exp(middle - half), exp(middle + half), f"t on ln p over {n} runs"
    if not lower <= mean <= upper:
        _, plain = _student(found, level)
        lower, upper = max(min(lower, mean - plain), 0.0), max(upper, mean + plain)
        method = f"t over {n} runs, some far below the others"
    return Interval(mean, lower, min(upper, 1.0), level, method)


def _student(found: np.ndarray, level: float) -> tuple[float, float]:
    from scipy.stats import t

    n = len(found)
    if n < 2:
        raise ValueError("an interval over replicates needs two of them or more")
    half = float(t.ppf(0.5 + level / 2.0, n - 1)) * float(found.std(ddof=1)) / sqrt(n)
    return float(found.mean()), half


def _tails(failures: int, members: int, tail: float) -> tuple[float, float]:
    """The probabilities at which a binomial number is so large, and so small, with `tail`."""
    from scipy.stats import beta

    lower = float(beta.ppf(tail, failures, members - failures + 1)) if failures else 0.0
    upper = float(beta.isf(tail, failures + 1, members - failures)) if failures < members else 1.0
    return lower, upper


def _counts(failures: int, members: int) -> None:
    if not 0 <= failures <= members or members < 1:
        raise ValueError(f"{failures} failures of {members} members")
