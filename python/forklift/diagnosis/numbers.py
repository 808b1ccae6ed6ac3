"""Every parameter of a refit with its interval: one rule, one level, for tables, causes and pages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from forklift.diagnosis.conditions import offsets
from forklift.diagnosis.refit import Refit
from forklift.fitting.intervals import LEVEL, ends
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
        Whether the recordings narrow its prior.
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
    return tuple(
        Number(
            one.name,
            one.unknown.unit,
            one.unknown.start[0],
            one.value,
            *ends(one.unknown, float(theta), refit.widening * one.deviation),
            one.identifiable,
        )
        for one, theta in zip(refit.knowledge.estimates, refit.found.x.tolist(), strict=False)
    )


def of_hypothesis(refit: Refit, hypothesis: Hypothesis) -> Iterator[Number]:
    """Those that a hypothesis brings: its amplitude first; of a condition its offsets, the mean first, if
    the recordings agree on one."""
    if hypothesis.amplitude is None:
        if hypothesis in refit.hypotheses:
            for one in offsets(refit, hypothesis):
                name = f"{hypothesis.id}.{one.name}{f' in {one.file}' if one.file else ''}"
                yield Number(name, one.unit, 0.0, one.value, one.lower, one.upper)
        return
    own = {unknown.name for unknown in hypothesis.addition.free}
    yield from (one for one in numbers(refit) if one.name in own)
