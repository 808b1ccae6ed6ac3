"""Names are tried from the start machine by where it is, not by what a bent machine lets them promise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis import selection
from forklift.diagnosis.criteria import CURVE_TIE, DOUBTFUL, LITTLE, MISFIT, MOST_NEAR
from forklift.diagnosis.curve_trials import General
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.screening import Screened, Screening
from forklift.plant.protocol import Addition, Hypothesis

LEFT = 1e4
"""Squares that the machine alone leaves over, above the noise."""


def named(id: str) -> Hypothesis:
    return Hypothesis(id, "physics", id, "main", "any", id, Addition())


HOSE, AIR, CHASSIS, ELSEWHERE = (named(id) for id in ("hose", "air", "chassis", "elsewhere"))
NEAR = {HOSE: 0.9 * CURVE_TIE, AIR: 1.0, CHASSIS: 1.0, ELSEWHERE: 0.0}
"""Of the evidence of the best place, the share where each acts."""
PROMISED = {HOSE: 80.0, AIR: 1.0, CHASSIS: 2.0, ELSEWHERE: 90.0}
"""Of `LEFT`, by a linear step from where the machine alone ended."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A refit, which leaves nothing over if it has the cause from the start machine."""

    mean_square: float
    hypotheses: tuple[Hypothesis, ...] = ()
    complete: bool = False
    finished: bool = True
    cold: bool = False

    identifiable = True
    strained = strains_alone = held_out_alone = fitted_alone = pooled = quiet = slight = False
    at_bounds = ()
    loo_log_score = foretold = None
    rough, costs, missing = 1e3, (1e3, 1e3), 1.0
    found = early = told_from = SimpleNamespace(problem=SimpleNamespace(samples=()), x=None)
    held_out = (SimpleNamespace(samples=1000),)

    @property
    def worst(self) -> Any:
        return SimpleNamespace(mean_square=1.0 if self.complete else self.mean_square)

    @property
    def excess(self) -> float:
        return 0.0 if self.complete else LEFT

    @property
    def squares(self) -> float:
        return 1e5 + self.excess

    @property
    def freedoms(self) -> int:
        return len(self.hypotheses)

    def clear(self, hypothesis: Hypothesis) -> bool:
        return True

    def deviations(self, hypothesis: Hypothesis) -> float:
        return 100.0

    def size(self, hypothesis: Hypothesis) -> float:
        return 1.0


@dataclass
class Tries:
    """A refitter that finds the cause from the start machine alone, and keeps who was tried there."""

    cause: Hypothesis
    mean_square: float
    cold_ones: list[Hypothesis] = field(default_factory=list)
    again: list[bool] = field(default_factory=list)

    together, later, strict = 1.0, 0.5, False
    work = SimpleNamespace(spent=False, grant=lambda more: None)

    def ahead(self, several: Any, after: Any, *given: Any, again: bool) -> Any:
        self.again.append(again)
        return Fitted(self.mean_square, tuple(several[0]), finished=False)

    def cold(self, several: Sequence[tuple[Hypothesis, ...]], *given: Any) -> Any:
        self.cold_ones += several[0]
        return Fitted(self.mean_square, several[0], several[0] == (self.cause,), finished=False, cold=True)

    def finish(self, refit: Fitted) -> Fitted:
        return Fitted(refit.mean_square, refit.hypotheses, refit.complete, cold=refit.cold)

    def everywhere(self, refit: Any) -> Any:
        return refit.found

    def simpler(self, *given: Any) -> None:
        return None


class NoCurves:
    """Offers none, and knows where each name acts."""

    def __call__(self, refit: Any) -> list[Screened]:
        return []

    def faint(self, refit: Any, everywhere: Any) -> None:
        return None

    def near(self, refit: Any, one: Hypothesis) -> float:
        return NEAR[one]


@pytest.fixture
def tried(monkeypatch):
    """Who was tried, and what was found, where a cause leaves so much in the worst channel."""

    def screen(problem: Any, x: Any, hypotheses: Sequence[Hypothesis], most: int = 8) -> Screening:
        singles = [Screened((one,), PROMISED[one], (1.0,), (0.1,), PROMISED[one]) for one in hypotheses]
        ranked = tuple(sorted(singles, key=lambda one: -one.gain))
        return Screening(LEFT, ranked, (), (), ranked)

    def select(cause: Hypothesis, mean_square: float) -> tuple[Tries, tuple[Hypothesis, ...]]:
        refitter = Tries(cause, mean_square)
        found = selection.select(
            cast(Refitter, refitter),
            cast(Refit, Fitted(mean_square)),
            screen(None, None, list(PROMISED)),
            list(PROMISED),
            Clock(),
            cast(General, NoCurves()),
        )
        return refitter, found.final.hypotheses

    monkeypatch.setattr(selection, "screen", screen)
    return select


@pytest.mark.parametrize("mean_square", [2.0 * MISFIT, 0.9 * MISFIT], ids=["clear", "faint"])
def test_what_promises_next_to_nothing_is_found_where_it_acts(tried, mean_square):
    refitter, found = tried(AIR, mean_square)
    assert found == (AIR,)
    assert refitter.cold_ones == [CHASSIS, AIR]


def test_what_acts_beside_the_best_place_comes_later_and_far_from_it_not_at_all(tried):
    refitter, found = tried(ELSEWHERE, 2.0 * MISFIT)
    assert found == ()
    assert refitter.cold_ones == [CHASSIS, AIR, HOSE]
    assert len(refitter.cold_ones) <= MOST_NEAR


def test_what_may_be_chance_is_left_alone(tried):
    refitter, found = tried(AIR, 0.99 * DOUBTFUL)
    assert found == ()
    assert refitter.cold_ones == []


@pytest.mark.parametrize(("promised", "again"), [(0.9, False), (1.1, True)])
def test_who_promises_little_is_not_tried_from_the_start_for_that(tried, monkeypatch, promised, again):
    monkeypatch.setitem(PROMISED, HOSE, promised * LITTLE * LEFT)
    refitter, _ = tried(AIR, 2.0 * MISFIT)
    assert refitter.again[0] is again
    assert not any(refitter.again[1:])
