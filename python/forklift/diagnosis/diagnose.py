"""Where simulation and recordings part, what is missing, and what the model gains by it: one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base import arguments, present
from forklift.base.errors import ForkliftError
from forklift.diagnosis import files as diagnosis_files
from forklift.diagnosis.causes import Cause
from forklift.diagnosis.deficiency import Deficiency, deficiency
from forklift.diagnosis.dependence import Shape
from forklift.diagnosis.engine import VERDICTS as VERDICTS
from forklift.diagnosis.engine import Clock, investigate, loudest, verdict
from forklift.diagnosis.engine import Verdict as Verdict
from forklift.diagnosis.hypothesis import with_hypotheses
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.misfit import Share, shares
from forklift.diagnosis.proposals import CONDITIONS, propose
from forklift.diagnosis.refit import Refit, Refitter
from forklift.diagnosis.regimes import Regimes, regimes
from forklift.diagnosis.screening import Screening
from forklift.diagnosis.selection import Selection
from forklift.fitting.compare import Comparison, check_temperature, compare_fitted
from forklift.fitting.posing import pose
from forklift.fitting.predict import Predicted, predict_all
from forklift.fitting.sample import Sample
from forklift.plant.forklift import ports as unknown_ports
from forklift.plant.forklift import variables as operation
from forklift.plant.forklift.candidates import NextRecording
from forklift.plant.forklift.checks.invalid_signals import InvalidStretch, without_invalid
from forklift.plant.forklift.checks.suitability import Caution, suitability
from forklift.plant.forklift.covariates import covariates
from forklift.plant.forklift.hypotheses import clocks_apart, hypotheses, invalid_hypothesis
from forklift.plant.forklift.model import LOAD_ACCURACY, Forklift, truck_of
from forklift.plant.forklift.phases import PHASES, of_recording
from forklift.plant.forklift.sensors import sensors
from forklift.plant.forklift.splits import splits
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.unknowns import unknowns
from forklift.plant.protocol import Hypothesis
from forklift.recordings.campaign import Campaign
from forklift.recordings.channels import LIFTS, Lift, commanded
from forklift.recordings.noise import Sensor


@dataclass(frozen=True)
class Location:
    """Where the mismatch lies."""

    lift: str
    equation: str
    signal: str
    region: str
    share: float
    """Of the misfit above the noise, that an unknown input there explains."""


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """What `diagnose` gives; `write` puts all of it into a folder."""

    campaign: Campaign
    start: Truck
    truck: Truck
    """The final truck, with what was found missing."""
    verdict: Verdict
    location: Location | None
    causes: tuple[Cause, ...]
    doubted: tuple[Cause, ...]
    """Explanations of which none is more likely than all others together: several fit as well."""
    inputs: tuple[UnknownInput, ...]
    """An unknown input at every place, the most credible first."""
    shapes: tuple[Shape, ...]
    """The most credible one as a function of what an operator knows, the best first."""
    selection: Selection
    unidentifiable: tuple[Hypothesis, ...]
    """Hypotheses that were not asked, for want of a second oil temperature."""
    screening: Screening
    """All hypotheses at the fitted truck."""
    cautions: tuple[Caution, ...]
    spoilt: tuple[InvalidStretch, ...]
    """Signals that stood still or slipped; these samples were left out."""
    unexcited: str
    """Why the recordings tell nothing of any lift; empty if they do."""
    deficiency: tuple[Deficiency, Deficiency]
    """Every test of what the fitted truck leaves over, and of what the final model does."""
    misfit: tuple[Share, ...]
    """What the fitted truck leaves over, by recording, signal, phase of motion and band of frequency."""
    regimes: tuple[Regimes, ...]
    """Each cause's amplitude from two disjoint regimes."""
    next_recording: NextRecording | None
    next_why: str
    """Why that recording, or why none."""
    before: Comparison
    after: Comparison
    seconds: Mapping[str, float]
    """By stage."""

    @property
    def baseline(self) -> Refit:
        return self.selection.baseline

    @property
    def final(self) -> Refit:
        return self.selection.final

    @property
    def untestable(self) -> tuple[Hypothesis, ...]:
        """Hypotheses of which these recordings can tell nothing."""
        if self.unexcited:
            return (
                *self.unidentifiable,
                *self.screening.untestable,
                *(one.hypotheses[0] for one in self.screening.singles),
            )
        return (*self.unidentifiable, *self.screening.unidentifiable)

    @property
    def gap_closed(self) -> float:
        """(MS_before − MS_after)/(MS_before − 1), MS the mean square left over on held-out recordings."""
        before, after = self.baseline.reduced_chi2, self.final.reduced_chi2
        return (before - after) / (before - 1.0) if before > 1.0 else float("nan")

    @cached_property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return diagnosis_files.sentence(self)

    def write(self, out: str | Path) -> Path:
        """Write ``report.html``, ``diagnosis.json``, ``truck.toml`` and predictions of both models.

        The folder appears whole or not at all; an earlier diagnosis there is replaced.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `out` holds anything but an earlier diagnosis, ``"not-writable"``.
        """
        return diagnosis_files.write(self, out)

    def to_dict(self) -> dict[str, Any]:
        """As ``diagnosis.json`` has it."""
        return diagnosis_files.to_dict(self)

    def _repr_html_(self) -> str:
        return present.summary(self)

    def __repr__(self) -> str:
        causes = [cause.hypothesis.label for cause in self.causes]
        return f"Diagnosis({self.campaign.name!r}, {self.verdict!r}, {causes})"

    def __str__(self) -> str:
        return diagnosis_files.text(self)


def diagnose(
    campaign: Campaign,
    truck: Truck,
    *,
    oil_temperature_degc: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Fit the truck, find where it and the recordings part, and what would mend that.

    The truck is fitted to the ``estimate`` recordings. If it explains the others to the sensors' noise,
    nothing is amiss. Else an unknown input at every equation in turn tells where it is; every hypothesis (the
    effects of the catalogue, sensors, entered conditions) is screened at the optimum; and the most promising
    are fitted from the start, jointly with the truck. What recordings held out say decides.

    Parameters
    ----------
    campaign, truck
        What was measured, and where the fit starts: another truck of the same make will do.
    oil_temperature_degc
        For recordings without an oil temperature [°C].
    progress
        Told what is being done.

    Raises
    ------
    ForkliftError
        Those of `forklift.plant.forklift.checks.suitability` if the campaign cannot support a fit;
        ``"argument-invalid"``; those of `forklift.plant.forklift.simulate.predict`.
    """
    arguments.of_kind(Campaign, campaign=campaign)
    arguments.of_kind(Truck, truck=truck)
    check_temperature(oil_temperature_degc)
    clock = Clock(progress)
    campaign, spoilt = without_invalid(campaign, truck)
    lifts, cautions, unexcited = _suited(campaign, truck)
    every = sensors(campaign.recordings)
    machine = Forklift(truck, lifts, oil_temperature_degc, load_accuracy=LOAD_ACCURACY)
    everyone = pose(machine, campaign.recordings, unknowns(truck, lifts, hold=_held(cautions)), every)
    fitted = [found for found in everyone.samples if found.recording.role == "estimate"]
    refitter = Refitter(everyone.over(fitted), everyone, every)
    apart = clocks_apart(campaign.recordings, list(every))
    everybody = hypotheses(truck, lifts, list(every), _travelled(everyone.samples), apart)
    alike = {CONDITIONS[one.code] for one in cautions if one.code in CONDITIONS}
    asked = tuple(one for one in everybody if not alike & set(one.needs_two_of))
    unidentifiable = tuple({one.label: one for one in everybody if one not in asked}.values())
    found = investigate(refitter, asked, machine, clock, hopeless=bool(unexcited))
    selection, inputs, seen = found.selection, found.inputs, found.shapes
    baseline, final = selection.baseline, selection.final
    tested, left, agreement = _evidence(campaign, truck, selection, every, clock)
    named = (*found.causes, *(Cause(invalid_hypothesis(one), 1.0, "complete", (), ()) for one in spoilt))
    said = verdict(selection, named, hopeless=bool(unexcited))
    with clock.stage("choosing the next recording"):
        proposed, why = propose(campaign, selection, named, cautions, every)
    best = _truck(campaign, truck, final)
    fitted_truck = _truck(campaign, truck, baseline)
    with clock.stage("simulating before and after"):
        before, after = (
            compare_fitted(campaign, shown, _predicted(refitter, refit), oil_temperature_degc)
            for shown, refit in ((fitted_truck, baseline), (best, final))
        )
    return Diagnosis(
        campaign,
        truck,
        best,
        said,
        None if said == "no-mismatch" else _location(baseline, named, inputs, seen),
        named,
        found.doubted,
        inputs,
        seen,
        selection,
        unidentifiable,
        found.screening,
        cautions,
        spoilt,
        unexcited,
        tested,
        left,
        agreement,
        proposed,
        why,
        before,
        after,
        clock.seconds,
    )


def _suited(campaign: Campaign, truck: Truck) -> tuple[tuple[Lift, ...], tuple[Caution, ...], str]:
    """The lifts that are fitted, what to know about it, and why nothing is told of them, if so."""
    try:
        suited = suitability(campaign.recordings, truck)
    except ForkliftError as error:
        if error.code != "no-excitation":
            raise
        lifts = {lift for recording in campaign.recordings for lift in commanded(recording.lift)}
        return tuple(lift for lift in LIFTS if lift in lifts), (), error.message
    return suited.lifts, suited.cautions, ""


def _held(cautions: Sequence[Caution]) -> list[str]:
    """What no recording tells. Left to its prior it would go to its bound, if that let recordings explain
    anything by what is their own: a viscosity that falls twenty times too fast turns a sensor's error of a
    tenth of a kelvin into any oil temperature."""
    return [str(one.facts["parameter"]) for one in cautions if "parameter" in one.facts]


def _evidence(
    campaign: Campaign, truck: Truck, selection: Selection, every: Mapping[str, Sensor], clock: Clock
) -> tuple[tuple[Deficiency, Deficiency], tuple[Share, ...], tuple[Regimes, ...]]:
    """What is left over before and after, tested and shared out, and whether the causes hold everywhere."""
    recordings, (baseline, final) = campaign.recordings, (selection.baseline, selection.final)
    encoders = {channel for channel, sensor in every.items() if sensor.count}
    with clock.stage("testing what is left over"):
        tested = tuple(
            deficiency(refit.judged, covariates(recordings, refit.judged, every), encoders)
            for refit in (baseline, final)
        )
        left = shares(
            baseline.judged,
            {(one.file, name): one.rate_hz(name) for one in recordings for name in one.channels},
            {one.file: of_recording(one, truck) for one in recordings},
            PHASES,
        )
    with clock.stage("comparing regimes"):
        parts = splits([one.recording for one in final.found.problem.samples], truck)
        amplitudes = [one.amplitude for one in final.hypotheses if one.amplitude and one.kind != "unknown"]
        agreement = tuple(found for name in amplitudes for found in regimes(final, name, parts))
    return (tested[0], tested[1]), left, agreement


def _travelled(samples: Sequence[Sample]) -> dict[Lift, tuple[float, float]]:
    """From where to where each lift's cylinder went, by its encoder [m]."""
    ends: dict[Lift, tuple[float, float]] = {}
    for lift in LIFTS:
        moved = [
            seen.values * operation.per_output("position", lift)
            for one in samples
            for seen in one.observed
            if seen.sensor.channel == f"position_{lift}_m"
        ]
        if moved:
            ends[lift] = min(float(way.min()) for way in moved), max(float(way.max()) for way in moved)
    return ends


def _location(
    baseline: Refit, found: Sequence[Cause], inputs: Sequence[UnknownInput], seen: Sequence[Shape]
) -> Location:
    """By the first cause where one was found, else by the most credible unknown input."""
    first = found[0].hypothesis if found else None
    if first and not inputs:  # told before any fit
        lift = unknown_ports.lift_of(first.where)
        return Location(lift or "both", first.equation, first.where, first.name, 1.0)
    signal = loudest(baseline)
    place = first.where if first else inputs[0].port
    equation = first.equation if first else unknown_ports.equation(place)
    lift = place if place in LIFTS else unknown_ports.lift_of(place)
    square = float(np.mean([one.mean_square for one in baseline.judged if one.role == "estimate"]))
    share = 1.0 - (inputs[0].noise ** 2 - 1.0) / (square - 1.0) if square > 1.0 else 0.0
    acts_on = unknown_ports.lift_of(inputs[0].port) or "main"
    region = diagnosis_files.region(seen, acts_on)
    return Location(lift or "both", equation, signal, region, float(np.clip(share, 0.0, 1.0)))


def _predicted(refitter: Refitter, refit: Refit) -> tuple[Predicted, ...]:
    """What a refit says of every recording, those held out too."""
    found = refit.found.problem
    problem = with_hypotheses(refitter.everyone, refit.hypotheses).weighted(found.sigma, found.substeps)
    return predict_all(problem, refit.found.x[: len(found.unknowns)])


def _truck(campaign: Campaign, start: Truck, refit: Refit) -> Truck:
    """The truck of a refit; what moved says where it comes from."""
    source = f"estimated by diagnosis of campaign {campaign.name!r} (sha256 {campaign.sha256[:12]})"
    truck = truck_of(refit.found.problem, refit.found.x, source)
    return Truck(f"{campaign.name} diagnosed from {start.name}", truck.values, truck.sources)
