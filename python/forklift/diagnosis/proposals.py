"""Which recording would help most after a diagnosis: one that parts its rivals, or one that tells
what these could not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from forklift.diagnosis.causes import Cause
from forklift.diagnosis.confounding import Confounded
from forklift.diagnosis.engine import verdict
from forklift.diagnosis.next_recording import Candidate, Proposal, part, tell
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.selected import Selection
from forklift.diagnosis.sentences import look_at, shown_alone
from forklift.fitting.sample import observing
from forklift.plant.findings import Findings
from forklift.plant.subject import Subject, Wanted
from forklift.recordings.noise import Sensor

KNOWN = 0.1
"""Relative standard deviation up to which an amplitude is known well enough."""
MOST_RIVALS = 3
NEAREST = 2
"""How many of the refits that came nearest a recording is asked to part from what was found."""


class Proposed(NamedTuple):
    """What to record next, and why; or why nothing."""

    recording: Wanted | None
    why: str
    proposal: Proposal | None = None


def propose(
    model: Subject,
    recordings: Sequence[Any],
    selection: Selection,
    found: Sequence[Cause],
    stands: Sequence[Confounded],
    findings: Findings,
    refitter: Refitter,
) -> Proposed:
    """What to record next, if anything would help."""
    rivals = _rivals(selection, found)
    final = selection.final
    if not model.reaches_noise and final.hypotheses:
        offered = possible(model, recordings, _values([final]), refitter.sensors)
        if offered:
            rivals = [final, *_nearest(refitter, selection), *_exchanged(refitter, final, stands)]
    if len(rivals) > 1:
        return _answer(model, rivals, possible(model, recordings, _values(rivals), refitter.sensors))
    doubted = {name for cause in found for name in cause.hypothesis.doubts}
    for condition, of in findings.same:
        if any(condition.startswith(name) for name in doubted):
            continue  # all alike as they were entered, which is what is doubted
        once_more = model.once_more(recordings, condition, of)
        if once_more:
            return Proposed(once_more, once_more.why)
    vague = _vague(selection.final)
    if vague:
        could_be = possible(model, recordings, _values([selection.final]), refitter.sensors)
        if could_be:
            return _told(model, tell(selection.final, vague, could_be))
    if verdict(selection, found, hopeless=bool(findings.unexcited)) == "no-mismatch":
        return Proposed(None, "nothing is left over that a further recording would explain")
    kinds = {cause.hypothesis.kind for cause in found}
    explained = bool(found) and selection.final.complete
    if explained and kinds <= {"sensor", "parameter"}:
        return Proposed(
            None,
            "before anything more is recorded, check what was found: "
            + "; ".join(dict.fromkeys(_at(model, cause) for cause in found)),
        )
    files = shown_alone(selection.final)
    if files and not found:
        return Proposed(None, look_at(files, model.words.noun))
    nameless = "unknown" in kinds
    if not explained or nameless:
        return Proposed(
            None,
            "what was found has no name, so that nothing is known that a further recording could tell it from"
            if nameless
            else "no hypothesis that was tried explains what is left over, so that there are none between "
            "which a further recording could decide",
        )
    return Proposed(
        None,
        "no other explanation is left that a further recording could rule out, and the size of what was "
        "found is known well",
    )


def _at(model: Subject, cause: Cause) -> str:
    return model.words.at(cause.hypothesis.name, cause.hypothesis.where)


def _answer(model: Subject, rivals: Sequence[Refit], could_be: Sequence[Candidate]) -> Proposed:
    if not could_be:
        return Proposed(
            None,
            "no recordings were named that could be made, so that none could be chosen that would part the "
            "explanations that are left",
        )
    return _told(model, part(rivals, could_be))


def _told(model: Subject, proposal: Proposal) -> Proposed:
    chosen = proposal.candidate
    wanted = None if chosen is None else model.wanted(chosen.sample.recording, proposal.why)
    return Proposed(wanted, proposal.why, proposal)


def possible(
    model: Subject,
    recordings: Sequence[Any],
    values: Sequence[Mapping[str, float]],
    sensors: Mapping[str, Sensor],
) -> list[Candidate]:
    """Recordings that could be made, each with all channels; what these read is of no account.

    Parameters
    ----------
    values
        Of each explanation: no command may take any of these machines to the end of its range.
    """
    found = []
    for one in model.possible(recordings, values, sensors):
        nothing = {channel: np.zeros(len(one.case.recording.time_s)) for channel in sensors}
        sample = observing(one.case, nothing, sensors, model.outputs, model.ends, {})
        found.append(Candidate(one.name, sample))
    return found


def _values(rivals: Sequence[Refit]) -> list[Mapping[str, float]]:
    return [refit.found.problem.values(refit.found.x) for refit in rivals]


def _rivals(selection: Selection, found: Sequence[Cause]) -> list[Refit]:
    """What these recordings cannot part: as good explanations, another law of the same, or what comes nearest
    to an uncertain one."""
    alike = {hypothesis for cause in found for hypothesis in cause.not_separable_from}
    refits = [refit for step in selection.steps for refit in step.refits]
    best = [
        refit
        for refit in refits
        if refit.complete and refit is not selection.final and set(refit.hypotheses) & alike
    ]
    if not best and selection.curve:  # the same with the catalogue's law alone, or with the curve
        curve = set(selection.curve.hypotheses)
        best = [
            refit
            for refit in (*refits, *selection.unnamed)
            if refit.finished and set(refit.hypotheses) ^ set(selection.final.hypotheses) == curve
        ]
    if not best and found and not selection.final.complete:
        others = [refit for refit in (*refits, *selection.unnamed) if refit.finished]
        others = [refit for refit in others if refit is not selection.final]
        best = sorted(others, key=lambda refit: refit.excess)[:1]
    return [selection.final, *best][:MOST_RIVALS]


def _nearest(refitter: Refitter, selection: Selection) -> list[Refit]:
    """What came nearest to the final model when its last cause was accepted; fitted to the end, if only one
    that was stopped on the way is left."""
    last = [step for step in selection.steps if step.accepted][-1:]
    others = [
        refit for step in last for refit in step.refits if refit.hypotheses != selection.final.hypotheses
    ]
    ended = [refit for refit in others if refit.finished][:NEAREST]
    if ended or not others:
        return ended
    return [refitter.finish(min(others, key=lambda refit: refit.rough))]


def _exchanged(refitter: Refitter, final: Refit, stands: Sequence[Confounded]) -> list[Refit]:
    """The final model with what could stand for a cause best in the cause's place."""
    first = {one.accepted: one for one in reversed(stands)}.values()
    return [
        refitter.finish(
            refitter.rough(
                tuple(one.other if one.accepted is own else own for own in final.hypotheses), final
            )
        )
        for one in first
    ]


def _vague(refit: Refit) -> str:
    """The accepted amplitude that is known worst, if that is not well."""
    known = dict(
        zip((one.name for one in refit.found.problem.unknowns), refit.found.x.tolist(), strict=False)
    )
    worst, at = "", KNOWN
    for estimate in refit.knowledge.estimates:
        for hypothesis in refit.hypotheses:
            if (
                hypothesis.kind != "unknown"
                and estimate.name == hypothesis.amplitude
                and known[estimate.name]
            ):
                share = abs(estimate.deviation / known[estimate.name])
                worst, at = (estimate.name, share) if share > at else (worst, at)
    return worst
