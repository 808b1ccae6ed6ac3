"""What a fitted plant foresees of every recording, and how far off it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.diagnosis.criteria import MOVES, NEAR
from forklift.diagnosis.refit import Refit, Refitter
from forklift.fitting.residuals import settled
from forklift.plant.machine import NumpyMachine
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording


@dataclass(frozen=True, eq=False)
class Foreseen:
    """One recording."""

    recording: Recording
    outputs: Mapping[str, Floats]
    """(times,) what each sensor ought to read; NaN where the plant was not run."""
    adjusted: tuple[str, ...]
    """What was adjusted to the recording itself: free starts, and parameters of its own."""

    def errors(self, output: str) -> Floats:
        """(samples,) measured less foreseen, where there is both; none if the output was not recorded."""
        measured = self.recording.y.get(output)
        if measured is None:
            return np.zeros(0)
        off = measured - self.outputs[output]
        return np.asarray(off[np.isfinite(off)])


@dataclass(frozen=True)
class Score:
    """How well one output of one recording is foreseen."""

    file: str
    role: str
    output: str
    samples: int
    rmse_before: float
    """Of the fitted plant, in the output's unit; nothing of the recording is adjusted but its own start."""
    rmse_after: float
    """With what was found."""


def foreseen(
    plant: Plant, recordings: Sequence[Recording], refitter: Refitter, refit: Refit
) -> tuple[Foreseen, ...]:
    """Every recording, with what was fitted on ``estimate``; only what it has of its own is adjusted."""
    problem = refit.found.problem.over(refitter.everyone.samples)
    with one_thread():
        x = settled(problem, refit.found.x[: len(problem.unknowns)], far=NEAR, moves=MOVES)
        runs = iter(problem.run(x))
    samples = iter(problem.samples)
    found = []
    for recording in recordings:
        said = np.full((len(recording), len(plant.outputs)), np.nan)
        names: dict[str, None] = {}
        for piece in NumpyMachine(plant).pieces(recording):
            first = int(np.searchsorted(recording.time_s, piece.time_s[0]))
            said[first : first + len(piece)] = next(runs)[0]
            sample = next(samples)
            names |= dict.fromkeys(sample.names[k] for k in sample.free)
        outputs = {
            one.name: np.clip(column, one.lower, one.upper)
            for one, column in zip(plant.outputs, said.T, strict=True)
        }
        found.append(Foreseen(recording, outputs, tuple(names)))
    return tuple(found)


def scores(plant: Plant, before: Sequence[Foreseen], after: Sequence[Foreseen]) -> Iterator[Score]:
    """Every output of every recording, by both models."""
    for was, now in zip(before, after, strict=True):
        for one in plant.outputs:
            off, still = was.errors(one.name), now.errors(one.name)
            if len(off):
                recording = was.recording
                yield Score(recording.file, recording.role, one.name, len(off), _rms(off), _rms(still))


def _rms(off: Floats) -> float:
    return float(np.sqrt(np.mean(off**2)))
