"""How a sensor may read wrongly: with another gain, an offset, late, or on another clock than the command's.

    reading(t) = gain · truth(t − lag − shift − drift · (t − t₀)) + offset

t₀ is where the recording begins. A lag is a sensor's and never negative; shift and drift are a clock's.
The same number for all recordings, so that it competes with physics on equal terms. So is the offset of a
condition that a sensor told, which acts on the machine and not on what is read of it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.plant.parameter import Unknown

SensorFault = Literal["gain", "offset", "lag", "shift", "drift"]

SPREAD: dict[SensorFault, float] = {"gain": 0.05, "lag": 0.05, "shift": 0.05, "drift": 0.002}
"""Prior standard deviations; lag and shift in seconds. A quartz is off by 1e-4 at most, a logger that counts
samples instead of time by per cents of what it states."""
OFFSETS = {"Pa": 1e5, "m": 0.01}
"""Prior standard deviation of an offset, by the channel's unit."""
MOST: dict[SensorFault, float] = {"gain": 10.0, "offset": 20.0, "lag": 10.0, "shift": 10.0, "drift": 10.0}
"""The farthest of the prior's deviations."""


CLOCK_SHIFT, CLOCK_DRIFT, ALL_SENSORS = ".clock_shift", ".clock_drift", "sensors"
"""After a clock's name: by how much its stamps are late in a recording [s], how much too fast it runs [1]. It
is called as its channels, with a plus between them, or so if it has all."""


@dataclass(frozen=True)
class SensorUnknown(Unknown):
    """One number of a sensor, unknown."""

    channels: tuple[str, ...] = ()
    """Which read wrongly, all by the same number."""
    fault: SensorFault = "gain"


@dataclass(frozen=True)
class ConditionOffset(Unknown):
    """By how much a condition is off in all recordings alike: what acts, less what was told, unknown."""

    condition: str = ""
    files: frozenset[str] = frozenset()
    """The recordings in which the same sensor told it."""


def condition_offset(
    name: str, condition: str, unit: str, width: float, files: Collection[str]
) -> ConditionOffset:
    """The unknown offset of a condition; `width`: standard deviation of its prior."""
    most = MOST["offset"]
    return ConditionOffset((name,), unit, "linear", (0.0,), width, -most, most, condition, frozenset(files))


def sensor_unknown(
    channels: Sequence[str], fault: SensorFault, unit: str, name: str | None = None
) -> SensorUnknown:
    """The unknown gain, offset, lag or clock of one channel's sensor, or of several alike; it is told by
    `name`, by default channels and fault."""
    right = 1.0 if fault == "gain" else 0.0
    width = OFFSETS[unit] if fault == "offset" else SPREAD[fault]
    own_unit = {"gain": "1", "offset": unit, "lag": "s", "shift": "s", "drift": "1"}[fault]
    lower = 0.0 if fault == "lag" else -MOST[fault]
    names = (name or f"{'+'.join(channels)}.{fault}",)
    return SensorUnknown(
        names, own_unit, "linear", (right,), width, lower, MOST[fault], tuple(channels), fault
    )


def read(
    time: Floats,
    values: Floats,
    slopes: Floats,
    sensors: Sequence[tuple[SensorUnknown, float]],
    columns: Mapping[str, int],
    along: int,
    *,
    derivatives: bool = True,
) -> tuple[Floats, Floats]:
    """Outputs (times, outputs) and slopes (times, outputs, directions) as sensors with these numbers give
    them.

    `derivatives`: with a further direction for each sensor, in their order, before direction `along`.
    `columns`: where each output stands.
    """
    values, more = values.copy(), len(sensors) if derivatives else 0
    wide = np.empty((*slopes.shape[:2], slopes.shape[2] + more))
    wide[..., :along], wide[..., along + more :] = slopes[..., :along], slopes[..., along:]
    wide[..., along : along + more] = 0.0
    alike: dict[tuple[int, ...], list[int]] = {}
    for channel in dict.fromkeys(channel for one, _ in sensors for channel in one.channels):
        which = tuple(k for k, (one, _) in enumerate(sensors) if channel in one.channels)
        alike.setdefault(which, []).append(columns[channel])
    for which, places in alike.items():
        acting = [
            (sensors[k][0].fault, float(sensors[k][0].values(sensors[k][1])[0]), along + k) for k in which
        ]
        read_as, turned = _reading(time, values[:, places], wide[:, places], acting, derivatives=derivatives)
        values[:, places] = read_as
        if turned.size:
            wide[:, places] = turned
    return values, wide


def _reading(
    time: Floats,
    values: Floats,
    slopes: Floats,
    acting: Sequence[tuple[SensorFault, float, int]],
    *,
    derivatives: bool,
) -> tuple[Floats, Floats]:
    """Channels that are read alike: (times, channels), (times, channels, directions). `acting`: faults, their
    numbers, and in which direction each is told."""
    grows = {"lag": np.ones(len(time)), "shift": np.ones(len(time)), "drift": time - time[0]}
    late = [(grows[fault], at, place) for fault, at, place in acting if fault in grows]
    if late:
        total = np.sum([at * rate for rate, at, _ in late], axis=0)
        place, share = _before(time, total)
        true = values
        values = np.column_stack([np.interp(time - total, time, one) for one in true.T])
        if slopes.size:
            slopes = (1.0 - share)[:, :, None] * slopes[place] + share[:, :, None] * slopes[place + 1]
        if derivatives:
            inside = (time - total > time[0]) & (time - total < time[-1] + 1e-9)
            falls = np.where(inside[:, None], -(np.diff(true, axis=0) / np.diff(time)[:, None])[place], 0.0)
            for rate, _, own in late:
                slopes[:, :, own] = rate[:, None] * falls
    for fault, at, own in acting:
        if fault == "gain":
            slopes = at * slopes
            if derivatives:
                slopes[:, :, own] = values
            values = at * values
    for fault, at, own in acting:
        if fault == "offset":
            values = values + at
            if derivatives:
                slopes[:, :, own] = 1.0
    return values, slopes


def _before(time: Floats, lag: Floats) -> tuple[NDArray[np.intp], Floats]:
    """The sample before each time less its `lag` [s], and (times, 1) the share of the one after it."""
    at = np.clip(time - lag, time[0], time[-1])
    place = np.clip(np.searchsorted(time, at, side="left") - 1, 0, len(time) - 2)
    return place, ((at - time[place]) / (time[place + 1] - time[place]))[:, None]
