"""What a refit hands on to the questions that are asked of all recordings."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import analytic
from forklift.diagnosis.refitter import OVER_ALL, Refitter


class Ended(SimpleNamespace):
    """A refit as far as this question needs it."""

    __hash__ = object.__hash__


@pytest.mark.parametrize("needed", [4, OVER_ALL.substeps, 32])
def test_all_recordings_are_fitted_with_no_longer_substeps_than_a_trial_needed(needed):
    unknowns = [analytic.unknown(name) for name in ("p0", "p1")]
    problem = analytic.problem(np.array([0.3, -0.2]), unknowns, lambda p: p, lambda p: np.eye(2), 0.01)
    told = problem.weighted(problem.sigma, needed)
    refit = Ended(hypotheses=(), found=SimpleNamespace(problem=told, x=np.zeros(told.starts[-1])))
    found = Refitter(problem, problem, analytic.sensors(problem)).everywhere(refit)
    assert found.problem.substeps == max(needed, OVER_ALL.substeps)
