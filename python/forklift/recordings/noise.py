"""What a sensor adds to the truth: noise and counts, measured on the samples themselves.

A channel that only ever reads whole multiples of one step, and has no noise to speak of beside it, is an
incremental encoder, rounded down: what it reads is an interval, not a value with noise. Of any other channel
the noise is the part that sixth differences leave: they take away whatever a polynomial of fifth order
follows over seven samples (of an oscillation of 2.5 Hz sampled at 50 Hz, a thousandth is left), and leave
white noise √924-fold. Noise that is not white shows while everything rests, before the first command.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import comb, sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import brentq

from forklift.base.arrays import Floats
from forklift.recordings.clocks import EVEN, Sampled, broken_at_gaps, is_even

DIFFERENCES = 6


NORMAL_MAD = 0.6744897501960817
"""Median of |x| of a standard normal x."""


COUNT_PRECISION = 0.02
"""How exactly, in counts, readings must be multiples of the count to be taken for an encoder's."""


CLIPPED = 3.0
"""Differences beyond this many standard deviations are motion, or odd samples."""


CLIPPED_VARIANCE = 0.9733369
"""Variance of a standard normal x, given |x| < `CLIPPED`."""


COLOURED = 1.2
"""Noise at rest is coloured if its variance is this many times the white part's. It is a property of a kind
of sensor: the least correlation of all channels of a unit counts, and of one channel alone none, since a lift
that leaks moves before it is commanded to."""


MEDIAN_EFFICIENCY = 0.637
"""2/π: of how many samples' mean the median of them is as good."""


MOST_CORRELATED = 0.9
"""Slower than this, short rests cannot tell it from drift."""


COLOUR_STEP_S = 0.02
"""The step over which the correlation of channels at several rates is compared: of the usual 50 Hz [s]."""


@dataclass(frozen=True)
class Sensor:
    """One channel's sensor, the same in all recordings of a campaign."""

    channel: str
    noise: float
    """Standard deviation of its noise, in the channel's unit; of an encoder: count / √12."""
    count: float
    """Step of an encoder that rounds down, in the channel's unit; 0 where it is none."""
    correlation: float = 0.0
    """ρ of its noise from one sample to the next, that of ρᵏ over k samples; 0 if it is white."""
    unsure: float = 0.0
    """Standard deviation of the noise's variance as a share of it: what short rests leave open of slow noise;
    that of white noise is told by every sample."""
    step_s: float = COLOUR_STEP_S
    """From one of its samples to the next [s]."""

    @property
    def independent(self) -> float:
        """Of n samples' squares the mean scatters as that of this share of n independent ones."""
        return (1.0 - self.correlation**2) / (1.0 + self.correlation**2)

    @property
    def together(self) -> float:
        """How many times as much as white noise of the same size its slow part has."""
        return (1.0 + self.correlation) / (1.0 - self.correlation)


def correlation(ratio: float, length: int) -> float:
    """ρ of an autoregression of order one whose stretches of so many samples have a median variance of
    `ratio` times what sixth differences leave of it; 0 for white noise.

    A short stretch has less than the whole variance: its own mean is taken off, and the median of few
    independent squares lies below their mean (Wilson & Hilferty 1931).
    """

    def off(rho: float) -> float:
        together = (1.0 + rho) / (1.0 - rho)
        mean = together / length - 2.0 * rho * (1.0 - rho**length) / (length * (1.0 - rho)) ** 2
        freedom = max(length / together - 1.0, 1.0)
        return float((1.0 - 2.0 / (9.0 * freedom)) ** 3 * (1.0 - mean) / share_left(rho) - ratio)

    if ratio < COLOURED or off(0.0) >= 0.0:
        return 0.0
    return float(brentq(off, 0.0, MOST_CORRELATED)) if off(MOST_CORRELATED) > 0.0 else MOST_CORRELATED


def share_left(rho: float) -> float:
    """Share of the variance of such noise that sixth differences leave."""
    lags = np.arange(-DIFFERENCES, DIFFERENCES + 1)
    weights = (-1.0) ** lags * np.array([comb(2 * DIFFERENCES, DIFFERENCES + lag) for lag in lags])
    return float(weights @ rho ** np.abs(lags)) / comb(2 * DIFFERENCES, DIFFERENCES)


def over(rho: float, step_s: float, other_s: float) -> float:
    """The correlation over another step of noise whose correlation over `step_s` is ρ."""
    return rho if abs(other_s / step_s - 1.0) < EVEN else float(rho ** (other_s / step_s))


def encoder_count(columns: Iterable[Floats]) -> float:
    """The step of which all finite samples are whole multiples; 0 if there is no such step worth the name.

    A step that divides the signal into less than two samples a level tells nothing: it is a resolution of
    the recording, and part of its noise.
    """
    levels = np.unique(np.concatenate([column[np.isfinite(column)] for column in columns]))
    samples = sum(int(np.isfinite(column).sum()) for column in columns)
    if len(levels) < 3 or 2 * len(levels) > samples:
        return 0.0
    gaps = np.diff(levels)
    step = float(np.mean(gaps[gaps < 1.5 * gaps.min()]))  # a file's decimals round each gap
    if not gaps.min() > 0.5 * step:
        return 0.0
    for _ in range(3):  # the multiples grow exact together with the step
        multiples = np.round((levels - levels[0]) / step)
        if multiples[-1] == 0:
            return 0.0
        step = float((levels[-1] - levels[0]) / multiples[-1])
    off = np.abs((levels - levels[0]) / step - multiples)
    return step if off.max() < COUNT_PRECISION else 0.0


def white_noise(columns: Iterable[Floats]) -> float:
    """Standard deviation of the white noise in evenly sampled columns, in their unit.

    From the sixth differences within `CLIPPED` standard deviations: steps and odd samples do not count.
    """
    return _white([np.diff(column, DIFFERENCES) for column in columns])


def noise_of(columns: Iterable[Sampled]) -> float:
    """Standard deviation of the white noise of one channel in several recordings, from its own samples.

    Where the clock is uneven, divided differences of its own instants stand for the sixth differences, scaled
    so that white noise comes out as large. None reaches across a gap of the clock.
    """
    return _white([_differences(broken_at_gaps(column)) for column in columns])


def _differences(found: Sampled) -> Floats:
    """Sixth differences, at the instants that the samples have."""
    n = DIFFERENCES + 1
    if is_even(found.time) or len(found.time) < n:
        return np.diff(found.values, DIFFERENCES)
    time = sliding_window_view(found.time, n)
    apart = (time[:, :, None] - time[:, None, :]) / found.step_s
    apart[:, range(n), range(n)] = 1.0
    weights = 1.0 / np.prod(apart, axis=2)
    weights *= sqrt(comb(2 * DIFFERENCES, DIFFERENCES)) / np.linalg.norm(weights, axis=1, keepdims=True)
    return np.asarray(np.sum(weights * sliding_window_view(found.values, n), axis=1))


def _white(differences: list[Floats]) -> float:
    """Standard deviation of the white noise whose sixth differences these are."""
    pooled = np.concatenate([column[np.isfinite(column)] for column in differences])
    if not len(pooled):
        return 0.0
    size = float(np.median(np.abs(pooled))) / NORMAL_MAD
    for _ in range(5):
        near = pooled[np.abs(pooled) <= CLIPPED * size]
        size = float(np.sqrt(np.mean(near**2) / CLIPPED_VARIANCE)) if len(near) else size
    return size / sqrt(comb(2 * DIFFERENCES, DIFFERENCES))
