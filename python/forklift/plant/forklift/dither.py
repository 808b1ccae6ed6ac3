"""A dither that no recording shows: an unknown of the whole campaign.

A control unit shakes its valves faster than anyone records, so that their spools do not stick. What their
hysteresis feels of it is how far the spool travels, and a valve passes on the less the faster it is shaken:
amplitude over frequency counts. So the dither is run at half the rate of the command, with the amplitude that
does the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import log

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.parameter import Unknown

DITHER = "dither.amplitude"
USUAL_TICK_S = 0.02
"""Of the commands: the control unit's, to which the amplitude and a number of substeps refer [s]."""
USUAL_A, WIDTH, LEAST_A, MOST_A = 1e-3, 1.0, 1e-5, 2e-2
"""Amplitude at 25 Hz [A], its prior's deviation on a log scale, and its bounds: 4 mA at 100 Hz, within a
factor of 2.7 with two in three; from none that anything would show to a twentieth of what opens a valve."""


def dither() -> Unknown:
    """Its amplitude."""
    lower, upper = (log(end / USUAL_A) / WIDTH for end in (LEAST_A, MOST_A))
    return Unknown((DITHER,), "A", "log", (USUAL_A,), WIDTH, lower, upper)


def without_dither(values: Mapping[str, float]) -> dict[str, float]:
    """The truck's own values: the dither is the control unit's."""
    return {name: value for name, value in values.items() if name != DITHER}


def dithered(command: Floats, amplitude_a: float, tick_s: float) -> Floats:
    """Commands (times, lifts) [A], shaken from tick to tick while a valve is open."""
    if not amplitude_a:
        return command
    shaken = amplitude_a * _sway(command, tick_s)
    return np.where(command > 0.0, np.maximum(command + shaken, 0.0), command)


def _sway(command: Floats, tick_s: float) -> Floats:
    """To and fro from tick to tick, (times, 1), per amplitude."""
    sway = np.full((len(command), 1), -USUAL_TICK_S / tick_s)
    sway[1::2] *= -1.0
    return sway


def along_dither(command: Floats, amplitude_a: float, tick_s: float) -> Floats:
    """By how much each command (times, lifts) grows with the amplitude [A/A]; nothing where the shaken one
    has come down to zero."""
    sway = _sway(command, tick_s)
    return np.where((command > 0.0) & (command + amplitude_a * sway > 0.0), sway, 0.0)
