"""What a fitted machine says of every recording, as it was judged: one simulation for curves and numbers.

Each recording has the conditions that explain it best (its load, oil temperature and start, as far as they
are unknown), whatever was entered. Nothing else is adjusted, and no state is corrected by a measurement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.fitting.criteria import FAR
from forklift.fitting.problem import LeastSquares
from forklift.fitting.residuals import MOST_MOVES, settled


@dataclass(frozen=True, eq=False)
class Predicted:
    """One recording.

    Attributes
    ----------
    recording
        What was recorded.
    conditions
        By name, as they were found, in their units.
    outputs
        By name, (times,): the machine's own.
    readings
        By name, (times,): what the sensors read of it, with the gain, offset or lag that was found.
    """

    recording: Any
    conditions: Mapping[str, float]
    outputs: Mapping[str, Floats]
    readings: Mapping[str, Floats]

    @property
    def time_s(self) -> Floats:
        """(times,) of the recording [s]."""
        return self.recording.time_s  # type: ignore[no-any-return]


def predict_all(problem: LeastSquares, x: Floats) -> tuple[Predicted, ...]:
    """Every recording of a problem.

    Parameters
    ----------
    x
        The whole unknown vector, see `settled_within`.

    Raises
    ------
    ForkliftError
        If a run fails.
    """
    with one_thread():
        own, read = problem.run(x, read=False), problem.run(x)
    names = problem.machine.outputs
    return tuple(
        Predicted(
            sample.recording,
            dict(zip(sample.names, problem.conditions(x, k).tolist(), strict=True)),
            dict(zip(names, own[k].outputs.T, strict=True)),
            dict(zip(names, read[k].outputs.T, strict=True)),
        )
        for k, sample in enumerate(problem.samples)
    )


def settled_within(
    problem: LeastSquares, theta: Floats, *, far: float = FAR, moves: int = MOST_MOVES
) -> Floats:
    """The whole unknown vector within its bounds: the shared unknowns given, every recording's own where they
    explain it best.

    Parameters
    ----------
    theta
        (unknowns,) at their best.
    far, moves
        As `forklift.fitting.residuals.judge` takes them.
    """
    with one_thread():
        x: Floats = np.clip(settled(problem, theta, far=far, moves=moves), *problem.bounds())
    return x
