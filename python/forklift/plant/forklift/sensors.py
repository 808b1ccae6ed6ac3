"""What each sensor of a campaign adds to the truth: noise and counts, told from the samples themselves.

A channel that only ever reads whole multiples of one step, and has no noise to speak of beside it, is an
incremental encoder, rounded down: what it reads is an interval, not a value with noise. Of any other channel
the noise is the part that sixth differences leave: they take away whatever a polynomial of fifth order
follows over seven samples (of an oscillation of 2.5 Hz sampled at 50 Hz, a thousandth is left), and leave
white noise √924-fold. Noise that is not white shows while everything rests, before the first command.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from forklift import _core
from forklift.recordings.channels import channels
from forklift.recordings.clocks import Sampled
from forklift.recordings.noise import (
    COLOUR_STEP_S,
    MEDIAN_EFFICIENCY,
    Sensor,
    correlation,
    encoder_count,
    noise_of,
    over,
    share_left,
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
        columns = [recording.own(channel) for recording in recordings if channel in recording.channels]
        columns = [column for column in columns if np.isfinite(column.values).any()]
        if columns:
            found[channel] = sensor_of(channel, columns)
    colours = _colours(recordings, found)
    return {name: _coloured(sensor, colours) for name, sensor in found.items()}


def _colours(recordings: Iterable[Recording], found: Mapping[str, Sensor]) -> dict[str, tuple[float, int]]:
    """By unit, over `COLOUR_STEP_S` the correlation of noise at rest, at least 0; and how many samples of a
    channel tell it."""
    colours: dict[str, list[tuple[float, int]]] = {}
    for channel, sensor in found.items():
        if sensor.count:
            continue
        at_rest = [
            values[:first]
            for recording in recordings
            if channel in recording.channels
            and (first := _at_rest(recording, channel)) >= REST_SAMPLES
            and np.isfinite((values := recording.own(channel).values)[:first]).all()
        ]
        if at_rest:
            ratio = float(np.median([np.var(values, ddof=1) for values in at_rest])) / sensor.noise**2
            length = int(np.median([len(values) for values in at_rest]))
            rho = over(correlation(ratio, length), sensor.step_s, COLOUR_STEP_S)
            told = rho, sum(map(len, at_rest))
            colours.setdefault(channels()[channel]["unit"], []).append(told)
    return {unit: min(found) for unit, found in colours.items() if len(found) > 1}


def _at_rest(recording: Recording, channel: str) -> int:
    """How many samples of the channel there are before a valve is commanded."""
    time, command = recording.commanded
    open_at = np.flatnonzero(command.max(axis=1) > RESTING_A)
    own = recording.own(channel).time
    return int(np.searchsorted(own, time[open_at[0]])) if len(open_at) else len(own)


def _coloured(sensor: Sensor, colours: Mapping[str, tuple[float, int]]) -> Sensor:
    rho, samples = colours.get(channels()[sensor.channel]["unit"], (0.0, 0))
    rho = over(rho, COLOUR_STEP_S, sensor.step_s)
    if sensor.count or not rho:
        return sensor
    slow = replace(sensor, noise=sensor.noise / sqrt(share_left(rho)), correlation=rho)
    return replace(slow, unsure=sqrt(2.0 / (MEDIAN_EFFICIENCY * samples * slow.independent)))


def sensor_of(channel: str, columns: list[Sampled]) -> Sensor:
    values = [column.values for column in columns]
    noise, count = noise_of(columns), encoder_count(values)
    levels = np.unique(np.concatenate([column[np.isfinite(column)] for column in values]))
    if channel in POSITIONS and len(levels) == 2:
        count = float(levels[1] - levels[0])  # a lift at rest that bounces over one edge
    if channel in POSITIONS and all(np.nanmin(column) == np.nanmax(column) for column in values):
        count = _core.ENCODER_COUNT_M  # it never moved by a count: the thesis's
    step_s = float(np.median([column.step_s for column in columns])) or COLOUR_STEP_S
    if count and noise < count:
        return Sensor(channel, count / sqrt(12.0), count, step_s=step_s)
    return Sensor(channel, max(noise, LEAST_NOISE[channels()[channel]["unit"]]), 0.0, step_s=step_s)
