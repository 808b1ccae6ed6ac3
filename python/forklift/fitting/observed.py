"""What one channel of one recording read, and how far a model is off it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.base.arrays import Floats

if TYPE_CHECKING:
    from forklift.recordings.noise import Sensor


@dataclass(frozen=True, slots=True)
class Seen:
    """One channel as the core takes it (`forklift._core.residuals`)."""

    column: int
    rows: NDArray[np.intp]
    read: Floats
    count: float
    ends: tuple[float, float]
    sigma: float


@dataclass(frozen=True)
class Observed:
    """The finite samples of one channel in one recording."""

    sensor: Sensor
    column: int
    """Its place among the model's outputs."""
    rows: NDArray[np.intp]
    values: Floats
    ends: tuple[float, float] = (-np.inf, np.inf)
    """Between which the sensor reads; a sample at one of them tells that the truth lies there or beyond."""
    instants: NDArray[np.intp] | None = None
    """Rows at which a channel on a clock of its own was sampled, missing samples among them; None: all."""

    def of(self, outputs: Floats) -> Floats:
        """Of what a machine gives, (times, outputs, ...), this channel where it was sampled."""
        column: Floats = outputs[:, self.column]
        return column if len(self.rows) == len(column) else column[self.rows]

    def weighted(self, sigma: float) -> Seen:
        """As the core takes it, at weight `sigma`."""
        rows, values = np.ascontiguousarray(self.rows), np.ascontiguousarray(self.values)
        return Seen(self.column, rows, values, self.sensor.count, self.ends, sigma)

    def misfit(self, said: Floats, sigma: float) -> tuple[Floats, Floats]:
        """Residual of each sample and its derivative along what the model says, at weight `sigma`."""
        return _core.misfit(self.values, said, sigma, count=self.sensor.count, ends=self.ends)

    def reading(self, said: Floats) -> Floats:
        """What the sensor ought to read, within its ends."""
        return np.clip(said, *self.ends)

    def left(self, said: Floats) -> Floats:
        """Measured less what the model says; of a sample at an end what the model falls short of it."""
        off = self.values + 0.5 * self.sensor.count - said
        if np.isfinite(self.ends[1]):
            off = np.where(self.values >= self.ends[1], np.maximum(off, 0.0), off)
        if np.isfinite(self.ends[0]):
            off = np.where(self.values <= self.ends[0], np.minimum(off, 0.0), off)
        return np.asarray(off)


def by_channel(observed: Sequence[Observed], rows: Floats) -> dict[str, Floats]:
    """The rows of each channel, of a recording's channels one after the other."""
    ends = list(accumulate((len(seen.rows) for seen in observed), initial=0))
    return {
        seen.sensor.channel: rows[first:end]
        for seen, (first, end) in zip(observed, pairwise(ends), strict=True)
    }
