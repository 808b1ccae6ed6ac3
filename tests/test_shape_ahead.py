"""Which goes first, a name or a curve without one."""

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis import curve_trials
from forklift.diagnosis.curve_trials import shape_ahead, twinned


class Named(str):
    """A hypothesis by its name; a condition has no amplitude."""

    amplitude: str | None = "size"


class Condition(Named):
    amplitude = None


@dataclass(frozen=True)
class Promise:
    gain: float
    evidence: float = 0.0
    hypotheses: tuple[Any, ...] = (Named("curve"),)


@dataclass(frozen=True)
class Screening:
    singles: tuple[Promise, ...]
    pairs: tuple[Promise, ...] = ()


@dataclass
class Race:
    tried: list[str] = field(default_factory=list)

    refitter: Any = None

    def beside(self, best: Any, hypothesis: str, refits: list[Any]) -> list[Any]:
        self.tried.append(hypothesis)
        return [*refits, Best(hypotheses=(*best.hypotheses, hypothesis))]


@dataclass(frozen=True)
class Best:
    hypotheses: tuple[str, ...] = ()
    strained: bool = False
    quiet: bool = False
    finished: bool = True
    complete: bool = False
    told_from: Any = field(default_factory=lambda: SimpleNamespace(problem=None, x=None))


class General:
    """Offers one curve, which has a twin at the other part."""

    def __init__(self, *curves: Promise) -> None:
        self.curves = curves

    def __call__(self, best: Best) -> tuple[Promise, ...]:
        return self.curves

    def twins(self, refit: Best, curve: str) -> list[str]:
        return ["twin"] if curve == "curve" else []


@pytest.mark.parametrize(
    ("excess", "names", "pair", "evidence", "strained", "ahead"),
    [
        # No name promises half of what is left over, and the curve twice as much.
        (400.0, 60.0, None, 150.0, False, True),
        (400.0, 60.0, None, 110.0, False, False),
        (400.0, 60.0, 140.0, 150.0, False, True),
        (400.0, 60.0, 160.0, 150.0, False, False),  # two names promise more than the curve
        (100.0, 60.0, None, 150.0, False, False),  # a name promises most of it
        (100.0, 60.0, None, 150.0, True, True),  # but conditions bend to make up for it: little is left over
        (0.0, 60.0, None, 150.0, False, True),  # less than the noise is left over in all: 60 may be gained
        (50.0, 60.0, None, 150.0, False, True),
        (0.0, 90.0, None, 150.0, False, False),
    ],
)
def test_a_curve_goes_first_where_no_name_promises_much(
    monkeypatch: pytest.MonkeyPatch,
    excess: float,
    names: float,
    pair: float | None,
    evidence: float,
    strained: bool,
    ahead: bool,
) -> None:
    monkeypatch.setattr(curve_trials, "by_chance", lambda best: False)
    monkeypatch.setattr(curve_trials, "excess_screened", lambda best, screening: excess)
    monkeypatch.setattr(curve_trials, "twinned", lambda race, refits, general: refits)
    race = Race()
    screening = Screening((Promise(names),), () if pair is None else (Promise(pair),))
    general = General(Promise(evidence + 10.0, evidence))
    given: Any = (race, Best(strained=strained), screening, general)
    shape_ahead(*given)
    assert race.tried == (["curve"] if ahead else [])


@pytest.mark.parametrize(
    ("evidence", "other", "ahead"),
    [
        (
            1393.0,
            None,
            True,
        ),  # viscosity over pressure, of which each recording's own temperature follows most
        (900.0, None, False),
        (1393.0, 427.0, True),
        (1393.0, 800.0, False),
    ],
)
def test_a_curve_of_more_evidence_goes_before_a_condition_with_a_freedom_in_every_recording(
    monkeypatch: pytest.MonkeyPatch, evidence: float, other: float | None, ahead: bool
) -> None:
    monkeypatch.setattr(curve_trials, "by_chance", lambda best: False)
    monkeypatch.setattr(curve_trials, "excess_screened", lambda best, screening: 1500.0)
    monkeypatch.setattr(curve_trials, "twinned", lambda race, refits, general: refits)
    temperature, name = Condition("temperature"), Named("name")
    singles = [Promise(981.0, 956.0, (temperature,))]
    singles += [] if other is None else [Promise(other, other, (name,))]
    race, screening = Race(), Screening(tuple(singles), (Promise(1500.0, 0.0, (name, temperature)),))
    given: Any = (race, Best(), screening, General(Promise(evidence + 10.0, evidence)))
    shape_ahead(*given)
    assert race.tried == (["curve"] if ahead else [])


@pytest.mark.parametrize(
    ("last", "evidence", "excess", "tried"),
    [
        (Best(("curve",)), 50.0, 400.0, ["twin"]),
        (Best(("curve",)), 50.0, 600.0, []),  # that is little of what is left over
        (Best(("curve",)), 10.0, 0.0, []),
        (Best(("curve",), complete=True), 50.0, 0.0, []),
        (Best(("curve",), finished=False), 50.0, 0.0, []),
        (Best(("curve", "twin")), 50.0, 0.0, []),
    ],
)
def test_what_both_lifts_share_is_tried_on_the_other_one_too(
    monkeypatch: pytest.MonkeyPatch, last: Best, evidence: float, excess: float, tried: list[str]
) -> None:
    """A supply that sags under the other lift's command takes something from each lift."""
    found = SimpleNamespace(ranked=(Promise(60.0, evidence, ("twin",)),))
    monkeypatch.setattr(curve_trials, "screen", lambda *given, **named: found)
    monkeypatch.setattr(curve_trials, "excess_screened", lambda *given: excess)
    race: Any = Race()
    refits: list[Any] = [last]
    told = twinned(race, refits, cast(Any, General()))
    assert race.tried == tried
    assert [one.hypotheses for one in told] == [last.hypotheses, *[("curve", "twin")] * len(tried)]
