"""Clocks that stand apart from the command's: when they started and how fast they run is unknown.

A logger stamps each message by one clock or another, or when it comes in. By how much the stamps of a
channel are late, in each recording, and how much too fast they run, in all of them alike, is estimated with
the truck wherever a channel has stamps of its own: a fit without that would bend the truck to make up for a
few milliseconds. A dead time of all valves, and stamps of all sensors that are late by as much, are the same:

    y(t; u(t − d)) = y(t − d; u(t)),    from rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.sensor_faults import (
    ALL_SENSORS,
    CLOCK_DRIFT,
    CLOCK_SHIFT,
    SPREAD,
    SensorUnknown,
    read,
    sensor_unknown,
)
from forklift.recordings.channels import COMMANDS
from forklift.recordings.recording import Recording

SAME_CLOCK = 0.5
"""Share of common instants from which two channels are of one clock, of which one lost samples or is slower;
stamps of two clocks coincide by chance only."""


Clocks = tuple[tuple[str, tuple[str, ...]], ...]
"""What each is called, and its channels."""


def clocks(recordings: Iterable[Recording], measured: Sequence[str]) -> Clocks:
    """All that are not the command's: by all its channels."""
    return tuple(
        (ALL_SENSORS if len(channels) == len(measured) else "+".join(channels), channels)
        for channels in clocks_apart(recordings, measured)
    )


def drifts(known: Clocks) -> tuple[SensorUnknown, ...]:
    """How fast each runs [1], unknown; see `forklift.plant.sensor_faults`."""
    return tuple(sensor_unknown(channels, "drift", "s", f"{whose}{CLOCK_DRIFT}") for whose, channels in known)


def shifts(known: Clocks) -> list[str]:
    """What a recording's conditions are called that say by how much each is late [s]."""
    return [f"{whose}{CLOCK_SHIFT}" for whose, _ in known]


def late(
    time: Floats,
    values: Floats,
    slopes: Floats,
    known: Clocks,
    shift_s: Floats,
    apart: Sequence[int],
    outputs: Sequence[str],
) -> tuple[Floats, Floats]:
    """Outputs and slopes as clocks have them that are late by (clocks,) `shift_s`; the last slopes are along
    those of `apart`. See `forklift.plant.sensor_faults.read`."""
    one = SPREAD["shift"]
    numbers = [
        (sensor_unknown(channels, "shift", "s"), at / one)
        for (_, channels), at in zip(known, shift_s.tolist(), strict=True)
    ]
    places = {name: place for place, name in enumerate(outputs)}
    along = slopes.shape[2]
    found, wide = read(time, values, slopes, numbers, places, along, derivatives=bool(apart))
    if not apart or len(apart) == len(known):
        return found, wide
    return found, wide[..., [*range(along), *(along + place for place in apart)]]


def clocks_apart(recordings: Iterable[Recording], measured: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """The measured channels of each clock that is not the command's.

    Two channels are of one clock if they are in every recording that has both.
    """
    every = list(recordings)
    groups: list[list[str]] = [[*COMMANDS]]
    for channel in measured:
        own = next((group for group in groups if _of_one_clock(every, group[0], channel)), None)
        if own is None:
            groups.append([channel])
        else:
            own.append(channel)
    return tuple(tuple(group) for group in groups[1:])


def _of_one_clock(recordings: Iterable[Recording], one: str, other: str) -> bool:
    return all(
        recording.on_one_clock or _same_clock(recording, one, other)
        for recording in recordings
        if one in recording.channels and other in recording.channels
    )


def _same_clock(recording: Recording, one: str, other: str) -> bool:
    """Whether most of the instants of the channel with fewer are the other's too."""
    rows = recording.rows_of(one), recording.rows_of(other)
    return len(np.intersect1d(*rows)) > SAME_CLOCK * min(map(len, rows))
