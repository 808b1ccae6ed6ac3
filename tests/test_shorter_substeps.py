"""Shorter substeps are judged, which takes seconds, only where they move what the model says, and first on
the recording that is missed most."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from forklift.diagnosis.criteria import LESS, TWICE
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter

NOISE = 0.5
WORST = 1.3
"""Mean square of the worst channel."""
ENOUGH = (1.0 - LESS**0.5) * WORST**0.5 / TWICE
"""A move of what the model says, in units of the noise, that may bring the worst channel below that share."""


@dataclass(frozen=True)
class Said:
    """A problem as far as this decision needs it: one recording with a channel, and one that is empty."""

    substeps: int = 4
    moved: float = 0.0

    sigma = {"pressure": NOISE}  # noqa: RUF012

    def weighted(self, sigma: Any, substeps: int) -> Said:
        return Said(substeps, self.moved)

    def said(self, x: Any) -> list[dict[str, np.ndarray]]:
        off = self.moved * NOISE if self.substeps > 4 else 0.0
        return [{"pressure": np.linspace(0.0, 9.0, 50) + off, "position": np.empty(0)}]


@dataclass(frozen=True)
class Found:
    """Where a search ended."""

    problem: Said
    x: tuple[float, ...] = ()


@dataclass(frozen=True)
class Judging(Refitter):
    """A refitter that notes with how many substeps it judges which recordings, and finds nothing better."""

    judged_with: list[tuple[int, str]] = field(default_factory=list)

    def residuals_of(self, hypotheses: Any, found: Any, known: Any, which: Any) -> Any:
        for file in ("best.csv", "worst.csv"):
            if which(SimpleNamespace(file=file)):
                self.judged_with.append((found.problem.substeps, file))
        return (SimpleNamespace(mean_square=WORST),)


def ended(problem: Said) -> Refit:
    worst = SimpleNamespace(mean_square=WORST, file="worst.csv")
    parts = dict(hypotheses=(), found=Found(problem), costs=(0.0, 0.0), early=None, worst=worst)
    return cast(Refit, SimpleNamespace(**parts, knowledge=None))


@pytest.mark.parametrize(("moved", "judged"), [(0.99 * ENOUGH, []), (1.01 * ENOUGH, [(32, "worst.csv")])])
def test_shorter_substeps_are_judged_where_they_could_matter(moved, judged):
    sensors: Any = {"pressure": SimpleNamespace(noise=NOISE)}
    refitter = Judging(cast(Any, None), cast(Any, None), sensors)
    refit = ended(Said(moved=moved))
    assert refitter.finer(refit) is refit
    assert refitter.judged_with == judged
