"""The numbers of a condition that was entered wrongly: a load in kg, an oil temperature in K.

Of every recording that was fitted the offset from what was entered, o_k, and the mean ō = Σ o_k / K of those
K recordings whose own interval leaves zero out (of all, if none does): a load entered 70 kg too low is right
where the forks were empty. Where these K differ from each other beyond their intervals a mean says nothing of
any of them, and there is none. Both come with intervals from the covariance C of all unknowns together
(`forklift.diagnosis.doubted`), so that what the machine's own parameters make up for is counted:
var ō = 1ᵀ C_o 1 / K².

The recordings may tell how these offsets differ, and not their level: an oil that is warmer in all recordings
alike is one of a lower viscosity. Then each o_k is known as badly as ō, and what is told is

    o_k − ō,    var = A C_o Aᵀ,    A = I − 1 1ᵀ / K.

Nor do they tell differences that are a function of what was entered, o_k = a + b T_k, from a law over that:
oil that is taken for 9 K colder where it is warm, and for 8 K warmer where it is cold, has another viscosity.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import fdtrc

from forklift.base.arrays import Floats
from forklift.diagnosis.criteria import LAW_BY_CHANCE
from forklift.diagnosis.doubted import places, widths
from forklift.diagnosis.refit import Refit
from forklift.fitting.intervals import QUANTILE, TOLD
from forklift.plant.protocol import Hypothesis

AGREE = 1.5
"""Half-widths of its own 95 % interval that a recording's offset may lie off the mean of all: three standard
deviations, since one of many recordings may well be off by two."""
UNBOUNDED = np.array([-np.inf, np.inf])


@dataclass(frozen=True)
class Offset:
    """How far a condition is off what was entered.

    Attributes
    ----------
    name
        Of the condition.
    file
        The recording; empty for the mean of those that are off, or of all where none tells it.
    value, lower, upper
        In the condition's unit: what acts, less what was entered; of one that stands `apart` less the mean of
        the same.
    told
        Whether the recordings tell it.
    apart
        Whether it is the difference from the mean.
    """

    name: str
    unit: str
    file: str
    value: float
    lower: float
    upper: float
    told: bool = True
    apart: bool = False


def offsets(refit: Refit, hypothesis: Hypothesis) -> Iterator[Offset]:
    """Of every condition that the hypothesis doubts the mean, if recordings that are off agree, then each.

    Intervals of 95 %, widened by what the refit leaves over. If the recordings do not tell the level, the
    mean of all and each are marked so, and if they differ, each follows apart from the mean.
    """
    doubted = [name for name, _ in hypothesis.addition.widened] if hypothesis.amplitude is None else []
    for name in doubted:
        own = _Own.of(refit, name)
        yield from own.told() if own.has_level else own.differences()


def follow_what_was_entered(refit: Refit, hypothesis: Hypothesis) -> bool:
    """Whether only differences of a condition that the hypothesis doubts are told, and these are a straight
    line over a condition as it was entered (F-test)."""
    if hypothesis.amplitude is not None:
        return False
    problem: Any = refit.found.problem
    entered = [problem.machine.conditions(sample.recording, {}) for sample in problem.samples]
    doubted = [_Own.of(refit, name) for name, _ in hypothesis.addition.widened]
    return any(
        _line_by_chance([one[name] for one in entered], own.values) < LAW_BY_CHANCE
        for own in doubted
        if not own.has_level
        for name in entered[0]
    )


@dataclass(frozen=True, eq=False)
class _Own:
    """One condition of all recordings that were fitted, in its unit."""

    name: str
    unit: str
    files: Sequence[str]
    values: Floats
    noise: Floats
    """Covariance of the values, widened by what is left over."""
    held: Floats
    """The same by what was held."""
    ends: Floats
    """(2, recordings) what the values can be at all."""
    width: float
    """The least of the priors' standard deviations."""

    @classmethod
    def of(cls, refit: Refit, name: str) -> _Own:
        problem, x, known = refit.found.problem, refit.found.x, refit.known
        at, scale = places(problem, name), widths(problem, name)
        square = scale[:, None] * scale
        return cls(
            name,
            problem.machine.condition_units[name],
            [sample.recording.file for sample in problem.samples],
            scale * x[at],
            refit.widening**2 * square * known.noise[np.ix_(at, at)],
            square * known.held[np.ix_(at, at)],
            scale * np.array(problem.bounds())[:, at],
            float(scale.min()),
        )

    @property
    def level(self) -> float:
        """Standard deviation of the mean of all."""
        return float(np.sqrt((self.noise + self.held).sum())) / len(self.values)

    @property
    def has_level(self) -> bool:
        """Whether the recordings tell the mean of all."""
        return self.level < TOLD * self.width

    @property
    def reach(self) -> Floats:
        """Half-widths of the intervals."""
        return QUANTILE * np.asarray(np.sqrt(np.diag(self.noise + self.held)))

    def told(self) -> Iterator[Offset]:
        """The mean of those that are off, if they agree, and each."""
        reach = self.reach
        off = np.abs(self.values) > reach
        off = off if off.any() else np.ones_like(off)
        some = np.ix_(off, off)
        common = QUANTILE * float(np.sqrt((self.noise + self.held)[some].sum())) / int(off.sum())
        mean = float(self.values[off].mean())
        if not (np.abs(self.values[off] - mean) > AGREE * reach[off]).any():
            yield self._row("", mean, common, self.ends[:, off].mean(axis=1))
        for k, file in enumerate(self.files):
            yield self._row(file, self.values[k], reach[k], self.ends[:, k])

    def differences(self) -> Iterator[Offset]:
        """The mean of all and each, which are not told; and if they differ, by how much."""
        mean, ends = float(self.values.mean()), self.ends.mean(axis=1)
        yield replace(self._row("", mean, QUANTILE * self.level, ends), told=False)
        for k, file in enumerate(self.files):
            yield replace(self._row(file, self.values[k], self.reach[k], self.ends[:, k]), told=False)
        less = np.eye(len(self.values)) - 1.0 / len(self.values)
        apart = replace(
            self, values=less @ self.values, noise=less @ self.noise @ less.T, held=less @ self.held @ less.T
        )
        # What was held makes differences larger or smaller, and none of them zero.
        sure = QUANTILE * np.sqrt(np.diag(apart.noise))
        if (np.abs(apart.values) > AGREE * sure).any():
            for k, file in enumerate(self.files):
                row = self._row(file, apart.values[k], apart.reach[k], UNBOUNDED)
                yield replace(row, apart=True)

    def _row(self, file: str, value: float, reach: float, ends: Floats) -> Offset:
        lower, upper = np.clip([value - reach, value + reach], *ends).tolist()
        return Offset(self.name, self.unit, file, float(value), lower, upper)


def _line_by_chance(at: Sequence[float], values: Floats) -> float:
    """Probability with which values that do not depend on `at` lie as near a straight line over it."""
    free = len(values) - 2
    if free < 1 or not np.isfinite(at).all() or np.allclose(at, at[0]):
        return 1.0
    explained = float(np.corrcoef(at, values)[0, 1]) ** 2
    return float(fdtrc(1, free, free * explained / max(1.0 - explained, np.finfo(float).eps)))
