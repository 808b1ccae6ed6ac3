"""What recordings have of their own, sought with all else held: a load or a temperature that is far off."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.fitting import levenberg_marquardt
from forklift.fitting.criteria import NUISANCE_GAIN
from forklift.fitting.search import STAGES

TEMPERS = (30.0, 3.0, 1.0)
"""The noise is so many times too large, stage by stage: from a temperature that is ten kelvin off the way to
the right one leads over worse ones."""
EVALUATIONS = 20
"""Of each stage, at most."""


def sought(problem: Any, x: Floats) -> Floats:
    """The place x with each recording's own unknowns where they explain it best.

    All that recordings share is held, so that it costs a few derivatives only.
    """
    held, at = problem.with_fixed(x, (), conditions=True)
    pinned = copy(held)
    pinned.unknowns = tuple(
        replace(unknown, lower=float(here), upper=float(here))
        for unknown, here in zip(held.unknowns, at, strict=False)
    )
    shared = len(held.unknowns)
    for temper in TEMPERS:
        # What coarse substeps leave over is far below noise that is too large.
        substeps = min(problem.substeps, STAGES[0].substeps) if temper > 1.0 else problem.substeps
        weights = {name: temper * sigma for name, sigma in problem.sigma.items()}
        weighted = pinned.weighted(weights, substeps)
        at = levenberg_marquardt.descend(weighted, at, EVALUATIONS, NUISANCE_GAIN, lambda cost, x: None)
    return np.concatenate([x[: len(problem.unknowns)], at[shared:]])
