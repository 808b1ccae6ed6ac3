"""Which recording would help most after a diagnosis: one that parts its rivals, or one that tells
what these could not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from forklift.diagnosis.causes import Cause
from forklift.diagnosis.next_recording import part, tell
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.selection import Selection
from forklift.plant.forklift.candidates import NextRecording, candidates, elsewhere, next_recording
from forklift.plant.forklift.checks.suitability import Caution
from forklift.plant.forklift.model import truck_of
from forklift.recordings.campaign import Campaign
from forklift.recordings.noise import Sensor

KNOWN = 0.1
"""Relative standard deviation up to which an amplitude is known well enough."""
MOST_RIVALS = 3
CONDITIONS = {"one-temperature": "oil_temperature_degc", "one-load": "load_kg"}
"""By caution: which condition all recordings have in common."""


def propose(
    campaign: Campaign,
    selection: Selection,
    found: Sequence[Cause],
    cautions: Sequence[Caution],
    sensors: Mapping[str, Sensor],
) -> tuple[NextRecording | None, str]:
    """What to record next, if anything would help; and why, or why nothing would."""
    rivals = _rivals(selection, found)
    if len(rivals) > 1:
        trucks = [truck_of(one.found.problem, one.found.x) for one in rivals]
        proposal = part(rivals, candidates(campaign.recordings, trucks, sensors))
        return next_recording(proposal), proposal.why
    for caution in cautions:
        if caution.code in CONDITIONS:
            once_more = elsewhere(campaign.recordings, CONDITIONS[caution.code], caution.facts["lift"])
            if once_more:
                return once_more, once_more.why
    vague = _vague(selection.final)
    if vague:
        truck = truck_of(selection.final.found.problem, selection.final.found.x)
        possible = candidates(campaign.recordings, [truck], sensors)
        proposal = tell(selection.final, vague, possible)
        return next_recording(proposal), proposal.why
    if not found:
        return None, "nothing is left over that a further recording would explain"
    return (
        None,
        "no other explanation is left that a further recording could rule out, and the size of what was "
        "found is known well",
    )


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
