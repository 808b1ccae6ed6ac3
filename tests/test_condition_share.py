"""How much a condition entered wrongly must explain to be told, and how much a law."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from forklift.diagnosis.rules import helping


def refit(hypotheses=(), *, squares, complete=False, mean_square=80.0):
    return SimpleNamespace(
        hypotheses=hypotheses,
        complete=complete,
        strained=False,
        strains_alone=False,
        slight=False,
        finished=True,
        identifiable=True,
        squares=squares,
        excess=100_000.0,
        missing=0.0 if complete else 1.0,
        loo_log_score=None,
        worst=SimpleNamespace(mean_square=mean_square),
    )


TEMPERATURE = SimpleNamespace(label="temperature_offset", amplitude=None, kind="parameter")
LAW = SimpleNamespace(label="free.leakage", amplitude="free.leakage.coefficient", kind="physics")
CURVE = SimpleNamespace(label="free.unknown", amplitude="free.free_shape.shape_0", kind="unknown")
REFITTER = SimpleNamespace(together=1.0, later=0.5)
BEST = refit(squares=120_000.0)


@pytest.mark.parametrize(
    ("removes", "condition", "law"), [(0.05, False, False), (0.4, False, True), (0.6, True, True)]
)
def test_beside_a_curve_what_has_a_freedom_in_every_recording_must_remove_most(removes, condition, law):
    left = BEST.squares - removes * BEST.excess
    shapes = [refit((CURVE,), squares=BEST.squares - 0.01 * BEST.excess)]
    assert bool(helping([refit((TEMPERATURE,), squares=left)], BEST, REFITTER, shapes)) is condition
    assert bool(helping([refit((LAW,), squares=left)], BEST, REFITTER, shapes)) is law
    both = refit((LAW, TEMPERATURE), squares=left)
    assert bool(helping([both], BEST, REFITTER, shapes)) is law


def test_before_a_curve_was_tried_it_leads_to_one():
    left = BEST.squares - 0.4 * BEST.excess
    assert helping([refit((TEMPERATURE,), squares=left)], BEST, REFITTER, ())
