"""What each sensor of a campaign adds to the truth: noise and counts, told from the samples themselves.

A channel that only ever reads whole multiples of one step, and has no noise to speak of beside it, is an
incremental encoder, rounded down: what it
reads is an interval, not a value with noise. Of any other channel the noise is the part that sixth
differences leave: they take away whatever a polynomial of fifth order follows over seven samples (of an
oscillation of 2.5 Hz sampled at 50 Hz, a thousandth is left), and leave white noise √924-fold. Noise that is
not white shows while everything rests, before the first command.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import comb, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from forklift import _core
from forklift.plant.forklift.tables import channels

if TYPE_CHECKING:
    from forklift.recordings.recording import Recording

Floats = NDArray[np.float64]

DIFFERENCES = 6
NORMAL_MAD = 0.6744897501960817
"""Median of |x| of a standard normal x."""

COUNT_PRECISION = 0.02
"""How exactly, in counts, readings must be multiples of the count to be taken for an encoder's."""

MEASURED = (
    "position_free_m",
    "position_main_m",
    "pressure_free_pa",
    "pressure_main_pa",
    "fork_height_m",
)
"""The channels a model is fitted to and judged on."""


POSITIONS = MEASURED[:2]

CLIPPED = 3.0
"""Differences beyond this many standard deviations are motion, or odd samples."""
CLIPPED_VARIANCE = 0.9733369
"""Variance of a standard normal x, given |x| < `CLIPPED`."""
RESTING_A = 0.05
"""Currents up to this leave every valve shut."""
REST_SAMPLES = 20
"""Fewest samples before the first command that tell of noise."""
COLOURED = 1.2
"""Noise at rest is coloured if its variance is this many times the white part's. It is a property of a kind
of sensor: the least correlation of all channels of a unit counts, and of one channel alone none, since a lift
that leaks moves before it is commanded to."""
MEDIAN_EFFICIENCY = 0.637
"""2/π: of how many samples' mean the median of them is as good."""
MOST_CORRELATED = 0.9
"""Slower than this, short rests cannot tell it from drift."""

LEAST_NOISE = {"m": 1e-4, "Pa": 1e3}
"""No sensor is taken to be better than this, by unit: it is what the simulation itself may be off by."""


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

    @property
    def independent(self) -> float:
        """Of n samples' squares the mean scatters as that of this share of n independent ones."""
        return (1.0 - self.correlation**2) / (1.0 + self.correlation**2)

    @property
    def together(self) -> float:
        """How many times as much as white noise of the same size its slow part has."""
        return (1.0 + self.correlation) / (1.0 - self.correlation)


def sensors(recordings: Iterable[Recording]) -> dict[str, Sensor]:
    """The sensor of each measured channel that these recordings have, by channel."""
    found = {}
    recordings = tuple(recordings)
    for channel in MEASURED:
        columns = [recording.channels[channel] for recording in recordings if channel in recording.channels]
        columns = [column for column in columns if np.isfinite(column).any()]
        if columns:
            found[channel] = _sensor(channel, columns)
    colours = _colours(recordings, found)
    return {name: _coloured(sensor, colours) for name, sensor in found.items()}


def _colours(recordings: Iterable[Recording], found: Mapping[str, Sensor]) -> dict[str, tuple[float, int]]:
    """By unit, from one sample to the next the correlation of noise at rest, at least 0; and how many samples
    of a channel tell it."""
    colours: dict[str, list[tuple[float, int]]] = {}
    for channel, sensor in found.items():
        if sensor.count:
            continue
        at_rest = [
            values[:first]
            for recording in recordings
            if (values := recording.channels.get(channel)) is not None
            and (first := _first_command(recording)) >= REST_SAMPLES
            and np.isfinite(values[:first]).all()
        ]
        if at_rest:
            ratio = float(np.median([np.var(values, ddof=1) for values in at_rest])) / sensor.noise**2
            length = int(np.median([len(values) for values in at_rest]))
            told = correlation(ratio, length), sum(map(len, at_rest))
            colours.setdefault(channels()[channel]["unit"], []).append(told)
    return {unit: min(found) for unit, found in colours.items() if len(found) > 1}


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
        return float((1.0 - 2.0 / (9.0 * freedom)) ** 3 * (1.0 - mean) / _left(rho) - ratio)

    if ratio < COLOURED or off(0.0) >= 0.0:
        return 0.0
    return float(brentq(off, 0.0, MOST_CORRELATED)) if off(MOST_CORRELATED) > 0.0 else MOST_CORRELATED


def _first_command(recording: Recording) -> int:
    """How many samples there are before a valve is commanded."""
    open_at = np.flatnonzero(recording.command.max(axis=1) > RESTING_A)
    return int(open_at[0]) if len(open_at) else len(recording)


def _coloured(sensor: Sensor, colours: Mapping[str, tuple[float, int]]) -> Sensor:
    rho, samples = colours.get(channels()[sensor.channel]["unit"], (0.0, 0))
    if sensor.count or not rho:
        return sensor
    slow = replace(sensor, noise=sensor.noise / sqrt(_left(rho)), correlation=rho)
    return replace(slow, unsure=sqrt(2.0 / (MEDIAN_EFFICIENCY * samples * slow.independent)))


def _left(rho: float) -> float:
    """Share of the variance of such noise that sixth differences leave."""
    lags = np.arange(-DIFFERENCES, DIFFERENCES + 1)
    weights = (-1.0) ** lags * np.array([comb(2 * DIFFERENCES, DIFFERENCES + lag) for lag in lags])
    return float(weights @ rho ** np.abs(lags)) / comb(2 * DIFFERENCES, DIFFERENCES)


def _sensor(channel: str, columns: list[Floats]) -> Sensor:
    noise, count = white_noise(columns), encoder_count(columns)
    if channel in POSITIONS and all(np.nanmin(column) == np.nanmax(column) for column in columns):
        count = _core.ENCODER_COUNT_M  # it never moved by a count: the thesis's
    if count and noise < count:
        return Sensor(channel, count / sqrt(12.0), count)
    return Sensor(channel, max(noise, LEAST_NOISE[channels()[channel]["unit"]]), 0.0)


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
    differences = [np.diff(column, DIFFERENCES) for column in columns]
    pooled = np.concatenate([column[np.isfinite(column)] for column in differences])
    if not len(pooled):
        return 0.0
    size = float(np.median(np.abs(pooled))) / NORMAL_MAD
    for _ in range(5):
        near = pooled[np.abs(pooled) <= CLIPPED * size]
        size = float(np.sqrt(np.mean(near**2) / CLIPPED_VARIANCE)) if len(near) else size
    return size / sqrt(comb(2 * DIFFERENCES, DIFFERENCES))
