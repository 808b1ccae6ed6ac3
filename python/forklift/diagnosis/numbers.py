"""Every parameter of a refit with its interval: one rule, one level, for tables, causes and pages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.conditions import offsets
from forklift.diagnosis.refit import Refit
from forklift.fitting.intervals import LEVEL, QUANTILE, TOLD, ends
from forklift.plant.misread import APART, OF
from forklift.plant.protocol import Hypothesis


@dataclass(frozen=True)
class Number:
    """One parameter.

    Attributes
    ----------
    start
        Where the fit began.
    value, lower, upper
        In its unit; the 95 % interval, each deviation widened by the root of what is left over.
    identifiable
        Whether the recordings narrow its prior; of a condition's, whether they tell it.
    """

    name: str
    unit: str
    start: float
    value: float
    lower: float
    upper: float
    identifiable: bool = True

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**vars(self), "level": LEVEL}


def numbers(refit: Refit) -> tuple[Number, ...]:
    """All that is estimated, in the problem's order."""
    told, left = _deviations(refit), refit.widening
    return tuple(
        Number(
            one.name,
            one.unknown.unit,
            one.unknown.start[0],
            one.value,
            *ends(one.unknown, theta, float(np.hypot(left * noise, held))),
            bool(np.hypot(noise, held) < TOLD),
        )
        for one, theta, (noise, held) in zip(
            refit.knowledge.estimates, refit.found.x.tolist(), told, strict=False
        )
    )


def _deviations(refit: Refit) -> Floats:
    """(unknowns, 2) posterior deviations by the recordings' noise and by what was held, both in the prior's;
    what was held counts where a doubted condition makes it count."""
    each = np.array([one.deviation for one in refit.knowledge.estimates])
    if not refit.doubted:
        return np.column_stack([each, np.zeros_like(each)])
    known, n = refit.known, len(each)
    return np.column_stack([each * known.looser[:n], np.sqrt(np.diag(known.held)[:n])])


def half_widths(refit: Refit) -> Floats:
    """(unknowns,) half of every interval, in the prior's deviations."""
    noise, held = _deviations(refit).T
    return np.asarray(QUANTILE * np.hypot(refit.widening * noise, held))


def of_hypothesis(refit: Refit, hypothesis: Hypothesis) -> Iterator[Number]:
    """Those that a hypothesis brings: its amplitude first; of a condition its offsets, the mean first, if
    the recordings agree on one or none tells it, and then each less the mean."""
    if hypothesis.amplitude is None:
        if hypothesis in refit.hypotheses:
            for one in offsets(refit, hypothesis):
                of = f"{APART if one.apart else ''}{OF + one.file if one.file else ''}"
                name = f"{hypothesis.id}.{one.name}{of}"
                yield Number(name, one.unit, 0.0, one.value, one.lower, one.upper, one.told)
        return
    own = {unknown.name for unknown in hypothesis.addition.free}
    yield from (one for one in numbers(refit) if one.name in own)
