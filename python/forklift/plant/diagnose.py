"""Where a plant and its recordings part, what is missing, and what the model gains by it: one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.diagnosis.causes import Cause
from forklift.diagnosis.engine import Clock, Site, Verdict, investigate, verdict
from forklift.diagnosis.groups import LeftOut, lawless, left_out
from forklift.diagnosis.inputs import UnknownInput
from forklift.diagnosis.next_recording import Candidate, Proposal, part
from forklift.diagnosis.region import Shape
from forklift.diagnosis.screening import Screening
from forklift.diagnosis.selection import Selection
from forklift.diagnosis.suspect import Suspect
from forklift.diagnosis.trial import MOVES, NEAR, Bench, Trial
from forklift.diagnosis.twins import Twin, twins
from forklift.errors import ForkliftError
from forklift.estimation.algebra import one_thread
from forklift.estimation.judgement import settled
from forklift.estimation.knowledge import QUANTILE
from forklift.plant.parts import Plant
from forklift.plant.problem import completed, pose, sensors
from forklift.plant.recording import Recording
from forklift.plant.shapes import FreeShapes, over_variables, respond, width_s
from forklift.plant.suspects import suspects

Floats = NDArray[np.float64]

BLOCKS = 8
"""Stretches of the held-out recordings, in all, by whose resampling credibility is told: whole recordings
where there are as many."""
LATER = 0.2
"""Share of what is left over that an explanation beside another must remove: on a machine whose model never
reaches the sensors' noise, several effects are the rule, and a second one seldom halves what is left."""

LIKELY = 0.5
"""Credibility from which on a cause is told without a doubt in its sentence."""
NEAREST = 2
"""How many of the trials that came nearest a recording is asked to part from what was found."""


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
    groups: tuple[LeftOut, ...]
    twins: tuple[Twin, ...]
    """What could stand for a cause on these recordings, to first order."""
    numbers: tuple[Number, ...]
    next_recording: Proposal | None
    """What would part the rivals, of the candidates that were given."""
    seconds: Mapping[str, float]

    @property
    def baseline(self) -> Trial:
        return self.selection.baseline

    @property
    def final(self) -> Trial:
        return self.selection.final

    @property
    def lawless(self) -> tuple[str, ...]:
        """Groups that fit no law that fits the others."""
        return lawless(self.groups)

    @property
    def untestable(self) -> tuple[Suspect, ...]:
        """Suspects of which these recordings can tell nothing."""
        return self.screening.untold

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
    def sentence(self) -> str:
        """The verdict in one sentence."""
        if self.verdict == "no-mismatch":
            return f"No mismatch: {self.plant.name} explains its recordings to the sensors' noise."
        before, after = self.rmse()
        if not self.causes:
            return (
                f"Something unknown acts on {self.plant.name}, most likely at {self.inputs[0].port}: nothing "
                f"of the catalogue explains it (held-out error {before:.3g})."
            )
        said = "; ".join(
            f"{'' if cause.credibility >= LIKELY else 'perhaps '}{cause.suspect.name} ({cause.suspect.label})"
            for cause in self.causes
        )
        form = " It is not all: something is still left over." if not self.final.complete else ""
        return (
            f"{self.plant.name}: {said}. The root mean square error on what was held out falls from "
            f"{before:.3g} to {after:.3g}.{form}"
        )

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "plant": self.plant.name,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "causes": [
                {
                    "id": cause.suspect.id,
                    "label": cause.suspect.label,
                    "name": cause.suspect.name,
                    "kind": cause.suspect.kind,
                    "credibility": cause.credibility,
                    "form": cause.form,
                    "not_separable_from": [one.label for one in cause.not_separable_from],
                    "rivals": [
                        {
                            "suspects": [one.label for one in rival],
                            "credibility": share,
                            "mean_square": square,
                        }
                        for rival, share, square in cause.rivals
                    ],
                }
                for cause in self.causes
            ],
            "located": [
                {"port": one.port, "evidence": one.evidence, "noise": one.noise} for one in self.inputs
            ],
            "shapes": [
                {"variable": one.variable, "explained": one.explained, "region": list(one.region)}
                for one in self.shapes
            ],
            "scores": [vars(one) for one in self.scores],
            "twins": [
                {"cause": one.accepted.label, "other": one.other.label, "share": one.share}
                for one in self.twins
            ],
            "lawless": list(self.lawless),
            "groups": [one.to_dict() for one in self.groups],
            "parameters": [vars(one) for one in self.numbers],
            "untestable": [one.label for one in self.untestable],
            "next_recording": None if self.next_recording is None else self.next_recording.why,
            "mean_square": {"before": self.baseline.left_over, "after": self.final.left_over},
            "runtime_s": dict(self.seconds),
        }

    def __repr__(self) -> str:
        return (
            f"PlantDiagnosis({self.plant.name!r}, {self.verdict!r}, {[c.suspect.label for c in self.causes]})"
        )

    def __str__(self) -> str:
        return "\n".join([self.sentence, *_lines(self)])


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
        ``"estimate-missing"``, ``"channel-unknown"``, ``"not-finite"``.
    """
    clock = Clock(progress)
    recordings = [completed(plant, one) for one in recordings]
    known = sensors(plant, recordings)
    everyone = pose(plant, _blocked(recordings), known)
    fitted = [one for one in everyone.samples if one.recording.role == "estimate"]
    if not fitted:
        raise ForkliftError("estimate-missing", f"no recording of {plant.name} may be fitted on")
    bench = Bench(everyone.over(fitted), everyone, known, strict=True, later=LATER)
    places = [*(port.name for port in plant.ports), *(one.name for one in plant.inputs), *known]
    site = Site(
        places,
        respond,
        over_variables,
        lambda already: FreeShapes(places, already),
        "plant",
        width_s(everyone),
    )
    everybody = suspects(plant, recordings)
    found = investigate(bench, everybody, site, clock)
    selection = found.selection
    with clock.stage("leaving groups out"):
        groups = left_out(bench, selection.baseline, selection.final)
    with clock.stage("asking what could stand for it"):
        alike = twins(selection.final, everybody)
    with clock.stage("choosing the next recording"):
        proposal = _proposal(plant, selection, alike, candidates, bench)
    return PlantDiagnosis(
        plant,
        verdict(selection, found.causes),
        found.causes,
        found.inputs,
        found.shapes,
        selection,
        found.screening,
        _scores(bench, selection),
        groups,
        alike,
        _numbers(selection.final),
        proposal,
        clock.seconds,
    )


def _blocked(recordings: Sequence[Recording]) -> list[Recording]:
    """Few held-out recordings count as several stretches each."""
    held = [one for one in recordings if one.role == "validate"] or list(recordings)
    each = max(1, round(BLOCKS / max(len(held), 1)))
    return [replace(one, blocks=each) if one in held else one for one in recordings]


def _scores(bench: Bench, selection: Selection) -> tuple[Score, ...]:
    """Every output of every recording, as both models foresee it with what is fitted on ``estimate``."""
    errors = [_errors(bench, trial) for trial in (selection.baseline, selection.final)]
    return tuple(
        Score(*key, len(before), float(np.sqrt(np.mean(before**2))), float(np.sqrt(np.mean(after**2))))
        for (key, before), after in zip(errors[0].items(), errors[1].values(), strict=True)
    )


def _errors(bench: Bench, trial: Trial) -> dict[tuple[str, str, str], Floats]:
    """What was read less what ought to be; nothing is adjusted but what a recording has of its own."""
    problem = trial.found.problem.over(bench.everyone.samples)
    with one_thread():
        x = settled(problem, trial.found.x[: len(problem.unknowns)], far=NEAR, moves=MOVES)
        said = problem.values(x)
    return {
        (sample.recording.file, sample.recording.role, seen.sensor.channel): seen.values
        - seen.reading(model[seen.sensor.channel])
        for sample, model in zip(problem.samples, said, strict=True)
        for seen in sample.observed
    }


def _numbers(trial: Trial) -> tuple[Number, ...]:
    """Intervals widened by how much more is left over on recordings held out than on those fitted."""
    fitted = [one for one in trial.judged if one.role == "estimate"]
    inside = sum(one.samples * one.mean_square for one in fitted) / sum(one.samples for one in fitted)
    wide = np.sqrt(max(1.0, trial.left_over / inside)) if inside > 0.0 else 1.0
    rows = []
    for place, one in enumerate(trial.knowledge.estimates):
        theta = float(trial.found.x[place])
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
    alike: Sequence[Twin],
    candidates: Sequence[Recording],
    bench: Bench,
) -> Proposal | None:
    """Of the candidates the one that best parts the final model from its rivals.

    These are what came nearest to it, and itself with a cause exchanged for what could stand for it.
    """
    final = selection.final
    if not candidates or not final.suspects:
        return None
    last = [step for step in selection.steps if step.accepted][-1:]
    near = [one for step in last for one in step.trials if one.finished and one.suspects != final.suspects]
    first = {twin.accepted: twin for twin in reversed(alike)}.values()
    exchanged = [_exchanged(bench, final, twin) for twin in first]
    rivals = [final, *near[:NEAREST], *exchanged]
    if len(rivals) < 2:
        return None
    shown = [
        replace(completed(plant, one), y={out.name: np.zeros(len(one)) for out in plant.outputs})
        for one in candidates
    ]
    problem = pose(plant, shown, bench.sensors)
    pieces = [Candidate(one.recording.file, one) for one in problem.samples]
    return part(rivals, pieces)


def _exchanged(bench: Bench, final: Trial, twin: Twin) -> Trial:
    """The final model with a twin in a cause's place."""
    others = tuple(twin.other if one is twin.accepted else one for one in final.suspects)
    return bench.finish(bench.rough(others, final))


def _lines(found: PlantDiagnosis) -> list[str]:
    lines = []
    if found.inputs:
        named = ", ".join(f"{one.port} ({one.evidence:.0f})" for one in found.inputs[:4])
        lines.append(f"Where (ln evidence of an unknown input): {named}.")
    if found.shapes:
        best = found.shapes[0]
        lines.append(
            f"  It is best told by {best.variable} ({100.0 * best.explained:.0f} % of it in recordings "
            "left out)."
        )
    for cause in found.causes:
        lines.append(
            f"Cause: {cause.suspect.label} — {cause.suspect.name}; credibility {cause.credibility:.2f}, "
            f"form {cause.form}."
        )
        if cause.not_separable_from:
            lines.append(f"  Not separable from {', '.join(one.label for one in cause.not_separable_from)}.")
        stand = [one for one in found.twins if one.accepted is cause.suspect]
        if stand:
            named = ", ".join(f"{one.other.label} ({100.0 * one.share:.0f} %)" for one in stand)
            lines.append(f"  These recordings cannot tell it from {named}.")
        for rival, share, square in cause.rivals[:6]:
            lines.append(
                f"  rival {' + '.join(one.label for one in rival) or 'none'}: credibility {share:.2f}, "
                f"mean square left {square:.3g}"
            )
    for one in found.numbers:
        lines.append(f"  {one.name} = {one.value:.4g} ({one.lower:.4g} to {one.upper:.4g}) {one.unit}")
    for score in found.scores:
        lines.append(
            f"  {score.file} {score.output} [{score.role}]: RMSE {score.rmse_before:.4g} -> "
            f"{score.rmse_after:.4g}"
        )
    for group in found.groups:
        verb = "holds" if group.holds else "does not hold"
        lines.append(
            f"  left out {group.group}: {verb}, mean square {group.before:.3g} -> {group.after:.3g} "
            f"{dict(group.amplitudes)}; fitted alone {group.alone:.3g}"
        )
    if found.lawless:
        lines.append(f"Fits no law that fits the others: {', '.join(found.lawless)}.")
    if found.next_recording:
        lines.append(f"Next recording: {found.next_recording.why}")
    return lines
