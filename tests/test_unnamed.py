"""For what hypotheses without a name are asked: never beside names that explain everything together."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis.criteria import DOUBTFUL
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit, Refitter
from forklift.diagnosis.selection import General, without_names


@dataclass(frozen=True, eq=False)
class Tried:
    """A refit as far as this decision needs it."""

    hypotheses: tuple[str, ...]
    complete: bool = False
    told: float = 4.0
    slight: bool = False
    strained: bool = False
    worst: Any = field(default_factory=lambda: SimpleNamespace(mean_square=10.0))

    def deviations(self, hypothesis):
        return self.told


NOTHING = Tried(())
LEAK, BOTH = Tried(("leak",)), Tried(("leak", "delay"))
LEAK_IS_ALL, BOTH_ARE_ALL = Tried(("leak",), complete=True), Tried(("leak", "delay"), complete=True)
BOTH_BEYOND_DOUBT = Tried(("leak", "delay"), complete=True, told=100.0)


@pytest.mark.parametrize(
    ("accepted", "asked_beside"),
    [
        ((), [NOTHING]),
        ((LEAK,), [LEAK, NOTHING]),
        ((LEAK, BOTH), [LEAK, NOTHING]),
        ((LEAK_IS_ALL,), []),
        ((LEAK, BOTH_ARE_ALL), [LEAK]),
        ((BOTH_ARE_ALL,), []),
        ((LEAK, BOTH_BEYOND_DOUBT), []),
    ],
    ids=[
        "none",
        "one",
        "two",
        "one explains all",
        "a second explains the rest",
        "two at once explain all",
        "two beyond doubt",
    ],
)
def test_who_is_asked_for_beside_whom(accepted, asked_beside):
    asked = []

    def general(refit):
        asked.append(refit)
        return []

    named = [cast(Refit, refit) for refit in accepted]
    best = named[-1] if named else cast(Refit, NOTHING)
    race = Race(cast(Refitter, None), Clock())
    without_names(race, cast(Refit, NOTHING), named, best, cast(General, general))
    assert asked == asked_beside


@pytest.mark.parametrize(("left", "asked_for"), [(0.9 * DOUBTFUL, 0), (1.1 * DOUBTFUL, 1)])
def test_what_may_be_chance_is_no_curve_s(left, asked_for):
    nothing = Tried((), worst=SimpleNamespace(mean_square=left))
    asked = []

    def general(refit):
        asked.append(refit)
        return []

    race = Race(cast(Refitter, None), Clock())
    without_names(race, cast(Refit, nothing), [], cast(Refit, nothing), cast(General, general))
    assert len(asked) == asked_for
