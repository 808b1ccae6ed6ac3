"""Where a plant and its recordings part, what is missing, and what the model gains by it: one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base import present
from forklift.base.errors import ForkliftError
from forklift.diagnosis import plant_files as files
from forklift.diagnosis.causes import Cause
from forklift.diagnosis.confounding import Confounded, confounded
from forklift.diagnosis.dependence import Shape
from forklift.diagnosis.engine import Clock, Verdict, investigate, verdict
from forklift.diagnosis.group_validation import GroupFold, group_folds, outlying_groups
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.next_recording import Candidate, Proposal, part
from forklift.diagnosis.plant_predict import Foreseen, Score, foreseen, scores
from forklift.diagnosis.refit import Refit, Refitter
from forklift.diagnosis.screening import Screening
from forklift.diagnosis.selection import Selection
from forklift.fitting.intervals import QUANTILE
from forklift.fitting.posing import pose
from forklift.plant.hypotheses import hypotheses
from forklift.plant.machine import NumpyMachine, completed
from forklift.plant.parts import Plant
from forklift.plant.protocol import Hypothesis
from forklift.plant.recording import Recording
from forklift.plant.sensors import sensors
from forklift.recordings.noise import Sensor

BLOCKS = 8
"""Stretches of the held-out recordings, in all, by whose resampling credibility is told: whole recordings
where there are as many."""
LATER = 0.2
"""Share of what is left over that an explanation beside another must remove: on a machine whose model never
reaches the sensors' noise, several effects are the rule, and a second one seldom halves what is left."""

NEAREST = 2
"""How many of the refits that came nearest a recording is asked to part from what was found."""


@dataclass(frozen=True)
class Number:
    """One parameter of the final model."""

    name: str
    unit: str
    value: float
    lower: float
    upper: float
    """95 % interval, widened by how far what is left over is correlated, and by how much more of it there
    is on recordings held out."""


@dataclass(frozen=True, eq=False, repr=False)
class PlantDiagnosis:
    """What `diagnose_plant` gives."""

    plant: Plant
    verdict: Verdict
    causes: tuple[Cause, ...]
    inputs: tuple[UnknownInput, ...]
    """An unknown input at every place, the most credible first."""
    shapes: tuple[Shape, ...]
    """The most credible one as a function of every variable, the best first."""
    selection: Selection
    screening: Screening
    scores: tuple[Score, ...]
    groups: tuple[GroupFold, ...]
    confounded: tuple[Confounded, ...]
    """What could stand for a cause on these recordings, to first order."""
    numbers: tuple[Number, ...]
    numbers_before: tuple[Number, ...]
    """Of the fitted plant, without what was found."""
    next_recording: Proposal | None
    """What would part the rivals, of the candidates that were given."""
    before: tuple[Foreseen, ...]
    """What the fitted plant foresees of every recording."""
    after: tuple[Foreseen, ...]
    """The same with what was found."""
    sensors: Mapping[str, Sensor]
    """By output, its noise and count."""
    seconds: Mapping[str, float]

    @property
    def baseline(self) -> Refit:
        return self.selection.baseline

    @property
    def final(self) -> Refit:
        return self.selection.final

    @property
    def outlying_groups(self) -> tuple[str, ...]:
        """Groups that fit no law that fits the others."""
        return outlying_groups(self.groups)

    @property
    def untestable(self) -> tuple[Hypothesis, ...]:
        """Hypotheses of which these recordings can tell nothing."""
        return self.screening.unidentifiable

    def rmse(self, role: str = "validate") -> tuple[float, float]:
        """Root mean square error before and after, over all samples of recordings with this role.

        Outputs are counted together, so that it says something for one output or several of one unit.
        """
        own = [one for one in self.scores if one.role == role]
        count = sum(one.samples for one in own)
        if not count:
            return float("nan"), float("nan")
        return (
            float(np.sqrt(sum(one.samples * one.rmse_before**2 for one in own) / count)),
            float(np.sqrt(sum(one.samples * one.rmse_after**2 for one in own) / count)),
        )

    @property
    def judged_on(self) -> str:
        """``"validate"``; ``"estimate"`` if no recording was held out."""
        return "validate" if any(one.role == "validate" for one in self.scores) else "estimate"

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return files.sentence(self)

    def to_dict(self) -> dict[str, Any]:
        """As ``diagnosis.json`` has it."""
        return files.to_dict(self)

    def write(self, out: str | Path) -> Path:
        """Write ``report.html`` and ``diagnosis.json`` into a folder, which is given back.

        It appears whole or not at all; an earlier diagnosis of a plant there is replaced.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `out` holds anything but such a diagnosis, ``"not-writable"``.
        """
        return files.write(self, out)

    def _repr_html_(self) -> str:
        return present.summary(self)

    def __repr__(self) -> str:
        causes = [cause.hypothesis.label for cause in self.causes]
        return f"PlantDiagnosis({self.plant.name!r}, {self.verdict!r}, {causes})"

    def __str__(self) -> str:
        return files.text(self)


def diagnose_plant(
    plant: Plant,
    recordings: Sequence[Recording],
    *,
    candidates: Sequence[Recording] = (),
    progress: Callable[[str], None] | None = None,
) -> PlantDiagnosis:
    """Fit a plant, find where it and the recordings part, and what would mend that.

    It is the diagnosis of `forklift.diagnose`, of another machine: fitted on the ``estimate`` recordings,
    judged on the others. An unknown input at every port, input and sensor in turn tells where; the plant's
    effects and their dull rivals (a sensor's gain, offset and lag, an input's gain and offset, a parameter
    that is known within a range only) are screened, tried and selected.

    Parameters
    ----------
    plant, recordings
        What was measured, and what ought to explain it.
    candidates
        Recordings that could be made, with inputs only: the one is named that would part the rivals best.
    progress
        Told what is being done.

    Raises
    ------
    ForkliftError
        ``"estimate-missing"``, ``"channel-unknown"``, ``"not-finite"``, ``"no-steady-state"``.
    """
    clock = Clock(progress)
    recordings = [completed(plant, one) for one in recordings]
    known = sensors(plant, recordings)
    machine = NumpyMachine(plant)
    everyone = pose(machine, _blocked(recordings), machine.unknowns(), known)
    fitted = [one for one in everyone.samples if one.recording.role == "estimate"]
    if not fitted:
        raise ForkliftError("estimate-missing", f"no recording of {plant.name} may be fitted on")
    refitter = Refitter(everyone.over(fitted), everyone, known, strict=True, later=LATER)
    everybody = hypotheses(plant, recordings)
    found = investigate(refitter, everybody, machine, clock)
    selection = found.selection
    with clock.stage("leaving groups out"):
        groups = group_folds(refitter, selection.baseline, selection.final)
    with clock.stage("asking what could stand for it"):
        alike = confounded(selection.final, everybody)
    with clock.stage("choosing the next recording"):
        proposal = _proposal(plant, selection, alike, candidates, refitter)
    with clock.stage("foreseeing every recording"):
        before, after = (
            foreseen(plant, recordings, refitter, refit) for refit in (selection.baseline, selection.final)
        )
    return PlantDiagnosis(
        plant,
        verdict(selection, found.causes),
        found.causes,
        found.inputs,
        found.shapes,
        selection,
        found.screening,
        tuple(scores(plant, before, after)),
        groups,
        alike,
        numbers(selection.final),
        numbers(selection.baseline),
        proposal,
        before,
        after,
        known,
        clock.seconds,
    )


def _blocked(recordings: Sequence[Recording]) -> list[Recording]:
    """Few held-out recordings count as several stretches each."""
    held = [one for one in recordings if one.role == "validate"] or list(recordings)
    each = max(1, round(BLOCKS / max(len(held), 1)))
    return [replace(one, blocks=each) if one in held else one for one in recordings]


def widening(refit: Refit) -> float:
    """Of intervals: by how much more is left over on recordings held out than on those fitted."""
    fitted = [one for one in refit.judged if one.role == "estimate"]
    inside = sum(one.samples * one.mean_square for one in fitted) / sum(one.samples for one in fitted)
    return float(np.sqrt(max(1.0, refit.reduced_chi2 / inside))) if inside > 0.0 else 1.0


def numbers(refit: Refit) -> tuple[Number, ...]:
    """Every parameter of a refit with its interval."""
    wide = widening(refit)
    rows = []
    for place, one in enumerate(refit.knowledge.estimates):
        theta = float(refit.found.x[place])
        reach = QUANTILE * wide * one.deviation
        ends = [
            float(
                one.unknown.values(
                    float(np.clip(theta + sign * reach, one.unknown.lower, one.unknown.upper))
                )[0]
            )
            for sign in (-1.0, 1.0)
        ]
        rows.append(Number(one.name, one.unknown.unit, one.value, min(ends), max(ends)))
    return tuple(rows)


def _proposal(
    plant: Plant,
    selection: Selection,
    alike: Sequence[Confounded],
    candidates: Sequence[Recording],
    refitter: Refitter,
) -> Proposal | None:
    """Of the candidates the one that best parts the final model from its rivals.

    These are what came nearest to it, and itself with a cause exchanged for what could stand for it.
    """
    final = selection.final
    if not candidates or not final.hypotheses:
        return None
    last = [step for step in selection.steps if step.accepted][-1:]
    near = [
        one for step in last for one in step.refits if one.finished and one.hypotheses != final.hypotheses
    ]
    first = {confounded.accepted: confounded for confounded in reversed(alike)}.values()
    exchanged = [_exchanged(refitter, final, confounded) for confounded in first]
    rivals = [final, *near[:NEAREST], *exchanged]
    if len(rivals) < 2:
        return None
    shown = [
        replace(completed(plant, one), y={out.name: np.zeros(len(one)) for out in plant.outputs})
        for one in candidates
    ]
    machine = NumpyMachine(plant)
    problem = pose(machine, shown, machine.unknowns(), refitter.sensors)
    pieces = [Candidate(one.recording.file, one) for one in problem.samples]
    return part(rivals, pieces)


def _exchanged(refitter: Refitter, final: Refit, confounded: Confounded) -> Refit:
    """The final model with a confounded hypothesis in a cause's place."""
    others = tuple(confounded.other if one is confounded.accepted else one for one in final.hypotheses)
    return refitter.finish(refitter.rough(others, final))
