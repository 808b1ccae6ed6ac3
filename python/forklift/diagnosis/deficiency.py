"""Is the model deficient at all? What is left over, tested in every way in which a complete model's is not.

Of a complete model what is left over is the sensors' noise: of its size (goodness of fit), white, and related
to nothing that is known of the moment. Each test has a p-value; as there are many, they are corrected after
Holm (1979), so that a complete model fails any of them with a probability of at most `LEVEL`.

- Goodness of fit: mean square against the noise's, whose own estimate counts as one from `NOISE_SHARE` of
  the samples: F-distributed. Over all recordings of a channel, and in the worst of them.
- Whiteness: Ljung–Box, in the worst recording (Bonferroni); of an encoder none, as its rounding is not white
  while it moves slowly.
- Correlation with a variable: the residual e and the variable's columns g (with its lags) pass one filter
  that makes e white (autoregression; pre-whitening after Haugh 1976), and then

      q = bᵀA⁻¹b,  b = Σ gᵀe,  A = s² Σ gᵀg,  s² = mean e²

  is χ² with as many degrees as g has independent columns: the score test of a regression that was left out
  (Breusch & Pagan 1980). It is made noncentral by `SMALL` of the samples, so that a dependence must explain
  more than that share of the residual's square to count (Murphy & Myors 1999): the simulation is not exact
  itself. An encoder's residual is left out here, too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import toeplitz
from scipy.special import chndtr, fdtrc

from forklift.base.arrays import Floats
from forklift.fitting.residuals import ChannelResidual

LEVEL = 0.01
"""Probability that a complete model fails any test."""
NOISE_SHARE = 0.2
"""Of a channel's samples, as degrees of freedom of its noise's estimate. Over 40 simulated trucks the mean
square of 7,700 samples scattered by 3.5 %, which is 0.27."""
ORDER = 10
"""Most coefficients of the autoregression; how many are taken, Akaike's criterion says."""
SMALL = 0.002
"""Share of what is left over that a variable may explain. Between fixed and adaptive steps alone, the
fork height of 40 simulated trucks depended on how the resting lift bounces by up to 0.36 %."""
DEPENDENT = 1e-8
"""Columns whose square falls below this share of what it was beside the others tell nothing of their own."""

Columns = Mapping[str, Floats]
"""By variable: (samples of the recording, columns), what a residual is correlated with."""


@dataclass(frozen=True)
class Test:
    """One test of one channel."""

    __test__ = False  # no test of the test suite

    test: str
    """``"goodness of fit"``, ``"whiteness"`` or ``"correlation"``."""
    channel: str
    against: str
    """The variable, or the recording that is worst; empty: all recordings."""
    statistic: float
    """Mean square in units of noise; Ljung–Box's p in the worst recording; share of the residual's
    square that the variable explains."""
    p: float
    corrected: float
    """p after Holm."""

    @property
    def failed(self) -> bool:
        return self.corrected < LEVEL

    @property
    def sentence(self) -> str:
        """What its failure means."""
        where = f" in {self.against}" if self.against else ""
        if self.test == "goodness of fit":
            return f"{self.channel}: what is left over has {self.statistic:.3g} times the noise power{where}"
        if self.test == "whiteness":
            return f"{self.channel}: what is left over is not white{where} ({_p(self.p)})"
        return (
            f"{self.channel}: what is left over depends on the {self.against} "
            f"(which explains {100.0 * self.statistic:.2g} % of it, {_p(self.p)})"
        )


@dataclass(frozen=True)
class Deficiency:
    """All tests of one model, the worst first."""

    tests: tuple[Test, ...]

    @property
    def failures(self) -> tuple[Test, ...]:
        return tuple(test for test in self.tests if test.failed)

    @property
    def deficient(self) -> bool:
        return bool(self.failures)

    @property
    def sentence(self) -> str:
        """What failed, in words, the worst three first."""
        failed = self.failures
        if not failed:
            return (
                f"All {len(self.tests)} tests of what is left over pass: it is noise, as far as these "
                "recordings tell."
            )
        worst = "; ".join(test.sentence for test in failed[:3])
        more = f"; and {len(failed) - 3} more" if len(failed) > 3 else ""
        return f"{len(failed)} of {len(self.tests)} tests of what is left over fail: {worst}{more}."

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "deficient": self.deficient,
            "sentence": self.sentence,
            "level": LEVEL,
            "tests": [
                {
                    "test": test.test,
                    "channel": test.channel,
                    "against": test.against,
                    "statistic": test.statistic,
                    "p": test.p,
                    "p_corrected": test.corrected,
                    "failed": test.failed,
                }
                for test in self.tests
            ],
        }


@dataclass(frozen=True)
class _Raw:
    """A test before the correction."""

    test: str
    channel: str
    against: str
    statistic: float
    p: float


def deficiency(
    judged: Sequence[ChannelResidual], known: Mapping[str, Columns], encoders: Collection[str] = ()
) -> Deficiency:
    """Every test of what is left over.

    Parameters
    ----------
    judged
        Every channel of every recording, parameter uncertainty taken off.
    known
        By recording: what is known of its moments.
    encoders
        Channels whose error is rounding.
    """
    channels = list(dict.fromkeys(found.channel for found in judged))
    raw: list[_Raw] = []
    for channel in channels:
        own = [found for found in judged if found.channel == channel and np.any(found.left)]
        if own:
            raw += _goodness(channel, own)
            raw += _whiteness(channel, own)
            raw += [] if channel in encoders else _correlations(channel, own, known)
    corrected = holm([one.p for one in raw])
    tests = [
        Test(one.test, one.channel, one.against, one.statistic, one.p, p)
        for one, p in zip(raw, corrected, strict=True)
    ]
    return Deficiency(tuple(sorted(tests, key=lambda test: (test.corrected, test.p, -test.statistic))))


def holm(values: Sequence[float]) -> list[float]:
    """Holm's (1979) corrected p-values: the chance that any of the tests is as extreme."""
    corrected = np.ones(len(values))
    least = 0.0
    for rank, place in enumerate(np.argsort(values, kind="stable")):
        least = max(least, min(1.0, (len(values) - rank) * values[place]))
        corrected[place] = least
    return [float(p) for p in corrected]


def _goodness(channel: str, own: Sequence[ChannelResidual]) -> Iterator[_Raw]:
    samples = sum(found.samples for found in own)
    known = NOISE_SHARE * samples
    square = sum(found.samples * found.mean_square for found in own) / samples
    yield _Raw("goodness of fit", channel, "", square, float(fdtrc(samples, known, square)))
    each = [float(fdtrc(found.samples, known, found.mean_square)) for found in own]
    worst = max(range(len(own)), key=lambda k: (-each[k], own[k].mean_square))
    p = min(1.0, len(own) * each[worst])
    yield _Raw("goodness of fit", channel, own[worst].file, own[worst].mean_square, p)


def _whiteness(channel: str, own: Sequence[ChannelResidual]) -> Iterator[_Raw]:
    tested = [(found.whiteness, found.file) for found in own if found.whiteness is not None]
    if tested:
        p, file = min(tested)
        yield _Raw("whiteness", channel, file, p, min(1.0, len(tested) * p))


def _correlations(
    channel: str, own: Sequence[ChannelResidual], known: Mapping[str, Columns]
) -> Iterator[_Raw]:
    own = [found for found in own if known[found.file]]  # where nothing changes, nothing can be correlated
    if not own:
        return
    series = [found.series(len(next(iter(known[found.file].values())))) for found in own]
    whitening = autoregression(series)
    white = [_whitened(values, whitening) for values in series]
    samples = sum(found.samples for found in own)
    scale = sum(float(values @ values) for values in white) / samples
    for variable in dict.fromkeys(name for found in own for name in known[found.file]):
        b: Floats | float = 0.0
        a: Floats | float = 0.0
        for found, residual in zip(own, white, strict=True):
            given = known[found.file].get(variable)
            if given is not None:
                columns = np.apply_along_axis(_whitened, 0, found.at_samples(given), whitening)
                b = b + columns.T @ residual
                a = a + columns.T @ columns
        q, degrees = quadratic(np.atleast_1d(b), scale * np.atleast_2d(a))
        if degrees:
            p = max(0.0, float(1.0 - chndtr(q, degrees, SMALL * samples)))
            yield _Raw("correlation", channel, variable, q / samples, p)


def autoregression(series: Sequence[Floats], most: int = ORDER) -> Floats:
    """The filter (1, −φ₁, …, −φ_p) that makes these series white, from their pooled autocovariance.

    Yule–Walker; p between 0 and `most` by Akaike's criterion.
    """
    samples = sum(len(values) for values in series)
    most = min(most, min((len(values) for values in series), default=1) - 1)
    lags = range(most + 1)
    r = np.array([sum(float(v[k:] @ v[: len(v) - k]) for v in series) for k in lags]) / max(samples, 1)
    if not r[0] > 0.0:
        return np.ones(1)
    best, least = np.ones(1), samples * np.log(r[0])
    for order in range(1, most + 1):
        phi = np.linalg.solve(toeplitz(r[:order]) + 1e-10 * r[0] * np.eye(order), r[1 : order + 1])
        variance = float(r[0] - phi @ r[1 : order + 1])
        if variance > 0.0 and (score := samples * np.log(variance) + 2.0 * order) < least:
            best, least = np.r_[1.0, -phi], score
    return best


def _whitened(values: Floats, whitening: Floats) -> Floats:
    return np.convolve(values, whitening)[: len(values)]


def quadratic(b: Floats, a: Floats) -> tuple[float, int]:
    """bᵀA⁻¹b over the independent directions of A, and their number."""
    size = np.sqrt(np.diag(a))
    kept = np.flatnonzero(size > 0.0)
    if not len(kept):
        return 0.0, 0
    b, a = b[kept] / size[kept], a[np.ix_(kept, kept)] / np.outer(size[kept], size[kept])
    values, vectors = np.linalg.eigh(a)
    told = values > DEPENDENT * values[-1]
    return float(np.sum((vectors[:, told].T @ b) ** 2 / values[told])), int(told.sum())


def _p(p: float) -> str:
    return f"p = {p:.1g}" if p >= 1e-12 else "p below 1e-12"
