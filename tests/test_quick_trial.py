"""What is tried beside an explanation that was accepted goes on as long as it keeps up with that; where none
helps, who was given up and does most on recordings held out goes on."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import First, Refitter

BEST, ACCEPTED = 26.2, 15.2
"""−ln posterior after the first tempered stage: without any hypothesis, and with the accepted one."""


class Searched(Refitter):
    """A refitter whose first stage ends at a cost that is given."""

    def __init__(self, cost: float) -> None:
        object.__setattr__(self, "cost", cost)

    def _from(self, hypotheses: Any, after: Any = None) -> Any:
        return None, None

    def search(self, problem: Any, x: Any, stages: Any, bars: Any = ()) -> Any:
        return SimpleNamespace(cost=self.cost)  # type: ignore[attr-defined]

    def _stopped(self, hypotheses: Any, found: Any, costs: Any) -> Any:
        return "stopped"

    def _led_on(self, first: First, bars: Any = (), stages: Any = ()) -> Any:
        return "led on"


@pytest.mark.parametrize(("cost", "ends"), [(ACCEPTED, "led on"), (22.0, "led on"), (24.0, "stopped")])
def test_a_quick_trial_ends_early_only_where_it_gains_less_than_half_of_what_was_accepted(cost, ends):
    best, accepted = (cast(Refit, SimpleNamespace(costs=(c, 100.0 * c))) for c in (BEST, ACCEPTED))
    assert ACCEPTED > 0.5 * BEST, "what was accepted halves nothing itself"
    assert Searched(cost).quick((), best, Race.bars(best, [accepted])) == ends


class Ends:
    """A refitter that fits to the end what it is given, as long as there is work."""

    def __init__(self, spent: bool) -> None:
        self.work = SimpleNamespace(spent=spent)

    def finish(self, refit: Any) -> Any:
        return tried(0.0, finished=True, complete=True)


def tried(squares: float, *, finished: bool = False, complete: bool = False) -> Any:
    return SimpleNamespace(squares=squares, finished=finished, complete=complete, hypotheses=())


def led_on(refits: list[Any], *, spent: bool = False) -> list[Any]:
    race = Race(cast(Refitter, Ends(spent)), Clock(None))
    return race.led_on(tried(1000.0), refits, least=400.0)


def test_where_none_helps_who_was_given_up_and_foretells_best_is_fitted_to_the_end():
    ended, best, other = tried(500.0, finished=True), tried(540.0), tried(560.0)
    found = led_on([ended, other, best])
    assert found[:2] == [ended, other]
    assert found[2].finished
    assert found[2] is not best


def test_who_removes_less_than_is_asked_or_finds_no_work_left_stays_given_up():
    little, much = tried(700.0), tried(540.0)
    assert led_on([little]) == [little]
    assert led_on([much], spent=True) == [much]
    assert led_on([tried(0.0, finished=True)])[0].squares == 0.0
