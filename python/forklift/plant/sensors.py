"""What each output of a plant is off by: as its maker says, or told from the samples."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from forklift.base.errors import ForkliftError
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.recordings.clocks import Sampled
from forklift.recordings.noise import Sensor, encoder_count, noise_of

LEAST_NOISE = 1e-6
"""No sensor is taken to be better than this share of its range."""


def sensors(plant: Plant, recordings: Sequence[Recording]) -> dict[str, Sensor]:
    """Each output's noise and count: as given, or told from its samples.

    From the sixth differences of its own samples (`forklift.recordings.noise.noise_of`), however many of the
    recording's instants they are; stretches at an end of the range and gaps left out. Never less than a
    millionth of the output's range.

    Raises
    ------
    ForkliftError
        ``"channel-unknown"`` for an output that no recording has.
    """
    found = {}
    for one in plant.outputs:
        columns = [recording.y[one.name] for recording in recordings if one.name in recording.y]
        inside = [np.where((c > one.lower) & (c < one.upper), c, np.nan) for c in columns]
        finite = np.concatenate([c[np.isfinite(c)] for c in inside]) if inside else np.zeros(0)
        if not len(finite):
            raise ForkliftError(
                "channel-unknown", f"plant {plant.name}: no recording has output {one.name}", channel=one.name
            )
        if one.sigma is not None:
            found[one.name] = Sensor(one.name, one.sigma, one.count)
            continue
        count = one.count or encoder_count(inside)
        clocks = [recording.time_s for recording in recordings if one.name in recording.y]
        own = [Sampled(t[np.isfinite(c)], c[np.isfinite(c)]) for t, c in zip(clocks, inside, strict=True)]
        noise = max(noise_of(own), LEAST_NOISE * float(np.ptp(finite)), 1e-300)
        if count and noise < count:
            found[one.name] = Sensor(one.name, count / sqrt(12.0), count)
        else:
            found[one.name] = Sensor(one.name, noise, 0.0)
    return found
