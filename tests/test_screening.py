"""All hypotheses at once are what each is alone: what is quiet has no say in how a model answers the
others."""

from __future__ import annotations

from collections import Counter
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from forklift.base.errors import ForkliftError
from forklift.diagnosis.hypothesis import Hypothesis, carry
from forklift.diagnosis.screening import Screened, Screening, screen, screen_both
from forklift.fitting.problem import LeastSquares
from forklift.plant.forklift.hypotheses import hypotheses
from test_problem import problem, somewhere

TRAVELLED = {"free": (0.2, 1.9)}
ROUNDED = 1e-6
"""Share of a gain that other orders of addition may move: the normal equations are far from round."""


@cache
def every() -> tuple[Hypothesis, ...]:
    measured = [seen.sensor.channel for seen in problem().samples[0].observed]
    return hypotheses(problem().machine.truck, ["free"], measured, TRAVELLED)


@cache
def together() -> Screening:
    return screen(problem(), somewhere(0), every())


def gains(screening: Screening) -> dict[Hypothesis, float]:
    return {one.hypotheses[0]: one.gain for one in screening.ranked}


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[set[str]]:
    """The unknowns of every problem that is linearised."""
    seen: list[set[str]] = []
    linearise = LeastSquares.linearise

    def counted(self: LeastSquares, x: np.ndarray):
        seen.append({unknown.name for unknown in self.unknowns})
        return linearise(self, x)

    monkeypatch.setattr(LeastSquares, "linearise", counted)
    return seen


@pytest.mark.parametrize("k", range(0, 60, 7))
def test_a_suspect_promises_beside_all_others_what_it_promises_alone(k):
    one = every()[k]
    alone = gains(screen(problem(), somewhere(0), [one])).get(one, 0.0)
    assert gains(together()).get(one, 0.0) == pytest.approx(alone, rel=ROUNDED, abs=1e-9)


def test_what_these_recordings_cannot_tell_is_not_lost():
    tried = {one.label for one in every()}
    told = {one.hypotheses[0].label for one in together().singles}
    unidentifiable = {one.label for one in together().untestable}
    assert told | unidentifiable == tried
    assert not told & unidentifiable
    assert "free.end_cushion" in unidentifiable  # the lift stays away from its end


def test_suspects_share_runs_unless_they_share_unknowns(runs):
    screen(problem(), somewhere(0), every())
    variants = Counter(one.label for one in every())
    most_alike = max(variants.values())
    assert len(runs) - 1 <= 2 * most_alike < len(every()) / 3
    assert all(len(names) <= 16 for names in runs[1:])


def test_a_suspect_whose_run_fails_takes_no_other_with_it(monkeypatch):
    linearise = LeastSquares.linearise

    def failing(self: LeastSquares, x: np.ndarray):
        if any(unknown.name == "free.leakage.coefficient" for unknown in self.unknowns):
            raise ForkliftError("not-finite", "It burst.")
        return linearise(self, x)

    monkeypatch.setattr(LeastSquares, "linearise", failing)
    found = screen(problem(), somewhere(0), every())
    assert "free.leakage" in {one.label for one in found.untestable}
    left = {one: gain for one, gain in gains(together()).items() if one.label != "free.leakage"}
    assert gains(found) == pytest.approx(left, rel=ROUNDED, abs=1e-9)


def test_an_interruption_is_no_answer(monkeypatch):
    def interrupted(self: LeastSquares, x: np.ndarray):
        if len(self.unknowns) <= 16:
            raise KeyboardInterrupt
        return linearise(self, x)

    linearise = LeastSquares.linearise
    monkeypatch.setattr(LeastSquares, "linearise", interrupted)
    with pytest.raises(KeyboardInterrupt):
        screen(problem(), somewhere(0), every())


def test_without_encoders_only_other_sensors_promise_anything():
    """What an encoder alone shows may be its rounding; what a pressure shows is not."""
    all_of_them = gains(together())
    _, heard = screen_both(problem(), somewhere(0), every())
    encoders = {
        seen.sensor.channel for sample in problem().samples for seen in sample.observed if seen.sensor.count
    }
    assert encoders
    silent = [one for one in every() if one.kind == "sensor" and one.where in encoders]
    assert silent
    assert all(one in heard.untestable for one in silent)
    others = gains(heard)
    pressures = [one for one in every() if one.kind == "sensor" and one.where.startswith("pressure_")]
    assert any(others.get(one, 0.0) > 0.5 * all_of_them[one] > 0.0 for one in pressures)


def test_a_law_goes_before_a_condition_that_gains_more_by_a_freedom_in_every_recording():
    """Each recording's own temperature followed a viscosity that falls by another law."""
    law = SimpleNamespace(amplitude="share")
    temperature = SimpleNamespace(amplitude=None)
    by_law = Screened((cast(Hypothesis, law),), 987.0, (4.0,), (0.1,), 984.0)
    by_condition = Screened((cast(Hypothesis, temperature),), 1027.0, (np.nan,), (np.nan,), 961.0)
    assert by_law.worth > by_condition.worth


def test_a_condition_that_is_as_vague_already_promises_next_to_nothing_more():
    """Loads that are known no better than a doubt of them would have it."""
    (load,) = (one for one in every() if one.label == "load_entered")
    vague = problem().with_addition(load.addition)
    assert gains(screen(problem(), somewhere(0), [load]))[load] > 0.0
    again = gains(screen(vague, carry(somewhere(0), problem(), vague), [load]))
    assert 0.0 <= again[load] < gains(screen(problem(), somewhere(0), [load]))[load]
