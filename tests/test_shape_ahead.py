"""Which goes first, a name or a curve without one."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from forklift.diagnosis import curve_trials
from forklift.diagnosis.curve_trials import shape_ahead


@dataclass(frozen=True)
class Promise:
    gain: float
    evidence: float = 0.0
    hypotheses: tuple[str, ...] = ("curve",)


@dataclass(frozen=True)
class Screening:
    singles: tuple[Promise, ...]
    pairs: tuple[Promise, ...] = ()


@dataclass
class Race:
    tried: list[str] = field(default_factory=list)

    def beside(self, best: object, hypothesis: str, refits: list[Any]) -> list[Any]:
        self.tried.append(hypothesis)
        return [hypothesis]


class Best:
    quiet = False


@pytest.mark.parametrize(
    ("excess", "names", "evidence", "ahead"),
    [
        (400.0, 60.0, 150.0, True),  # no name promises half of what is left over, and the curve twice as much
        (400.0, 60.0, 110.0, False),
        (100.0, 60.0, 150.0, False),  # a name promises most of it
        (0.0, 60.0, 150.0, True),  # less than the noise is left over in all, and yet 60 may be gained
        (50.0, 60.0, 150.0, True),
        (0.0, 90.0, 150.0, False),
    ],
)
def test_a_curve_goes_first_where_no_name_promises_much(
    monkeypatch: pytest.MonkeyPatch, excess: float, names: float, evidence: float, ahead: bool
) -> None:
    monkeypatch.setattr(curve_trials, "by_chance", lambda best: False)
    monkeypatch.setattr(curve_trials, "excess_screened", lambda best, screening: excess)
    race = Race()
    curves = [Promise(evidence + 10.0, evidence)]
    screening = Screening((Promise(names),))
    given: Any = (race, Best(), screening, lambda best: curves)
    shape_ahead(*given)
    assert race.tried == (["curve"] if ahead else [])
