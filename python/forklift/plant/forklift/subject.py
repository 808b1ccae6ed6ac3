"""The forklift as a diagnosis asks it: its checks, hypotheses, signals and words."""

from __future__ import annotations

import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.derivative import WINDOW
from forklift.base.errors import ForkliftError
from forklift.plant.findings import Caution, Findings
from forklift.plant.forklift import phases
from forklift.plant.forklift.added import added
from forklift.plant.forklift.candidates import NextRecording, candidates, elsewhere, wanted
from forklift.plant.forklift.checks.faults import findings
from forklift.plant.forklift.checks.invalid_signals import without_invalid
from forklift.plant.forklift.checks.suitability import suitability
from forklift.plant.forklift.clocks import clocks, drifts
from forklift.plant.forklift.covariates import covariates
from forklift.plant.forklift.curve_tables import per_output
from forklift.plant.forklift.dither import dither
from forklift.plant.forklift.hypotheses import OIL, hypotheses
from forklift.plant.forklift.model import Forklift
from forklift.plant.forklift.phases import IN_WORDS
from forklift.plant.forklift.physical import physical
from forklift.plant.forklift.ports import lift_of
from forklift.plant.forklift.sensors import sensors
from forklift.plant.forklift.signals import PREDICTED, signals
from forklift.plant.forklift.simulate import first_temperature, mean_temperature, predict
from forklift.plant.forklift.speed_table import SpeedTable, speed_to_current
from forklift.plant.forklift.splits import splits
from forklift.plant.forklift.truck import Truck
from forklift.plant.forklift.unknowns import unknowns
from forklift.plant.forklift.vocabulary import ForkliftWords
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Case, Hypothesis
from forklift.plant.sensor_faults import SensorUnknown
from forklift.plant.subject import OUT, Drive, Labels, Possible, Residual, Signal, Sources, Split, Term, Use
from forklift.recordings.campaign import Campaign
from forklift.recordings.channels import LIFTS, Lift, commanded
from forklift.recordings.noise import Sensor
from forklift.recordings.recording import Recording

FILE = "truck.toml"
SAME_TEMPERATURE_K = 5.0
"""Recordings whose oil temperatures lie this closely above the coldest's count as one operating point."""
CONDITIONS = {"one-temperature": OIL, "one-load": "load_kg"}
"""By caution: which condition all recordings have in common."""


@dataclass(frozen=True)
class ForkliftSubject(Forklift):
    """See `forklift.plant.subject.Subject`.

    Attributes
    ----------
    doubts
        Whether the dither, which no recording shows, is an unknown.
    """

    doubts: bool = False
    words: ClassVar[ForkliftWords] = ForkliftWords()
    reaches_noise: ClassVar[bool] = True
    phases: ClassVar[Sequence[str]] = phases.PHASES
    phase_words: ClassVar[Mapping[str, str]] = IN_WORDS
    phase_note: ClassVar[str] = (
        "Phases: the valve has just opened (start), its command has just moved (step change), neither "
        "(steady), it has just shut (stop), it stays shut (hold)."
    )
    headline: ClassVar[str] = "velocity"
    part_word: ClassVar[str] = "lift"
    file: ClassVar[str] = FILE

    def facts(self) -> Mapping[str, Any]:
        """The start truck."""
        return {"start": self.truck.facts()}

    def facts_of(self, values: Mapping[str, float], sources: Sources, name: str) -> Mapping[str, Any]:
        """The truck with these values."""
        return {"truck": self.named(values, sources, name).facts()}

    @property
    def parts(self) -> Sequence[str]:
        """The lifts."""
        return self.lifts

    def cautions(self, recordings: Sequence[Recording]) -> Sequence[Caution]:
        """The first error alone, else all cautions."""
        return findings(recordings, self.truck)

    def suited(
        self, recordings: Sequence[Recording]
    ) -> tuple[ForkliftSubject, tuple[Recording, ...], Findings]:
        """The lifts that can be told.

        Raises
        ------
        ForkliftError
            Those of `forklift.plant.forklift.checks.suitability`.
        """
        found = suitability(recordings, self.truck, self.oil_temperature_degc)
        own = clocks(recordings, list(sensors(recordings)))
        return (
            replace(self, lifts=found.lifts, clocks=own),
            tuple(recordings),
            Findings(cautions=found.cautions),
        )

    def examined(
        self, recordings: Sequence[Recording]
    ) -> tuple[ForkliftSubject, tuple[Recording, ...], Findings]:
        """Signals that stand still or slip are taken out; the lifts that can be told are fitted.

        Raises
        ------
        ForkliftError
            Those of `forklift.plant.forklift.checks.suitability`, but for recordings in which nothing moves.
        """
        kept, invalid, known = without_invalid(recordings, self.truck)
        own = clocks(kept, list(sensors(kept)))
        try:
            suited = suitability(kept, self.truck, self.oil_temperature_degc, known)
        except ForkliftError as error:
            if error.code != "no-excitation":
                raise
            moved = {lift for recording in kept for lift in commanded(recording.lift)}
            lifts = tuple(lift for lift in LIFTS if lift in moved)
            return replace(self, lifts=lifts, clocks=own), kept, Findings(invalid, unexcited=error.message)
        cautions = suited.cautions
        same = tuple(
            (CONDITIONS[one.code], str(one.facts["lift"])) for one in cautions if one.code in CONDITIONS
        )
        held = _held(cautions)
        if held:  # what recordings held out tell is judged with it free
            every = [replace(one, role="estimate") for one in kept]
            held = _held(suitability(every, self.truck, self.oil_temperature_degc, known).cautions)
        return (
            replace(self, lifts=suited.lifts, clocks=own),
            kept,
            Findings(invalid, cautions, "", held, same),
        )

    def sensors(self, recordings: Sequence[Recording]) -> dict[str, Sensor]:
        """Told from the samples."""
        return sensors(recordings)

    def unknowns(
        self,
        held: Collection[str] = (),
        also: Collection[str] = (),
        together: Sequence[Sequence[str]] = (),
    ) -> tuple[Unknown, ...]:
        """Of the lifts that are fitted, see `forklift.plant.forklift.unknowns`; if in doubt the dither."""
        own = unknowns(self.truck, self.lifts, hold=held, also=also, together=together)
        return (*own, dither()) if self.doubts else own

    @property
    def clock_rates(self) -> tuple[SensorUnknown, ...]:
        """Of channels with stamps of their own, see `forklift.plant.forklift.clocks`."""
        return drifts(self.clocks)

    def hypotheses(
        self, recordings: Sequence[Recording], sensors: Mapping[str, Sensor]
    ) -> tuple[Hypothesis, ...]:
        """The catalogue's effects, sensors and conditions."""
        with_oil = [one.file for one in recordings if OIL in one.channels]
        travelled = _travelled(recordings, sensors)
        return hypotheses(
            self.truck, self.lifts, list(sensors), travelled, with_oil, [of for _, of in self.clocks]
        )

    def covariates(
        self, recordings: Sequence[Recording], judged: Sequence[Residual], sensors: Mapping[str, Sensor]
    ) -> dict[str, dict[str, Floats]]:
        """Commands, speeds, load and oil temperature."""
        return covariates(recordings, judged, sensors)

    def part_where(self, where: str) -> str:
        """A lift as it is, a channel's lift; ``"both"`` of the whole truck."""
        return where if where in LIFTS else lift_of(where) or "both"

    def driven(self, recording: Recording) -> Sequence[str]:
        """The lifts that are commanded."""
        return commanded(recording.lift)

    def rate_hz(self, recording: Recording, channel: str) -> float:
        """Of the channel's own clock [Hz]."""
        return recording.rate_hz(channel)

    def labels(self, recording: Recording) -> Labels:
        """By the command of the channel's lift."""
        return phases.of_recording(recording, self.truck)

    def replay(self, recording: Recording, **settings: Any) -> Mapping[str, Floats]:
        """By the adaptive integrator, or as `forklift.plant.forklift.simulate.simulate` is told."""
        told = predict(self.truck, recording, oil_temperature_degc=self.oil_temperature_degc, **settings)
        return {name: told[name] for name in self.outputs}

    def operating_points(self, conditions: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
        """Oil temperatures: the mean of those close above the coldest not yet grouped; then the load."""
        degc = np.array([one[OIL] for one in conditions])
        left = np.argsort(degc)
        while len(left):
            close = degc[left] - degc[left[0]] <= SAME_TEMPERATURE_K
            degc[left[close]] = round(float(degc[left[close]].mean()), 1)
            left = left[~close]
        return [
            {OIL: value, **{name: v for name, v in one.items() if name != OIL}}
            for value, one in zip(degc.tolist(), conditions, strict=True)
        ]

    def unjudged(self, recordings: Sequence[Recording], part: str) -> str:
        """What its velocity would be told from."""
        channels = [f"position_{part}_m"]
        if any(one.lift == part for one in recordings):
            channels.insert(0, "fork_height_m")
        finite = [
            int(np.isfinite(values).sum())
            for one in recordings
            for name in channels
            if (values := one.channels.get(name)) is not None
        ]
        if not any(finite):
            return f"no recording of it has {' or '.join(channels)}"
        return f"no recording of it has {WINDOW} samples of {' or '.join(channels)} without a gap"

    def splits(self, recordings: Sequence[Recording]) -> tuple[Split, ...]:
        """By load, oil temperature and motion."""
        return splits(recordings, self.truck)

    def possible(
        self,
        recordings: Sequence[Recording],
        found: Sequence[Mapping[str, float]],
        sensors: Mapping[str, Sensor],
    ) -> Iterable[Possible]:
        """Commands, loads and oil temperatures within a truck's limits."""
        plain = Forklift(self.at(found[0]))
        return candidates(recordings, [self.at(one) for one in found], lambda one: plain.case(one, {}))

    def once_more(self, recordings: Sequence[Recording], condition: str, part: str) -> NextRecording | None:
        """The richest recording of a lift, at another load or oil temperature."""
        return elsewhere(recordings, condition, "free" if part == "free" else "main")

    def wanted(self, recording: Recording, why: str) -> NextRecording:
        """Lift, load, oil temperature and command."""
        return wanted(recording, why)

    def signals(self, recording: Recording, readings: Mapping[str, Floats]) -> Iterator[Signal]:
        """Velocities of the lifts that move, positions, pressures and fork height."""
        return signals(recording, readings)

    def drives(self, recording: Recording) -> Sequence[Drive]:
        """The commands of the lifts that move [A]."""
        return [
            Drive(f"command, {lift} lift", "A", recording[f"current_{lift}_a"], held=True)
            for lift in commanded(recording.lift)
        ]

    def conditions(self, recording: Recording, found: Mapping[str, float]) -> Mapping[str, float]:
        """Load on the forks [kg] and mean oil temperature [°C]."""
        temperature = mean_temperature(recording, self.oil_temperature_degc)
        if "oil_temperature" in found:
            at_first = first_temperature(recording, self.oil_temperature_degc) + found["oil_temperature"]
            temperature = at_first + 0.5 * found.get("oil_warming", 0.0)
        return {"load_kg": found.get("load", recording.load_kg), "oil_temperature_degc": temperature}

    def states(self, recording: Recording, outputs: Mapping[str, Floats]) -> Mapping[str, Floats]:
        """Positions, velocities and pressures of both lifts."""
        return {name: outputs[name] for name in PREDICTED}

    def terms(
        self,
        draws: Sequence[Mapping[str, float]],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        moments: Sequence[Mapping[str, Floats]],
        part: str,
    ) -> Sequence[Sequence[Term]]:
        """See `forklift.plant.forklift.added`."""
        return added(self, draws, cases, conditions, moments, "free" if part == "free" else "main")

    def physical(self, one: Hypothesis, values: Mapping[str, float], recordings: Sequence[Recording]) -> str:
        """See `forklift.plant.forklift.physical`."""
        cases = [(own, self.conditions(own, {})["oil_temperature_degc"]) for own in recordings]
        effect = (one.amplitude or "").split(".")[1:2] if one.kind == "unknown" else [one.id]
        return "".join(physical(self.at(values), cases, id, one.where) for id in effect)

    def use(
        self, values: Mapping[str, float], recordings: Sequence[Recording], causes: Sequence[Hypothesis]
    ) -> Use:
        """A command at an operating point of the campaign."""
        held_out = [one for one in recordings if one.role == "validate"]
        shown = max(held_out or recordings, key=lambda one: one.load_kg)
        degc = self.conditions(shown, {})["oil_temperature_degc"]
        command = [
            "forklift", "simulate", "--truck", FILE, "--lift", shown.lift,
            "--load", f"{shown.load_kg:g}", "--temperature", f"{degc:.0f}",
            "--command", "prms", "--out", "lowering.csv", "--plot", "lowering.html",
        ]  # fmt: skip
        added = any(one.kind not in ("sensor", "parameter") for one in causes)
        what = "and what was missing added" if added else "and nothing added"
        return Use(
            f"{FILE}, beside this page, is the truck as it was found: its parameters fitted, {what}. Run in "
            "this folder, this command simulates a lowering with it, at the load and oil temperature entered "
            "or recorded for one of these recordings. Choose others as you need them.",
            "Simulate with the truck that was found",
            shlex.join(command),
        )

    def corrected(
        self, name: str, recordings: Sequence[Recording], conditions: Sequence[Mapping[str, float]]
    ) -> Campaign:
        """Loads to 0.1 kg, and oil temperatures moved by what was found."""
        kept = []
        for one, found in zip(recordings, conditions, strict=True):
            channels = dict(one.channels)
            if OIL in channels:
                off = found[OIL] - self.conditions(one, {})[OIL]
                channels[OIL] = channels[OIL] + off
            load = max(0.0, round(found["load_kg"], 1))
            kept.append(replace(one, load_kg=load, channels=channels, sha256="", format="memory"))
        return Campaign(f"{name}, corrected", kept[0].sample_rate_hz, tuple(kept))

    def command(self, verb: str, folder: Path, options: Sequence[str] = ()) -> str | None:
        """With the truck's file, or its name if it is shipped. Only a fit takes a width of the loads."""
        if self.truck.origin == "Python":
            return None
        name = self.truck.name if self.truck.origin == "shipped" else self.truck.origin
        given = self.oil_temperature_degc
        option = ["--load-width", repr(self.load_width_kg)] if self.load_width_kg and verb == "fit" else []
        option += [] if given is None else ["--temperature", repr(given)]
        words = ["forklift", verb, str(folder), "--truck", name, *options, *option, "--out", OUT[verb]]
        return shlex.join(words)

    @property
    def runs(self) -> str:
        """Freely, and how a velocity is told."""
        return (
            "Simulations run free from the start of each recording: no state is corrected by a measurement. "
            "Velocities are the derivative of the fork height, or of the lift's own encoder, through a "
            "Savitzky–Golay filter of 11 samples and second order, measured and simulated alike."
        )

    def write(self, folder: Path, values: Mapping[str, float], sources: Sources, name: str) -> str:
        """As ``truck.toml``."""
        self.named(values, sources, name).write(folder / FILE)
        return FILE

    def named(self, values: Mapping[str, float], sources: Sources, name: str) -> Truck:
        """The truck with these values and another name; those that moved carry their source."""
        truck = self.at(values, sources if isinstance(sources, str) else "fit")
        own = {} if isinstance(sources, str) else {k: v for k, v in sources.items() if k in truck.sources}
        return Truck(name, truck.values, {**truck.sources, **own})

    def tables(self, values: Mapping[str, float]) -> Mapping[str, SpeedTable]:
        """The controller's table of each fitted lift that has a steady lowering at every current."""
        found: dict[str, SpeedTable] = {}
        for lift in self.lifts:
            try:
                found[f"speed_table_{lift}.csv"] = speed_to_current(self.at(values), lift)
            except ForkliftError as error:
                if error.code != "no-steady-state":
                    raise
        return found


def _held(cautions: Sequence[Caution]) -> tuple[str, ...]:
    """What no recording tells. Left to its prior it would go to its bound, if that let recordings explain
    anything by what is their own: a viscosity that falls twenty times too fast turns a sensor's error of a
    tenth of a kelvin into any oil temperature."""
    return tuple(str(one.facts["parameter"]) for one in cautions if "parameter" in one.facts)


def _travelled(
    recordings: Sequence[Recording], sensors: Mapping[str, Sensor]
) -> dict[Lift, tuple[float, float]]:
    """From where to where each lift's cylinder went, by its encoder [m]."""
    ends: dict[Lift, tuple[float, float]] = {}
    for lift in LIFTS:
        name = f"position_{lift}_m"
        columns = [one.channels[name] for one in recordings if name in sensors and name in one.channels]
        moved = [column for column in columns if np.isfinite(column).any()]
        if moved:
            scale = per_output("position", lift)
            ends[lift] = (
                scale * min(float(np.nanmin(way)) for way in moved),
                scale * max(float(np.nanmax(way)) for way in moved),
            )
    return ends
