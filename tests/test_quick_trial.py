"""What is tried beside an explanation that was accepted goes on as long as it keeps up with that."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

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
