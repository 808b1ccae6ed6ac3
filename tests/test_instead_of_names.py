"""A curve elsewhere stands for names that are not there beside it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from forklift.diagnosis.criteria import CLEARLY, LEAST_GAIN
from forklift.diagnosis.curve_trials import instead_of_names
from forklift.diagnosis.race import Race
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.rules import outdoes
from test_choice import Name, Tried

TYRES = Name("tyres", where="", equation="chassis")
FLOW = Name("curve", "unknown", where="free", equation="cylinder-pressure")
LEFT = 4000.0


def names(left: float = LEFT, **known: Any) -> Tried:
    return Tried((TYRES,), 10000.0 + left, left, **known)


def curve(left: float, *hypotheses: Name, **known: Any) -> Tried:
    return Tried(hypotheses or (FLOW,), 10000.0 + left, left, **known)


class Both:
    """The machine with both, in which the names are told from none or not; and what was asked."""

    def __init__(self, *clear: bool, work: bool = True) -> None:
        self.clear, self.work = iter(clear), work
        self.asked: list[tuple[Name, ...]] = []

    def race(self) -> Race:
        refitter = SimpleNamespace(
            beside=lambda hypotheses, after: (hypotheses, after),
            finish=lambda rough: SimpleNamespace(clear=lambda one: next(self.clear)),
        )
        return cast(Race, SimpleNamespace(refitter=refitter, begins=self.begins))

    def begins(self, what: str, hypotheses: tuple[Name, ...]) -> bool:
        self.asked.append(hypotheses)
        return self.work


def stands(one: Tried, best: Tried, both: Both) -> bool:
    refit = cast(Refit, one)
    return instead_of_names(both.race(), cast(Refit, best), [refit]) is refit


def test_it_stands_for_a_name_that_is_not_told_from_none_beside_it():
    both = Both(False)
    assert stands(curve(2000.0), names(), both)
    assert both.asked == [(FLOW, TYRES)]
    assert not stands(curve(2000.0), names(), Both(True))
    assert not stands(curve(2000.0), names(), Both(work=False))  # untried says nothing


@pytest.mark.parametrize(
    ("one", "best"),
    [
        (curve(LEFT - 0.9 * LEAST_GAIN * LEFT), names()),
        (curve(100.0 - 0.9 * CLEARLY), names(100.0)),
        (curve(2000.0), names(complete=True)),
        (curve(2000.0, TYRES, FLOW), names()),
        (curve(2000.0, replace(FLOW, where="", equation="chassis")), names()),
        (curve(2000.0, finished=False), names()),
        (curve(2000.0), Tried((), 10000.0 + LEFT, LEFT)),
    ],
    ids=[
        "a little less",
        "less by chance",
        "complete names",
        "beside them",
        "their place",
        "given up",
        "no names",
    ],
)
def test_nothing_is_asked_where_it_leaves_no_less_or_acts_where_they_do(one: Tried, best: Tried) -> None:
    both = Both(False)
    assert not outdoes(cast(Refit, one), cast(Refit, best))
    assert not stands(one, best, both)
    assert both.asked == []


def test_the_next_is_asked_where_the_best_needs_the_name():
    first, second = curve(1000.0), curve(2000.0, replace(FLOW, equation="bulk-modulus"))
    tried = [cast(Refit, first), cast(Refit, second)]
    assert instead_of_names(Both(False).race(), cast(Refit, names()), tried) is tried[0]
    assert instead_of_names(Both(True, False).race(), cast(Refit, names()), tried) is tried[1]
    assert instead_of_names(Both(True, True).race(), cast(Refit, names()), tried) is None
