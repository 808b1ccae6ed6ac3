"""For what hypotheses without a name are asked: never beside names that explain everything together."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from forklift.diagnosis import curve_trials, curves
from forklift.diagnosis.criteria import DOUBTFUL, PAIR
from forklift.diagnosis.curve_trials import General, without_names
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter


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


@dataclass(frozen=True)
class Curve:
    """As a hypothesis, and screened."""

    over: str
    evidence: float = 0.0
    gain: float = 500.0

    @property
    def hypotheses(self) -> tuple[Curve, ...]:
        return (self,)


@dataclass
class Fits:
    """A race in which every trial ends, and explains most but not all."""

    tried: list[tuple[Any, ...]] = field(default_factory=list)
    clock: Any = field(default_factory=lambda: SimpleNamespace(plan=lambda count: None))
    refitter: Any = None

    def beside(self, best: Any, curve: Curve, refits: list[Any]) -> list[Any]:
        one = Ended((*best.hypotheses, curve))
        self.tried.append(one.hypotheses)
        return [*refits, one]


@dataclass(frozen=True, eq=False)
class Ended(Tried):
    finished: bool = True
    squares: float = 300.0
    excess: float = 0.0


@pytest.mark.parametrize(
    ("promised", "evidence", "alone"),
    [
        (300.0, 1.01 * PAIR * 300.0, True),
        (300.0, 0.99 * PAIR * 300.0, False),
        (0.0, 900.0, False),  # the name was not screened with it
    ],
)
def test_a_curve_that_promised_clearly_more_is_tried_instead_of_a_name_that_needs_one(
    monkeypatch: pytest.MonkeyPatch, promised: float, evidence: float, alone: bool
) -> None:
    """A valve that needs the longer the further it has to go, told as a dead time with a curve."""
    monkeypatch.setattr(curve_trials, "twinned", lambda race, refits, general: refits)
    baseline = cast(Refit, Ended((), squares=1000.0, excess=900.0))
    delay = cast(Refit, Ended(("dead time",), squares=600.0, excess=500.0))
    beside, instead = Curve("change of the command"), Curve("how far it has to go", evidence)
    race: Any = Fits()

    def general(refit: Any) -> list[Curve]:
        return [beside] if refit.hypotheses else [instead]

    without_names(race, baseline, [delay], delay, cast(General, general), promised=promised)
    assert race.tried == [("dead time", beside), *([(instead,)] if alone else [])]


def test_what_is_no_curve_is_offered_at_every_place_that_is_nearly_as_credible(monkeypatch):
    """The first place may explain as much as the right one: a valve's answer is no matter of the oil's."""
    places = {
        name: SimpleNamespace(name=name, part="main", equation=name) for name in ("bulk", "valve", "far")
    }
    machine = SimpleNamespace(
        past=frozenset(),
        places=list(places.values()),
        unnamed=lambda place, _: ("ringing", f"{place.name}'s own"),
    )
    problem = SimpleNamespace(samples=(), moments=lambda x, part: [{"still": np.zeros(3)}])
    at = SimpleNamespace(problem=problem, x=np.zeros(1))
    refit = cast(Any, _Bare(early=at, told_from=at))
    inputs = [
        SimpleNamespace(port=name, evidence=ln)
        for name, ln in (("bulk", 100.0), ("valve", 98.0), ("far", 9.0))
    ]
    offered: list[Any] = []

    def screened(problem: Any, x: Any, hypotheses: Any, pairs: int, slow: bool) -> Any:
        offered.extend(hypotheses)
        return SimpleNamespace(ranked=[])

    monkeypatch.setattr(curves, "screen", screened)
    assert curves.FreeCurves(cast(Any, machine), {refit: cast(Any, inputs)})(refit) == []
    assert offered == ["ringing", "bulk's own", "valve's own"]


@dataclass(frozen=True, eq=False)
class _Bare:
    """A fit without any hypothesis."""

    early: Any
    told_from: Any
    hypotheses: tuple[()] = ()
    quiet: bool = False
