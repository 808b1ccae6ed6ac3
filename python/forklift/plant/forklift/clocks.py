"""Clocks that stand apart from the command's: when they started and how fast they run is unknown.

A logger stamps each message by one clock or another, or when it comes in. By how much the stamps of a
channel are late, and how much too fast they run, is estimated with the truck wherever a channel has stamps of
its own: a fit without that would bend the truck to make up for a few milliseconds. One number for all
recordings. A dead time of all valves, and stamps of all sensors that are late by as much, are the same:

    y(t; u(t − d)) = y(t − d; u(t)),    from rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from forklift.plant.sensor_faults import SensorUnknown, sensor_unknown
from forklift.recordings.channels import COMMANDS
from forklift.recordings.recording import Recording

SAME_CLOCK = 0.5
"""Share of common instants from which two channels are of one clock, of which one lost samples or is slower;
stamps of two clocks coincide by chance only."""


def clocks(recordings: Iterable[Recording], measured: Sequence[str]) -> tuple[SensorUnknown, ...]:
    """Shift [s] and drift [1] of every clock that is not the command's; `forklift.plant.sensor_faults`."""
    found: list[SensorUnknown] = []
    for channels in clocks_apart(recordings, measured):
        whose = "sensors" if len(channels) == len(measured) else "+".join(channels)
        found.append(sensor_unknown(channels, "shift", "s", f"{whose}.clock_shift"))
        found.append(sensor_unknown(channels, "drift", "s", f"{whose}.clock_drift"))
    return tuple(found)


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
