"""What is told of clocks that stand apart from the command's: by how much, and that it is allowed for.

A clock's rate is one number for all recordings, and by how much it is late one for each. If these agree,
their mean is told; else from where to where they lie. With C their covariance, s the recordings' own and 1
ones,

    mean = (1ᵀC⁻¹s) / (1ᵀC⁻¹1),    variance = 1 / (1ᵀC⁻¹1),

and they agree if (s - mean)ᵀC⁻¹(s - mean) is no larger than chance has it (Rao 1973, section 4a.2).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from forklift.base.arrays import Floats
from forklift.base.typeset import number, size
from forklift.fitting.interface import Problem
from forklift.fitting.intervals import QUANTILE, TOLD, Knowledge, interval
from forklift.plant.findings import Caution
from forklift.plant.sensor_faults import ALL_SENSORS, CLOCK_DRIFT, CLOCK_SHIFT
from forklift.plant.subject import Words

CLOCKS_APART = "clocks-apart"
"""Code of the caution."""
BEYOND_CHANCE = 4.0
"""Deviations from which on a clock is said to be off: one in 16 000 is by chance. Below, the parameters'
table has it."""
BY_CHANCE = 1e-3
"""Probability below which recordings are not late by the same."""


class Off(NamedTuple):
    """By how much a clock is off: a value with its 95 % interval, or of several recordings where they lie."""

    value: float
    lower: float
    upper: float
    agree: bool = True

    @property
    def clear(self) -> bool:
        """Whether it is off by more than chance has it."""
        return 2.0 * QUANTILE * abs(self.value) > BEYOND_CHANCE * (self.upper - self.lower) or not self.agree

    def to_dict(self) -> dict[str, float | bool]:
        """For JSON."""
        return self._asdict()


def clock_cautions(
    words: Words, problem: Problem, x: Floats, known: Knowledge, wide: float
) -> tuple[Caution, ...]:
    """One of each clock that is off. `wide`: factor on every deviation, for what is left over."""
    rates = {
        one.name.removesuffix(CLOCK_DRIFT): Off(
            one.value, *interval(one.unknown, theta, wide * one.deviation)[:, 0].tolist()
        )
        for one, theta in zip(known.estimates, x.tolist(), strict=False)
        if one.name.endswith(CLOCK_DRIFT)
    }
    names = problem.samples[0].names if problem.samples else ()
    late = {
        name.removesuffix(CLOCK_SHIFT): lateness(problem, x, known.whole, name, wide)
        for name in names
        if name.endswith(CLOCK_SHIFT)
    }
    told = []
    for whose in dict.fromkeys([*late, *rates]):
        off = {"shift_s": late.get(whose), "drift": rates.get(whose)}
        clear = {what: one for what, one in off.items() if one is not None and one.clear}
        if clear:
            told.append(_caution(words, whose, clear))
    return tuple(told)


def lateness(problem: Problem, x: Floats, covariance: Floats, name: str, wide: float) -> Off | None:
    """By how much a clock is late in the recordings together [s]; None where none has one of its own."""
    places, widths, values = [], [], []
    for k, sample in enumerate(problem.samples):
        at = sample.names.index(name)
        if sample.width[at]:
            places.append(problem.starts[k] + int(np.flatnonzero(sample.free == at)[0]))
            widths.append(sample.width[at])
            values.append(sample.centre[at] + sample.width[at] * x[places[-1]])
    if not values:
        return None
    each, size_of = np.array(values), np.array(widths)
    between = wide**2 * covariance[np.ix_(places, places)] * np.outer(size_of, size_of)
    one = np.ones(len(each))
    weights = np.linalg.solve(between, one)
    mean, deviation = float(weights @ each / weights.sum()), float(weights.sum() ** -0.5)
    apart = each - mean
    square = float(apart @ np.linalg.solve(between, apart))
    if chdtrc(max(len(each) - 1, 1), square) >= BY_CHANCE:
        return Off(mean, mean - QUANTILE * deviation, mean + QUANTILE * deviation)
    told = np.sqrt(np.diag(between)) < TOLD * size_of
    known = each[told] if told.any() else each
    return Off(mean, float(known.min()), float(known.max()), agree=False)


def _caution(words: Words, whose: str, off: Mapping[str, Off]) -> Caution:
    every = whose == ALL_SENSORS
    named = "all sensors" if every else " and ".join(f"the {words.signal(one)}" for one in whose.split("+"))
    like = f"{'Valves that answer' if every else 'A sensor that answers'} as late would look the same."
    shift = off.get("shift_s")
    said = " and ".join(_said(what, one) for what, one in off.items())
    return Caution(
        CLOCKS_APART,
        f"The time stamps of {named} {said}, compared with those of the commands. All numbers and curves "
        "here allow for that; look at how they are logged."
        + (f" {like}" if shift and shift.agree and shift.value > 0.0 else ""),
        {"clock": whose, **{what: one.to_dict() for what, one in off.items()}},
    )


def _said(what: str, off: Off) -> str:
    """``"are 3 ms (95 %: 2.9 to 3.1) late"``, or from where to where they are."""
    shift = what == "shift_s"
    factor, unit = (1e3, "ms") if shift else (1e2, "%")
    if not off.agree:
        least, most = number(factor * off.lower), number(factor * off.upper)
        return f"are {least} to {most} {unit} late, by an amount of its own in each recording"
    sign = -1.0 if off.value < 0.0 else 1.0
    ends = sorted([sign * factor * off.lower, sign * factor * off.upper])
    value, lower, upper = size(sign * factor * off.value, *ends)
    how = ("late" if sign > 0.0 else "early") if shift else ("fast" if sign > 0.0 else "slow")
    return f"{'are' if shift else 'run'} {value} {unit} (95 %: {lower} to {upper}) {how}"
