"""What each sensor of a campaign adds to the truth: noise and counts, told from the samples themselves.

A channel that only ever reads whole multiples of one step, and has no noise to speak of beside it, is an
incremental encoder, rounded down: what it
reads is an interval, not a value with noise. Of any other channel the noise is the part that sixth
differences leave: they take away whatever a polynomial of fifth order follows over seven samples (of an
oscillation of 2.5 Hz sampled at 50 Hz, a thousandth is left), and leave white noise √924-fold.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import comb, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.names import channels

if TYPE_CHECKING:
    from forklift.recording import Recording

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

LEAST_NOISE = {"m": 1e-4, "Pa": 1e3}
"""No sensor is taken to be better than this, by unit: it is what the simulation itself may be off by."""


@dataclass(frozen=True)
class Sensor:
    """One channel's sensor, the same in all recordings of a campaign."""

    channel: str
    noise: float
    """Standard deviation of its white noise, in the channel's unit; of an encoder: count / √12."""
    count: float
    """Step of an encoder that rounds down, in the channel's unit; 0 where it is none."""


def sensors(recordings: Iterable[Recording]) -> dict[str, Sensor]:
    """The sensor of each measured channel that these recordings have, by channel."""
    found = {}
    recordings = tuple(recordings)
    for channel in MEASURED:
        columns = [recording.channels[channel] for recording in recordings if channel in recording.channels]
        columns = [column for column in columns if np.isfinite(column).any()]
        if columns:
            found[channel] = _sensor(channel, columns)
    return found


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

    The median of the absolute sixth differences, so that steps and odd samples do not count.
    """
    differences = [np.diff(column, DIFFERENCES) for column in columns]
    pooled = np.concatenate([column[np.isfinite(column)] for column in differences])
    if not len(pooled):
        return 0.0
    return float(np.median(np.abs(pooled))) / (NORMAL_MAD * sqrt(comb(2 * DIFFERENCES, DIFFERENCES)))
