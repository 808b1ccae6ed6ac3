"""What a cause does in use: the machine as it was found beside the same machine without it.

Nothing is fitted anew: every recording is simulated twice with the load, oil temperature, start and
parameters that were found, once with the cause and once with it taken out. Those held out speak, if there are
any.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.threads import one_thread
from forklift.fitting.problem import LeastSquares
from forklift.plant.protocol import Hypothesis
from forklift.plant.subject import Subject


@dataclass(frozen=True)
class InUse:
    """The recording whose driven signal a cause changes most, for its size.

    Attributes
    ----------
    file
        Of the recording.
    signal, unit
        Which, and the unit of what follows.
    present, absent
        Its mean over the recording with the cause, and without it.
    most, at_s
        By how much the two differ at most, and when.
    """

    file: str
    signal: str
    unit: str
    present: float
    absent: float
    most: float
    at_s: float

    def to_dict(self) -> dict[str, Any]:
        """As ``diagnosis.json`` has it."""
        return asdict(self)


def in_use(
    machine: Subject, problem: LeastSquares, x: Floats, together: Sequence[Sequence[Hypothesis]]
) -> list[InUse | None]:
    """For each group of hypotheses that is taken out together, what it does; None of what changes no output,
    as a sensor does, or where the machine does not run without it.

    Parameters
    ----------
    problem, x
        All recordings, and the whole unknown vector with every recording's own at its best.
    together
        Of each cause its hypothesis, and the curve that mends its law.
    """
    held = any(sample.recording.role == "validate" for sample in problem.samples)
    with one_thread():
        present = problem.run(x, read=False)
        found: list[InUse | None] = []
        for group in together:
            names = {name for one in group if one.kind in ("physics", "unknown") for name in one.amplitudes}
            own = [k for k, unknown in enumerate(problem.unknowns) if unknown.name in names]
            absent = x.copy()
            absent[own] = 0.0
            try:
                without = problem.run(absent, read=False) if own else []
            except ForkliftError:
                without = []
            every = [
                one
                for sample, here, there in zip(problem.samples, present, without, strict=False)
                if not held or sample.recording.role == "validate"
                for one in _changes(machine, sample.recording, here.outputs, there.outputs)
            ]
            found.append(max(every, key=lambda one: one[0])[1] if every else None)
    return found


def _changes(
    machine: Subject, recording: Any, present: Floats, absent: Floats
) -> Iterator[tuple[float, InUse]]:
    """Of every driven signal that a headline tells (or of all), the change beside the signal's own size."""
    sides = [
        [
            one
            for one in machine.signals(recording, dict(zip(machine.outputs, side.T, strict=True)))
            if one.driven
        ]
        for side in (present, absent)
    ]
    headline = [one.channel.startswith(machine.headline) for one in sides[0]]
    for here, there, told in zip(*sides, headline, strict=True):
        change = here.simulated - there.simulated
        if not (told or not any(headline)) or not np.isfinite(change).any():
            continue
        size = float(np.sqrt(np.nanmean(np.square(here.simulated))))
        share = float(np.sqrt(np.nanmean(np.square(change)))) / size if size else 0.0
        if share > 0.0:
            means = float(np.nanmean(here.simulated)), float(np.nanmean(there.simulated))
            at = int(np.nanargmax(np.abs(change)))
            most, at_s = float(np.abs(change[at])), float(recording.time_s[at] - recording.time_s[0])
            yield share, InUse(recording.file, here.channel, here.unit, *means, most, at_s)
