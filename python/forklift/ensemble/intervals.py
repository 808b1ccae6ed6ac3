"""Intervals of a failure probability that hold, one for each way of sampling.

Fixed number of independent members: `clopper_pearson`. Watched live and stopped at will:
`ConfidenceSequence`. Scrambled Sobol points: `over_scrambles`. Subset simulation: `over_replicates`. None of
them rests on a
printed coefficient of variation; `proofs/sweep_intervals.py` counts how often each covers a known
probability.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, sqrt

import numpy as np

LEVEL = 0.95
"""The usual level of an interval."""
LEAST_REPLICATES = 10
"""Fewer independent runs give a Student interval whose factor alone exceeds 2.3 (t of 8 degrees of
freedom)."""


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
    Pearson 1934). Without a failure, or without a success, all of 1 − level is given to the one end that is
    open, so that the upper end without failures is 1 − (1 − level)^(1/n), nearly 3/n.

    Parameters
    ----------
    failures, members
        Counts; one member or more.
    """
    from scipy.stats import beta

    _counts(failures, members)
    tail = (1.0 - level) / 2.0
    lower = float(beta.ppf(tail, failures, members - failures + 1)) if failures else 0.0
    upper = float(beta.ppf(1.0 - tail, failures + 1, members - failures)) if failures < members else 1.0
    if failures == 0:
        upper = 1.0 - (1.0 - level) ** (1.0 / members)
    if failures == members:
        lower = (1.0 - level) ** (1.0 / members)
    return Interval(failures / members, lower, upper, level, "Clopper-Pearson")


class ConfidenceSequence:
    """Intervals that hold at all times together: one may look after every member, and stop at will.

    A beta distribution as the alternative mixes all probabilities; the likelihood ratio of that mixture to a
    true p is a martingale that starts at 1, so that it ever exceeds 1/(1 − level) with a probability of at
    most 1 − level (Ville 1939). The interval holds those p whose ratio does not (Robbins 1970; Waudby-Smith
    & Ramdas
    2024, section
    3), and all earlier intervals are intersected.
    """

    def __init__(self, level: float = LEVEL, prior: tuple[float, float] = (0.5, 0.5)) -> None:
        self.level, self.prior = level, prior
        self.failures = self.members = 0
        self.lower, self.upper = 0.0, 1.0

    def add(self, failures: int, members: int) -> Interval:
        """More members have been seen, `failures` of them failed."""
        _counts(failures, members)
        self.failures, self.members = self.failures + failures, self.members + members
        lower, upper = self._now()
        # Where the true value was lost before, the intersection may be empty: its nearest point stays.
        self.lower = min(max(self.lower, lower), self.upper)
        self.upper = max(min(self.upper, upper), self.lower)
        return self.interval

    @property
    def interval(self) -> Interval:
        share = self.failures / self.members if self.members else 0.5
        return Interval(share, self.lower, self.upper, self.level, "confidence sequence")

    def _now(self) -> tuple[float, float]:
        from scipy.optimize import brentq
        from scipy.special import betaln

        a, b = self.prior
        good = self.members - self.failures
        mixed = float(betaln(a + self.failures, b + good) - betaln(a, b)) + log(1.0 - self.level)

        def beyond(p: float) -> float:
            # Nothing of what never happened, whose logarithm may be infinite.
            return mixed - (self.failures * log(p)) - (good * float(np.log1p(-p)) if good else 0.0)

        share = self.failures / self.members
        tiny = 1e-300
        lower = 0.0 if self.failures == 0 else float(brentq(beyond, tiny, share, xtol=1e-15 * share))
        upper = 1.0
        if self.failures < self.members:
            start = max(share, tiny)
            upper = float(brentq(beyond, start, 1.0 - 1e-16, xtol=1e-12 * max(share, 1.0 / self.members)))
        return lower, upper


def over_scrambles(shares: Sequence[float], level: float = LEVEL) -> Interval:
    """Student's interval of the mean over independent scrambles of a Sobol sequence, cut off at 0 and 1.

    Points of one scramble depend on each other, so that only the scrambles count (Owen 1997; L'Ecuyer et al.
    2023:
    16 or more).
    """
    found = np.asarray(shares, np.float64)
    mean, half = _student(found, level)
    return Interval(
        mean, max(mean - half, 0.0), min(mean + half, 1.0), level, f"t over {len(found)} scrambles"
    )


def over_replicates(probabilities: Sequence[float], level: float = LEVEL) -> Interval:
    """The interval of a probability from independent runs of subset simulation, on the logarithm.

    The estimates are right in the mean and nearly lognormal, so that their mean is exp(m + s²/2) and the
    variance of its logarithm s²/n + s⁴/(2 (n − 1)), with mean m and variance s² of the logarithms (Cox's
    interval: Zhou
    & Gao
    1997; with Student's factor: Olsson 2005). A run that found no failure makes the lower end 0.

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
    if (found <= 0.0).any():
        _, half = _student(found, level)
        return Interval(mean, 0.0, min(mean + half, 1.0), level, f"t over {n} runs, some without a failure")
    logs = np.log(found)
    m, s2 = float(logs.mean()), float(logs.var(ddof=1))
    half = float(t.ppf(0.5 + level / 2.0, n - 1)) * sqrt(s2 / n + s2 * s2 / (2.0 * (n - 1)))
    middle = m + s2 / 2.0
    return Interval(mean, exp(middle - half), min(exp(middle + half), 1.0), level, f"t on ln p over {n} runs")


def _student(found: np.ndarray, level: float) -> tuple[float, float]:
    from scipy.stats import t

    n = len(found)
    if n < 2:
        raise ValueError("an interval over replicates needs two of them or more")
    half = float(t.ppf(0.5 + level / 2.0, n - 1)) * float(found.std(ddof=1)) / sqrt(n)
    return float(found.mean()), half


def _counts(failures: int, members: int) -> None:
    if not 0 <= failures <= members or members < 1:
        raise ValueError(f"{failures} failures of {members} members")
