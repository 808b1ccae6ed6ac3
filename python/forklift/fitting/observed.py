"""What one channel of one recording read, and how far a model is off it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.fitting import likelihood

if TYPE_CHECKING:
    from forklift.recordings.noise import Sensor


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

    def misfit(self, said: Floats, sigma: float) -> tuple[Floats, Floats]:
        """Residual of each sample and its derivative along what the model says, at weight `sigma`."""
        if self.sensor.count:
            return likelihood.interval(self.values, said, self.sensor.count, sigma)
        residual, slope = likelihood.gaussian(self.values, said, sigma)
        for end, sign in zip(self.ends, (-1.0, 1.0), strict=True):
            if np.isfinite(end):
                at = sign * (self.values - end) >= 0.0
                residual[at], slope[at] = likelihood.censored(end, said[at], sigma, sign)
        return residual, slope

    def residual(self, said: Floats, sigma: float) -> Floats:
        """That of `misfit` alone."""
        if self.sensor.count:
            return likelihood.interval_residual(self.values, said, self.sensor.count, sigma)
        if np.isfinite(self.ends).any():
            return self.misfit(said, sigma)[0]
        return likelihood.gaussian_residual(self.values, said, sigma)

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
