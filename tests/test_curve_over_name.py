"""Where nothing shows by itself, a curve goes before a name only by a clear margin."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import analytic
from forklift.diagnosis.criteria import AS_NEAR
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.rules import foretells_better, has_more_evidence, promises_more

CLEAR = 0.5 * AS_NEAR
FRICTION = SimpleNamespace(label="free.friction_position")
CUSHION = SimpleNamespace(label="free.end_cushion")
SCREENING: Any = SimpleNamespace(singles=(SimpleNamespace(hypotheses=(FRICTION,), evidence=76.0, gain=80.0),))


def refit(
    *hypotheses: Any,
    quiet: bool = True,
    score: float | None = None,
    squares: float = 100.0,
    cost: float = 1000.0,
) -> Any:
    return SimpleNamespace(
        hypotheses=hypotheses, quiet=quiet, loo_log_score=score, squares=squares, cost=cost
    )


REFITTER: Any = SimpleNamespace(gained=lambda before, after: before.cost - after.cost)
"""Which says what each explains of all recordings."""


@pytest.mark.parametrize(
    ("evidence", "names", "quiet", "asked"),
    [
        (76.0 + CLEAR + 1.0, (FRICTION,), True, True),
        (76.0 + CLEAR - 1.0, (FRICTION,), True, False),
        (200.0, (FRICTION,), False, False),  # where something shows, other rules tell
        (200.0, (FRICTION, CUSHION), True, False),
        (200.0, (CUSHION,), True, False),  # that was not screened with the curve
    ],
)
def test_a_curve_is_fitted_beside_a_name_that_promised_clearly_less(evidence, names, quiet, asked):
    curve: Any = SimpleNamespace(evidence=evidence)
    assert promises_more(curve, refit(*names), refit(quiet=quiet), SCREENING) is asked


@pytest.mark.parametrize(
    ("curve", "names", "better"),
    [
        (82.0 + CLEAR + 1.0, (82.0,), True),
        (82.0 + CLEAR - 1.0, (82.0,), False),
        (82.0 + CLEAR + 1.0, (80.0, 2.0), True),  # each beside those before it
        (82.0 + CLEAR - 1.0, (80.0, 2.0), False),
        (None, (82.0,), False),
        (200.0, (82.0, None), False),
    ],
)
def test_and_told_if_recordings_foretell_each_other_better_by_it(curve, names, better):
    named = [refit(score=one) for one in names]
    assert foretells_better(refit(score=curve, cost=900.0), named, REFITTER) is better


@pytest.mark.parametrize(("squares", "better"), [(99.0, True), (101.0, False)])
def test_but_not_if_it_leaves_more_over_than_the_last_of_them(squares, better):
    named = [refit(score=80.0, squares=150.0), refit(score=2.0, squares=100.0)]
    assert foretells_better(refit(score=200.0, squares=squares, cost=900.0), named, REFITTER) is better


@pytest.mark.parametrize(("gain", "better"), [(CLEAR + 1.0, True), (CLEAR - 1.0, False)])
def test_nor_if_the_names_at_their_best_explain_nearly_as_much(gain, better):
    """A lag lives on its time: from none, a linear step promises little of it."""
    named = [refit(score=80.0)]
    assert foretells_better(refit(score=200.0, cost=1000.0 - gain), named, REFITTER) is better


class Ended(SimpleNamespace):
    """A refit as far as a comparison of costs needs it."""

    __hash__ = object.__hash__


def test_costs_are_compared_with_the_same_weights():
    """Who explains more has smaller weights of its own, and so a greater cost for the same residuals."""
    unknowns = [analytic.unknown(name) for name in ("p0", "p1")]
    problem = analytic.problem(np.array([0.3, -0.2]), unknowns, lambda p: p, lambda p: np.eye(2), 0.01)
    refitter = Refitter(problem, problem, analytic.sensors(problem))

    def fitted(factor: float) -> Any:
        own = problem.weighted({name: factor * sigma for name, sigma in problem.sigma.items()})
        refit = Ended()
        refitter.known[refit] = SimpleNamespace(
            problem=own, x=np.zeros(own.starts[-1]), evaluations=1, cost=100.0 / factor
        )
        return refit

    rough, fine = fitted(3.0), fitted(1.0)
    assert refitter.gained(rough, fine) == pytest.approx(0.0, abs=1e-9)  # the same place


@pytest.mark.parametrize(
    ("evidence", "quiet", "first"),
    [(76.0 + CLEAR + 1.0, True, True), (76.0 + CLEAR - 1.0, True, False), (200.0, False, False)],
)
def test_such_a_curve_is_fitted_before_names_use_up_the_work(evidence, quiet, first):
    curve: Any = SimpleNamespace(evidence=evidence)
    assert has_more_evidence(curve, SCREENING, refit(quiet=quiet)) is first
    none: Any = SimpleNamespace(singles=())
    assert not has_more_evidence(curve, none, refit(quiet=quiet))
