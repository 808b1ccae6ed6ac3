"""One recording as a problem sees it: how a machine runs it, and what its sensors read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.fitting.observed import Observed
from forklift.plant.protocol import Case
from forklift.recordings.noise import Sensor


@dataclass(frozen=True, eq=False)
class Sample(Case):
    """A `Case` with what was read of its outputs."""

    observed: tuple[Observed, ...] = ()


def observing(
    case: Case,
    measured: Mapping[str, Floats],
    sensors: Mapping[str, Sensor],
    outputs: Sequence[str],
    ends: Mapping[str, tuple[float, float]],
    instants: Mapping[str, NDArray[np.intp]],
) -> Sample:
    """The case with the finite samples of every channel that has a sensor.

    Parameters
    ----------
    measured
        By channel, (times,) with NaN where a sample is missing.
    outputs
        The machine's, in order.
    ends
        By channel, between which its sensor reads.
    instants
        By channel on a clock of its own, the times at which it was sampled, by their place.
    """
    seen = []
    for channel, sensor in sensors.items():
        values = measured.get(channel)
        if values is None:
            continue
        rows = np.flatnonzero(np.isfinite(values))
        if len(rows):
            limits = ends.get(channel, (-np.inf, np.inf))
            own = instants.get(channel)
            seen.append(Observed(sensor, outputs.index(channel), rows, values[rows], limits, own))
    fixed = {field.name: getattr(case, field.name) for field in fields(Case)}
    return Sample(**fixed, observed=tuple(seen))
