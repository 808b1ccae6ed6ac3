"""Beside a name that leaves nothing over a second cause may act, which shows in no channel by itself."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis import selection, sentences
from forklift.diagnosis.criteria import ALARM_CONDITION, ALARM_PHYSICS, CONFIRMED
from forklift.diagnosis.progress import Clock
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.screening import Screened, Screening
from forklift.plant.protocol import Addition, Hypothesis


def hypothesis(id: str, kind: Any = "physics") -> Hypothesis:
    return Hypothesis(id, kind, id, "main", "friction", None if kind == "parameter" else id, Addition())


FIRST, SECOND, LOAD = hypothesis("first"), hypothesis("second"), hypothesis("load", "parameter")
CURVE = hypothesis("curve", "unknown")


def screened(one: Hypothesis, gain: float, evidence: float) -> Screened:
    return Screened((one,), gain, (1.0,), (0.1,), evidence)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A refit that leaves little over, and with any name nothing."""

    hypotheses: tuple[Hypothesis, ...] = ()

    slight = quiet = finished = identifiable = True
    strained = strains_alone = cold = pooled = False
    at_bounds = ()
    loo_log_score = 2.0 * CONFIRMED
    foretold = None
    worst = SimpleNamespace(mean_square=1.5)
    found = told_from = SimpleNamespace(problem=SimpleNamespace(samples=()), x=None)

    @property
    def complete(self) -> bool:
        return bool(self.hypotheses)

    @property
    def squares(self) -> float:
        return 1e4 if self.complete else 2e4

    @property
    def excess(self) -> float:
        return 0.0 if self.complete else 1e4

    @property
    def freedoms(self) -> int:
        return len(self.hypotheses)

    def size(self, hypothesis: Hypothesis) -> float:
        return 1.0

    def deviations(self, hypothesis: Hypothesis) -> float:
        return 100.0


@pytest.fixture
def selected(monkeypatch):
    """What is selected where all recordings promise as much as told of what is beside the first."""

    def select(second: Screened, curve: float, load: float = 0.0) -> set[Hypothesis]:
        promised = {SECOND: second, LOAD: screened(LOAD, load, -50.0), CURVE: screened(CURVE, curve, curve)}

        def screen(problem, x, hypotheses, most=8, slow=False):
            return Screening(0.0, tuple(promised[one] for one in hypotheses), (), ())

        monkeypatch.setattr(selection, "screen", screen)
        refitter: Any = SimpleNamespace(
            together=1.0,
            later=0.5,
            strict=False,
            work=SimpleNamespace(spent=False),
            everywhere=lambda refit: refit.found,
            slightly=lambda hypotheses, after: Fitted(tuple(hypotheses)),
            rough=lambda hypotheses, after: Fitted(tuple(hypotheses)),
            finish=lambda refit: refit,
        )
        general: Any = SimpleNamespace(
            laws=lambda refit, at, slow=False: screen(None, None, [CURVE]), faint=lambda *given: None
        )
        start = Screening(0.0, (screened(FIRST, 1e4, 1e4),), (), ())
        found = selection.select(
            cast(Refitter, refitter),
            cast(Refit, Fitted()),
            start,
            (FIRST, SECOND, LOAD),
            Clock(),
            general,
        )
        return set(found.final.hypotheses)

    return select


def test_a_second_cause_that_shows_in_no_channel_is_asked_for_beside_a_first_that_leaves_nothing(selected):
    assert selected(screened(SECOND, 60.0, 55.0), curve=25.0) == {FIRST, SECOND}


def test_it_must_promise_as_much_as_where_nothing_shows(selected):
    assert selected(screened(SECOND, 0.9 * ALARM_PHYSICS, 8.0), curve=0.0) == {FIRST}


def test_where_another_law_of_the_first_promises_more_no_second_name_is_asked_for(selected):
    assert selected(screened(SECOND, 60.0, 55.0), curve=70.0) == {FIRST}


def test_a_condition_is_asked_for_whatever_a_curve_promises(selected):
    assert LOAD in selected(screened(SECOND, 0.0, 0.0), curve=14.0, load=2.0 * ALARM_CONDITION)


@pytest.mark.parametrize(
    ("complete", "score", "alone"), [(True, 42.0, True), (False, 42.0, False), (True, None, False)]
)
def test_all_recordings_alone_show_it_only_where_none_does_without_any_cause(complete, score, alone):
    found: Any = SimpleNamespace(
        baseline=SimpleNamespace(complete=complete), final=SimpleNamespace(loo_log_score=score)
    )
    assert sentences.in_all_alone(found) is alone
