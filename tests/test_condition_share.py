"""How much a condition entered wrongly must explain to be told, and how much a law."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace

import pytest

from forklift.diagnosis.rules import helping
from test_strained import LAW, REFITTER, refit

clear = partial(refit, excess=100_000.0, mean_square=80.0)
TEMPERATURE = SimpleNamespace(label="temperature_offset", amplitude=None, kind="parameter")
CURVE = SimpleNamespace(label="free.unknown", amplitude="free.free_shape.shape_0", kind="unknown")
BEST = clear(squares=120_000.0)


@pytest.mark.parametrize(
    ("removes", "condition", "law"), [(0.05, False, False), (0.4, False, True), (0.6, True, True)]
)
def test_beside_a_curve_what_has_a_freedom_in_every_recording_must_remove_most(removes, condition, law):
    left = BEST.squares - removes * BEST.excess
    shapes = [clear((CURVE,), squares=BEST.squares - 0.01 * BEST.excess)]
    assert bool(helping([clear((TEMPERATURE,), squares=left)], BEST, REFITTER, shapes)) is condition
    assert bool(helping([clear((LAW,), squares=left)], BEST, REFITTER, shapes)) is law
    both = clear((LAW, TEMPERATURE), squares=left)
    assert bool(helping([both], BEST, REFITTER, shapes)) is law


def test_before_a_curve_was_tried_it_leads_to_one():
    left = BEST.squares - 0.4 * BEST.excess
    assert helping([clear((TEMPERATURE,), squares=left)], BEST, REFITTER, ())
