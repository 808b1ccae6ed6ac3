"""The numbers of a condition that was entered wrongly: a load in kg, an oil temperature in K.

Of every recording that was fitted the offset from what was entered, o_k, and the mean ō = Σ o_k / K of those
K recordings whose own interval leaves zero out (of all, if none does): a load entered 70 kg too low is right
where the forks were empty. Where these K differ from each other beyond their intervals, as the oil's do under
a temperature sensor that stood still, a mean says nothing of any of them, and there is none. Both come with
intervals from the covariance C = (JᵀJ)⁻¹ of all unknowns together, so that what the machine's own parameters
make up for is counted: var ō = 1ᵀ C_o 1 / K².
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from forklift.diagnosis.refit import Refit
from forklift.fitting.intervals import QUANTILE
from forklift.plant.protocol import Hypothesis

AGREE = 1.5
"""Half-widths of its own 95 % interval that a recording's offset may lie off the mean of all: three standard
deviations, since one of many recordings may well be off by two."""


@dataclass(frozen=True)
class Offset:
    """How far a condition is off what was entered.

    Attributes
    ----------
    name
        Of the condition.
    file
        The recording; empty for the mean of those that are off.
    value, lower, upper
        In the condition's unit: what acts, less what was entered.
    """

    name: str
    unit: str
    file: str
    value: float
    lower: float
    upper: float


def offsets(refit: Refit, hypothesis: Hypothesis) -> Iterator[Offset]:
    """Of every condition that the hypothesis doubts the mean, if recordings that are off agree, then each.

    Intervals of 95 %, widened by what the refit leaves over.
    """
    problem, x = refit.found.problem, refit.found.x
    covariance = np.linalg.inv(refit.found.jacobian.T @ refit.found.jacobian)
    half = QUANTILE * refit.widening
    units = problem.machine.condition_units
    doubted = [name for name, _ in hypothesis.addition.widened] if hypothesis.amplitude is None else []
    for name in doubted:
        files, places, widths = [], [], []
        for k, sample in enumerate(problem.samples):
            place = sample.names.index(name)
            files.append(sample.recording.file)
            places.append(problem.starts[k] + int(np.searchsorted(sample.free, place)))
            widths.append(float(sample.width[place]))
        scale = np.array(widths)
        values = scale * x[places]
        spread = scale[:, None] * covariance[np.ix_(places, places)] * scale
        off = np.abs(values) > half * np.sqrt(np.diag(spread))
        off = off if off.any() else np.ones_like(off)
        common = float(np.sqrt(spread[np.ix_(off, off)].sum())) / int(off.sum())
        mean = float(values[off].mean())
        apart = np.abs(values[off] - mean) > half * np.sqrt(np.diag(spread)[off]) * AGREE
        rows = [] if apart.any() else [("", mean, common)]
        rows += zip(files, values.tolist(), np.sqrt(np.diag(spread)).tolist(), strict=True)
        for file, value, deviation in rows:
            reach = half * deviation
            yield Offset(name, units[name], file, value, value - reach, value + reach)
