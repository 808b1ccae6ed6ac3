"""Recordings held out that reach beyond those fitted: one machine for all of them is no mismatch."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import analytic
from forklift.diagnosis import sentences
from forklift.diagnosis.refitter import Refitter
from test_astray import TIME, Recording, ringing, slopes

START, TRUE, NOISE, SHORT = 8.5, 9.0, 0.3, 24
"""Angular frequencies [rad/s]; the noise; how many samples of a recording are fitted. In so short a time the
phase hardly turns: what the fit does not know of the frequency is radians at the end of a whole recording."""


def formula(parameters: np.ndarray) -> np.ndarray:
    return ringing(START + parameters)


def its_slopes(parameters: np.ndarray) -> np.ndarray:
    return slopes(START + parameters)


def refitter(of_held_out: float, other: float | None = None) -> Refitter:
    """Three short recordings to be fitted, and two long ones held out, of machines with these frequencies."""
    random = np.random.default_rng(5)
    held = [np.sin(omega * TIME) for omega in (of_held_out, other or of_held_out)]
    measured = np.array([np.sin(TRUE * TIME)] * 3 + held)
    measured += NOISE * random.standard_normal(measured.shape)
    everyone = analytic.problem(measured, [analytic.unknown("omega")], formula, its_slopes, NOISE)
    samples = []
    for k, one in enumerate(everyone.samples):
        role, rows = ("estimate", SHORT) if k < 3 else ("validate", len(TIME))
        (seen,) = one.observed
        seen = replace(seen, rows=seen.rows[:rows], values=seen.values[:rows])
        samples.append(replace(one, recording=Recording(f"{k}.csv", role), observed=(seen,)))
    everyone = everyone.over(samples)
    return Refitter(everyone.over(samples[:3]), everyone, analytic.sensors(everyone))


def first(refitter: Refitter):
    """The machine fitted, as it was before recordings held out are asked."""
    return replace(refitter, strict=True).baseline()


def test_what_all_recordings_together_explain_is_complete():
    found = refitter(TRUE)
    alone, led = first(found), found.baseline()
    assert not alone.complete
    assert all(one.explained for one in alone.rest())
    assert led.complete
    assert START + led.found.x[0] == pytest.approx(TRUE, abs=0.01)


def test_what_no_machine_explains_stays_as_it_was_fitted():
    found = refitter(1.05 * TRUE)
    before = first(found).found.x
    led = found.baseline()
    assert not led.complete
    assert led.found.x == pytest.approx(before)


def test_what_leaves_less_where_all_recordings_led_it_is_taken_if_that_is_asked_for():
    """Recordings that were fitted may lead astray beyond them, where little shows in any."""
    found = refitter(TRUE, 1.025 * TRUE)
    alone = first(found)
    assert found.pooled(alone) is alone
    led = found.pooled(alone, nearly=True)
    assert not led.complete
    assert led.squares < 0.5 * alone.squares
    assert TRUE < START + led.found.x[0] < 1.025 * TRUE


def test_what_all_recordings_led_is_known_as_these_tell_it():
    found = refitter(TRUE)
    alone, led = first(found), found.baseline()
    assert led.pooled
    assert not alone.pooled
    assert led.knowledge.estimates[0].deviation < 0.1 * alone.knowledge.estimates[0].deviation
    assert led.knowledge.estimates[0].value == pytest.approx(led.found.x[0])


def test_what_recordings_held_out_alone_show_these_lead():
    """As of a cushion that none of the fitted recordings met."""
    found = refitter(TRUE)
    alone = first(found)
    assert alone.held_out_alone
    led = found.by_all((), alone)
    assert led.complete
    assert led.pooled
    assert START + led.found.x[0] == pytest.approx(TRUE, abs=0.01)


@pytest.mark.parametrize("told", [False, True], ids=["untold", "told"])
def test_what_is_asked_of_all_recordings_they_lead_if_those_that_were_fitted_say_too_little(
    told, monkeypatch
):
    found = refitter(TRUE)
    led = found.baseline()
    few = replace(led, pooled=False)
    monkeypatch.setattr(type(led), "clear", lambda self, name: told or self.pooled)
    (name,) = [object()]
    asked = found.asked(few, [name])
    assert asked.pooled is not told


def test_beside_what_all_recordings_led_they_lead_too(monkeypatch):
    """Else a true name would have to explain recordings held out better than what was fitted to them."""
    found = refitter(TRUE)
    monkeypatch.setattr("forklift.diagnosis.refitter.loo_log_scores", lambda problem, x, new: np.zeros(5))
    led = found.baseline()
    monkeypatch.setattr(Refitter, "pooled", lambda self, refit, nearly=False: refit)
    assert found.slightly((), led).pooled
    assert not found.slightly((), replace(led, pooled=False)).pooled


@pytest.mark.parametrize(
    ("pooled", "role", "said"),
    [
        (True, "validate", "held out, and fitted in the end,"),
        (False, "validate", "held out"),
        (False, "estimate", "it was fitted on"),
    ],
)
def test_the_sentence_says_where_recordings_held_out_were_fitted_in_the_end(pooled, role, said):
    found: Any = SimpleNamespace(judged_on=role, causes=("a leak",), final=SimpleNamespace(pooled=pooled))
    assert sentences.judged_on(found) == said
    assert bool(sentences.led(found)) is pooled
    found.causes = ()
    assert not sentences.led(found)
