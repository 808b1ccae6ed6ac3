"""Who explains nearly everything, but not all, is searched for from the start machine too."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import pytest

from forklift.diagnosis.criteria import NEARLY
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.fitting.work import Work


@dataclass(frozen=True, eq=False)
class Tried:
    """A refit as far as this decision needs it."""

    excess: float
    squares: float = 100.0
    complete: bool = False
    hypotheses: tuple[str, ...] = ("coupling",)
    pooled: bool = False


@dataclass
class Starts:
    """A refitter whose refits end where they are said to, from either start."""

    warm: Tried
    cold: Tried
    asked: list[str] = field(default_factory=list)
    work: Work = field(default_factory=Work)

    def finish(self, refit: Refit) -> Refit:
        return cast(Refit, self.warm)

    def afresh(self, refit: Refit) -> Refit:
        self.asked.append("start machine")
        return cast(Refit, self.cold)


def ended(warm: Tried, cold: Tried) -> tuple[Refit, list[str]]:
    refitter, before = Starts(warm, cold), Tried(excess=1e6)
    race = Race(cast(Refitter, refitter), lambda said: None)
    found = race.to_the_end(cast(Refit, before), cast(Refit, warm))
    return found, refitter.asked


def test_a_search_that_ended_beside_the_place_is_begun_again():
    there = Tried(excess=0.0, squares=120.0, complete=True)
    found, asked = ended(Tried(excess=0.5 * NEARLY * 1e6), there)
    assert found is there
    assert asked


def test_of_two_ends_that_both_leave_something_the_one_that_leaves_less_counts():
    warm = Tried(excess=900.0)
    found, asked = ended(warm, Tried(excess=950.0, squares=130.0))
    assert found is warm
    assert asked


@pytest.mark.parametrize(
    "warm", [Tried(excess=50.0, complete=True), Tried(excess=2.0 * NEARLY * 1e6)], ids=["all", "too little"]
)
def test_what_explains_everything_or_clearly_not_is_left_as_it_ended(warm):
    found, asked = ended(warm, Tried(excess=0.0, complete=True))
    assert found is warm
    assert not asked
