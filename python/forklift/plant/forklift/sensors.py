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
from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats
from forklift.recordings.channels import channels
from forklift.recordings.noise import (
    MEDIAN_EFFICIENCY,
    Sensor,
    correlation,
    encoder_count,
    share_left,
    white_noise,
)

if TYPE_CHECKING:
    from forklift.recordings.recording import Recording


MEASURED = (
    "position_free_m",
    "position_main_m",
    "pressure_free_pa",
    "pressure_main_pa",
    "fork_height_m",
)
"""The channels a model is fitted to and judged on."""


POSITIONS = MEASURED[:2]

RESTING_A = 0.05
"""Currents up to this leave every valve shut."""
REST_SAMPLES = 20
"""Fewest samples before the first command that tell of noise."""

LEAST_NOISE = {"m": 1e-4, "Pa": 1e3}
"""No sensor is taken to be better than this, by unit: it is what the simulation itself may be off by."""


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


def _first_command(recording: Recording) -> int:
    """How many samples there are before a valve is commanded."""
    open_at = np.flatnonzero(recording.command.max(axis=1) > RESTING_A)
    return int(open_at[0]) if len(open_at) else len(recording)


def _coloured(sensor: Sensor, colours: Mapping[str, tuple[float, int]]) -> Sensor:
    rho, samples = colours.get(channels()[sensor.channel]["unit"], (0.0, 0))
    if sensor.count or not rho:
        return sensor
    slow = replace(sensor, noise=sensor.noise / sqrt(share_left(rho)), correlation=rho)
    return replace(slow, unsure=sqrt(2.0 / (MEDIAN_EFFICIENCY * samples * slow.independent)))


def _sensor(channel: str, columns: list[Floats]) -> Sensor:
    noise, count = white_noise(columns), encoder_count(columns)
    if channel in POSITIONS and all(np.nanmin(column) == np.nanmax(column) for column in columns):
        count = _core.ENCODER_COUNT_M  # it never moved by a count: the thesis's
    if count and noise < count:
        return Sensor(channel, count / sqrt(12.0), count)
    return Sensor(channel, max(noise, LEAST_NOISE[channels()[channel]["unit"]]), 0.0)
