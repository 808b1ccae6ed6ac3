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


@dataclass(frozen=True)
class SensorUnknown(Unknown):
    """One number of a sensor, unknown."""

    channels: tuple[str, ...] = ()
    """Which read wrongly, all by the same number."""
    fault: SensorFault = "gain"

    def read(
        self, time: Floats, values: Floats, slopes: Floats, theta: float, columns: Mapping[str, int]
    ) -> tuple[Floats, Floats]:
        """Outputs (times, outputs) and slopes (times, outputs, directions) as the sensor gives them.

        The slopes get one more direction, the last: this number. `columns`: where each output stands.
        """
        at = float(self.values(theta)[0])
        values, slopes = values.copy(), slopes.copy()
        own = np.zeros((*slopes.shape[:2], 1))
        for column in (columns[channel] for channel in self.channels):
            true = values[:, column].copy()
            if self.fault == "gain":
                values[:, column] = at * true
                slopes[:, column] *= at
                own[:, column, 0] = true
            elif self.fault == "offset":
                values[:, column] = true + at
                own[:, column, 0] = 1.0
            else:
                grows = time - time[0] if self.fault == "drift" else np.ones(len(time))
                late = at * grows
                values[:, column] = np.interp(time - late, time, true)
                place, share = _before(time, late)
                inside = (time - late > time[0]) & (time - late < time[-1] + 1e-9)
                own[:, column, 0] = np.where(inside, -grows * (np.diff(true) / np.diff(time))[place], 0.0)
                rows = slopes[:, column]
                slopes[:, column] = (1.0 - share) * rows[place] + share * rows[place + 1]
        return values, np.concatenate([slopes, own], axis=2)


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


def sensor_unknown(channels: Sequence[str], fault: SensorFault, unit: str) -> SensorUnknown:
    """The unknown gain, offset, lag or clock of one channel's sensor, or of several alike."""
    right = 1.0 if fault == "gain" else 0.0
    width = OFFSETS[unit] if fault == "offset" else SPREAD[fault]
    own_unit = {"gain": "1", "offset": unit, "lag": "s", "shift": "s", "drift": "1"}[fault]
    lower = 0.0 if fault == "lag" else -MOST[fault]
    names = (f"{'+'.join(channels)}.{fault}",)
    return SensorUnknown(
        names, own_unit, "linear", (right,), width, lower, MOST[fault], tuple(channels), fault
    )


def _before(time: Floats, lag: Floats) -> tuple[NDArray[np.intp], Floats]:
    """The sample before each time less its `lag` [s], and (times, 1) the share of the one after it."""
    at = np.clip(time - lag, time[0], time[-1])
    place = np.clip(np.searchsorted(time, at, side="left") - 1, 0, len(time) - 2)
    return place, ((at - time[place]) / (time[place + 1] - time[place]))[:, None]
