"""Where a machine and its recordings part, what is missing, and what the model gains by it: one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.threads import on_one_thread
from forklift.diagnosis import files, sentences
from forklift.diagnosis.causes import Cause
from forklift.diagnosis.confounding import confounded
from forklift.diagnosis.criteria import LATER, LATER_BEYOND_NOISE, MOVES, NEAR
from forklift.diagnosis.deficiency import Deficiency, deficiency
from forklift.diagnosis.dependence import Dependence
from forklift.diagnosis.engine import investigate, loudest, verdict
from forklift.diagnosis.group_validation import group_folds
from forklift.diagnosis.hypothesis import with_hypotheses
from forklift.diagnosis.in_use import InUse, in_use
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.misfit import Share, shares
from forklift.diagnosis.outcome import Location
from forklift.diagnosis.progress import Clock, Progress
from forklift.diagnosis.proposals import propose
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import Refitter
from forklift.diagnosis.regimes import Regimes, regimes
from forklift.diagnosis.result import Diagnosis
from forklift.diagnosis.selected import Selection
from forklift.diagnosis.unfinished import Unfinished
from forklift.fitting.agreement import Agreement, agreement
from forklift.fitting.clocks import clock_cautions
from forklift.fitting.criteria import FAR
from forklift.fitting.origin import given
from forklift.fitting.posing import pose
from forklift.fitting.predict import predict_all, settled_within
from forklift.fitting.problem import LeastSquares
from forklift.fitting.residuals import MOST_MOVES
from forklift.plant.hypotheses import invalid_hypothesis
from forklift.plant.subject import Subject
from forklift.recordings.noise import Sensor


@on_one_thread
def diagnose(
    machine: Any,
    recordings: Any,
    *,
    candidates: Sequence[Any] = (),
    out: str | Path | None = None,
    progress: Callable[[Progress], None] | None = None,
    **conditions: Any,
) -> Diagnosis:
    """Fit a machine, find where it and its recordings part, and what would mend that.

    The machine is fitted to the ``estimate`` recordings. If it explains the others to the sensors' noise,
    nothing is amiss. Else an unknown input at every equation in turn tells where it is; every hypothesis (the
    effects of the catalogue, sensors, inputs, entered conditions) is screened at the optimum; and the most
    promising are fitted from the start, jointly with the machine. What recordings held out say decides.

    Parameters
    ----------
    machine
        A `Truck` (another of the same make will do), its name or file; a `Plant` of your own; or anything
        with the protocol of `forklift.plant.subject.Subject`.
    recordings
        What was measured: a `Campaign` of a truck, or its folder; or recordings of the machine's own kind.
        The two may change places.
    candidates
        Of a plant: recordings that could be made, with inputs only. The one is named that would part the
        rivals best.
    out
        Folder that the diagnosis will be written to (`Diagnosis.write`). Until then what was computed is kept
        in its folder ``unfinished``: after Ctrl-C the same call goes on from there, and comes to the same.
    progress
        Told how far it is, a `forklift.diagnosis.progress.Progress`.
    conditions
        Of recordings that do not tell them: of a truck ``oil_temperature_degc`` [°C].

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``; ``"output-exists"``, ``"not-writable"`` of `out`; what the machine finds that
        its recordings cannot support: of a truck the errors of `forklift.plant.forklift.checks.suitability`
        and `forklift.plant.forklift.simulate`, of a plant ``"estimate-missing"``,
        ``"channel-unknown"``, ``"not-finite"``, ``"no-steady-state"``.
    """
    start, each, origin = given(machine, recordings, candidates=candidates, **conditions)
    unfinished = Unfinished.within(out and files.check(out), origin.facts, start, conditions)
    clock = Clock(progress, spared=lambda: unfinished.spared_s)
    model, kept, findings = start.examined(each)
    every = model.sensors(kept)
    asked_of_all = (*model.unknowns(findings.held), *model.clock_rates)
    everyone = pose(model, kept, asked_of_all, every)
    fitted = [one for one in everyone.samples if one.recording.role == "estimate"]
    refitter = Refitter(
        everyone.over(fitted),
        everyone,
        every,
        held=tuple(one for one in model.unknowns() if one.name in findings.held),
        unfinished=unfinished,
        strict=not model.reaches_noise,
        later=LATER if model.reaches_noise else LATER_BEYOND_NOISE,
    )
    everybody = model.hypotheses(kept, every)
    asked = tuple(one for one in everybody if not findings.alike(one.needs_two_of, one.where))
    withheld = tuple(one for one in everybody if one not in asked)
    found = investigate(refitter, asked, model, clock, withheld=withheld, hopeless=bool(findings.unexcited))
    unidentifiable = tuple({one.label: one for one in everybody if one not in found.asked}.values())
    selection = found.selection
    final = selection.final
    off = clock_cautions(model.words, final.found.problem, final.found.x, final.knowledge, final.widening)
    findings = replace(findings, cautions=(*findings.cautions, *off))
    tested, left, agree = _evidence(model, kept, selection, every, clock)
    seen = tuple(Cause(invalid_hypothesis(one), 1.0, "complete", (), ()) for one in findings.invalid)
    named = (*found.causes, *seen)
    with clock.stage("leaving groups out"):
        groups = group_folds(refitter, selection.baseline, selection.final)
    with clock.stage("asking what could stand for it"):
        stands = confounded(selection.final, found.asked, found.elsewhere, refitter.start)
    with clock.stage("choosing the next recording"):
        proposed = propose(model, kept, selection, named, stands, findings, refitter)
    with clock.stage("simulating before and after"):
        before = after = _agreement(model, kept, *_settled(refitter, selection.baseline))
        used: Mapping[str, InUse] = {}
        if selection.final is not selection.baseline:
            problem, x = _settled(refitter, selection.final)
            after = _agreement(model, kept, problem, x)
            used = _in_use(model, problem, x, named)
    said = verdict(selection, found.causes, seen, hopeless=bool(findings.unexcited))
    where = (
        None
        if said == "no-mismatch"
        else _location(
            model,
            selection,
            found.causes,
            () if said == "unknown-effect" else seen,
            found.inputs,
            found.dependences,
        )
    )
    return Diagnosis(
        machine=model,
        origin=origin,
        recordings=kept,
        findings=findings,
        verdict=said,
        location=where,
        causes=named,
        doubted=found.doubted,
        inputs=found.inputs,
        dependences=found.dependences,
        selection=selection,
        screening=found.screening,
        unidentifiable=unidentifiable,
        deficiency=tested,
        misfit=left,
        regimes=agree,
        groups=groups,
        confounded=stands,
        next_recording=proposed.recording,
        next_why=proposed.why,
        proposal=proposed.proposal,
        before=before,
        after=after,
        in_use=used,
        sensors=every,
        seconds=clock.seconds,
    )


def _evidence(
    model: Subject,
    recordings: Sequence[Any],
    selection: Selection,
    every: Mapping[str, Sensor],
    clock: Clock,
) -> tuple[tuple[Deficiency, Deficiency], tuple[Share, ...], tuple[Regimes, ...]]:
    """What is left over before and after, tested and shared out, and whether the causes hold everywhere."""
    baseline, final = selection.baseline, selection.final
    pieces = [piece for one in recordings for piece in model.pieces(one)]
    encoders = {channel for channel, sensor in every.items() if sensor.count}
    with clock.stage("testing what is left over"):
        tested = {
            refit: deficiency(refit.judged, model.covariates(pieces, refit.judged, every), encoders)
            for refit in dict.fromkeys((baseline, final))
        }
        left = shares(
            baseline.judged,
            {(one.file, name): model.rate_hz(one, name) for one in pieces for name in model.measured(one)},
            {one.file: model.labels(one) for one in pieces},
            model.phases,
        )
    with clock.stage("comparing regimes"):
        parts = model.splits([one.recording for one in final.found.problem.samples])
        amplitudes = [one.amplitude for one in final.hypotheses if one.amplitude and one.kind != "unknown"]
        agree = tuple(found for name in amplitudes for found in regimes(final, name, parts))
    return (tested[baseline], tested[final]), left, agree


def _location(
    model: Subject,
    selection: Selection,
    found: Sequence[Cause],
    invalid: Sequence[Cause],
    inputs: Sequence[UnknownInput],
    seen: Sequence[Dependence],
) -> Location:
    """By the first cause that was found, else by what was invalid before any fit, else by the most credible
    unknown input; by that too where the causes leave most over: it says where the rest acts."""
    baseline = selection.baseline
    first = found[0].hypothesis if found and selection.explains_most else None
    if invalid and not (found and inputs):
        one = invalid[0].hypothesis if not found else found[0].hypothesis
        return Location(model.part_where(one.where), one.equation, one.where, one.name, 1.0)
    places = {one.name: one for one in model.places}
    best = inputs[0].port
    at = first.where if first else best
    here = places.get(best)
    equation = first.equation if first else here.equation if here else "sensor"
    square = float(np.mean([one.mean_square for one in baseline.judged if one.role == "estimate"]))
    share = 1.0 - (inputs[0].noise ** 2 - 1.0) / (square - 1.0) if square > 1.0 else 0.0
    region = sentences.region(model.words, seen, model.part_of(best))
    return Location(
        model.part_where(at), equation, loudest(baseline), region, float(np.clip(share, 0.0, 1.0))
    )


def _agreement(model: Subject, recordings: Sequence[Any], problem: LeastSquares, x: Floats) -> Agreement:
    """What a refit says of every recording, those held out too."""
    predicted = predict_all(problem, x)
    adjusted = [[one.names[k] for k in one.free] for one in problem.samples]
    return agreement(model, recordings, predicted, adjusted)


def _in_use(model: Subject, problem: LeastSquares, x: Floats, causes: Sequence[Cause]) -> dict[str, InUse]:
    """What each cause does, with the curve that mends its law."""
    together = [[one.hypothesis, *one.curves] for one in causes]
    found = zip(causes, in_use(model, problem, x, together), strict=True)
    return {cause.hypothesis.label: used for cause, used in found if used}


def _settled(refitter: Refitter, refit: Refit) -> tuple[LeastSquares, Floats]:
    """Every recording with the hypotheses of a refit, and the unknowns with each one's own at their best."""
    found = refit.found.problem
    problem = with_hypotheses(refitter.everyone, refit.hypotheses).weighted(found.sigma, found.substeps)
    theta = refit.found.x[: len(found.unknowns)]
    far, moves = (NEAR, MOVES) if refitter.strict else (FAR, MOST_MOVES)
    return problem, settled_within(problem, theta, far=far, moves=moves)
