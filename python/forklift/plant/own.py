"""A machine of one's own as a diagnosis asks it."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log, pi, sqrt
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.typeset import number, printed
from forklift.plant.findings import Caution, Findings, InvalidStretch, without
from forklift.plant.hypotheses import hypotheses
from forklift.plant.machine import NumpyMachine, completed
from forklift.plant.misread import Found, misread
from forklift.plant.parameter import Unknown
from forklift.plant.parts import Plant
from forklift.plant.protocol import Case, Hypothesis
from forklift.plant.recording import Recording
from forklift.plant.sensors import sensors
from forklift.plant.subject import (
    Drive,
    Labels,
    Possible,
    Residual,
    Shown,
    Signal,
    Sources,
    Split,
    Tabled,
    Term,
    Use,
)
from forklift.recordings.noise import Sensor, white_noise

FILE = "parameters.json"
BLOCKS = 8
"""Stretches of the held-out recordings, in all, by whose resampling credibility is told: whole recordings
where there are as many."""
PHASES = ("driven", "held")
"""Whether any input has changed within the last `RECENT` of a recording's samples."""
RECENT = 0.02
UNLIKELY = 1e-6
"""Probability below which equal samples in a row are no chance: a signal that stands still."""
NOISY = 0.3
"""Least share of the sensor's noise that the samples must show."""
PLACES = {"balance": "a balance", "law": "a law", "input": "an input", "sensor": "a sensor"}
"""By a place's kind: what it means to be wrong there."""


@dataclass(frozen=True)
class PlantWords:
    """The vocabulary of a plant: its own names; see `forklift.plant.subject.Words`."""

    plant: Plant
    noun: ClassVar[str] = "model"
    kinds: ClassVar[Mapping[str, str]] = {
        "physics": "effect",
        "sensor": "sensor or input",
        "parameter": "parameter that was held as known",
        "unknown": "curve without a name",
    }

    def part(self, name: str) -> str:
        """There is one."""
        return ""

    def equation(self, name: str) -> str:
        """A balance, a law, an input, a sensor or a parameter."""
        return PLACES.get(name, f"a {name}")

    def place(self, name: str) -> Shown:
        """A port, an input, an output or a parameter."""
        unit = printed(self._units().get(name, "1"))
        port = next((one for one in self.plant.ports if one.name == name), None)
        if port is not None:
            return Shown(f"{name}, {PLACES[port.kind]}", unit)
        if any(one.name == name for one in self.plant.inputs):
            return Shown(f"the input {name}", unit)
        if any(one.name == name for one in self.plant.outputs):
            return Shown(f"the sensor of {name}", unit)
        return Shown(f"the parameter {name}", unit)

    def signal(self, channel: str) -> str:
        """As it is called."""
        return channel

    def like(self, channel: str) -> str:
        """As any."""
        return ""

    def parameters_like(self, part: str) -> str:
        """As any."""
        return ""

    def drawn(self, channel: str, unit: str) -> Shown:
        """In its own unit."""
        return Shown(channel, printed(unit))

    def fine(self, channel: str, unit: str) -> Shown:
        """In its own unit."""
        return Shown(channel, printed(unit))

    def variable(self, name: str, part: str) -> Shown:
        """A state, input, output or port; what is on the bus has no unit."""
        return Shown(name, printed(self._units().get(name, "1")))

    def condition(self, name: str) -> Shown:
        """As it is called."""
        return Shown(name)

    def at(self, name: str, where: str) -> str:
        """With where it acts, if the name does not say it."""
        said = not where or re.search(rf"(?<!\w){re.escape(where)}(?!\w)", name)
        return name if said else f"{name} ({where})"

    def sentence(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> str:
        """Its name says it."""
        return ""

    def found(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> Found:
        """A sensor's or an input's gain, offset or lag."""
        if one.kind != "sensor" or not one.where:
            return Found()
        given = any(own.name == one.where for own in self.plant.inputs)
        return Found() if given else misread(f"the sensor of {one.where}", rows)

    def law(self, one: Hypothesis) -> Sequence[str]:
        """Where it acts, and its source."""
        effect = next((e for e in self.plant.effects if one.kind == "physics" and e.id == one.id), None)
        if effect is None:
            return ()
        source = f" Source: {effect.source}." if effect.source else ""
        name = self.at(one.name, one.where)
        where = f", at {' and '.join(effect.ports)}" if effect.ports else ""
        return (f"{name[:1].upper()}{name[1:]} (“{one.id}”){where}.{source}",)

    def _units(self) -> dict[str, str]:
        plant = self.plant
        states = (*plant.states, *(state for one in plant.effects for state in one.states))
        parts: tuple[Any, ...] = (*states, *plant.inputs, *plant.outputs, *plant.ports)
        return {one.name: one.unit for one in reversed(parts)}


@dataclass(frozen=True)
class PlantSubject(NumpyMachine):
    """See `forklift.plant.subject.Subject`.

    Attributes
    ----------
    candidates
        Recordings that could be made, with inputs only.
    origin
        The file it came from, if it came from one.
    """

    candidates: tuple[Recording, ...] = ()
    origin: str = ""
    reaches_noise: ClassVar[bool] = False
    phases: ClassVar[Sequence[str]] = PHASES
    phase_words: ClassVar[Mapping[str, str]] = {
        "driven": "stretches in which an input has just changed",
        "held": "stretches with steady inputs",
    }
    phase_note: ClassVar[str] = "Phases: an input has changed lately (driven), or none has (held)."
    headline: ClassVar[str] = ""
    part_word: ClassVar[str] = "part"
    file: ClassVar[str] = FILE

    @property
    def words(self) -> PlantWords:
        """Its own names."""
        return PlantWords(self.plant)

    def facts(self) -> Mapping[str, Any]:
        """Its name and source."""
        return {"start": {"name": self.name, "source": self.plant.source}}

    def facts_of(self, values: Mapping[str, float], sources: Sources, name: str) -> Mapping[str, Any]:
        """Values by name, where they come from, and the effects that are present."""
        return {"plant": self._told(values, sources)}

    def _told(self, values: Mapping[str, float], sources: Sources) -> dict[str, Any]:
        origin = {"source": sources} if isinstance(sources, str) else {"sources": dict(sources)}
        return {**origin, "values": self.parameters(values), "present": self._present(values)}

    def named(self, values: Mapping[str, float], sources: Sources, name: str) -> Plant:
        """The plant with these values and another name; effects that are present are still candidates."""
        known = {} if isinstance(sources, str) else sources
        said = sources if isinstance(sources, str) else self.plant.source
        params = tuple(
            replace(one, value=values[one.name], source=known.get(one.name, said))
            if one.name in values
            else one
            for one in self.plant.params
        )
        return replace(self.plant, name=name, params=params)

    @property
    def parts(self) -> Sequence[str]:
        """One, which has no name."""
        return ("",)

    def _present(self, values: Mapping[str, float]) -> list[str]:
        return [one.id for one in self.plant.effects if one.amplitude in values]

    def examined(
        self, recordings: Sequence[Recording]
    ) -> tuple[PlantSubject, tuple[Recording, ...], Findings]:
        """With derived inputs; samples of outputs that stand still for longer than noise can are left out.

        Raises
        ------
        ForkliftError
            ``"channel-unknown"``, ``"estimate-missing"``.
        """
        whole = [completed(self.plant, one) for one in recordings]
        if not any(one.role == "estimate" for one in whole):
            raise ForkliftError("estimate-missing", f"no recording of {self.name} may be fitted on")
        invalid = self._invalid(whole)
        kept = _blocked([replace(r, y=without(r.file, r.time_s, r.y, invalid)) for r in whole])
        return self, tuple(kept), Findings(invalid, tuple(self._missing(kept)))

    def suited(self, recordings: Sequence[Recording]) -> tuple[PlantSubject, tuple[Recording, ...], Findings]:
        """As `examined`; what was left out is told among the cautions."""
        model, kept, found = self.examined(recordings)
        return model, kept, replace(found, cautions=(*_stuck_cautions(found.invalid), *found.cautions))

    def cautions(self, recordings: Sequence[Recording]) -> Sequence[Caution]:
        """Outputs that stand still, and samples that are missing."""
        whole = [completed(self.plant, one) for one in recordings]
        return (*_stuck_cautions(self._invalid(whole)), *self._missing(whole))

    def _invalid(self, recordings: Sequence[Recording]) -> tuple[InvalidStretch, ...]:
        known = self.sensors(recordings)
        return tuple(found for one in recordings for found in self._stuck(one, known))

    def _stuck(self, recording: Recording, known: Mapping[str, Sensor]) -> Iterator[InvalidStretch]:
        """Equal samples in a row where the sensor's noise σ makes them impossible.

        Two readings of resolution d are equal with a probability of about p = d/(2√π σ); of n samples, k in
        a row are by chance with n pᵏ⁻¹ at most. What lies at an end of the sensor's range, and counts, say
        nothing.
        """
        for one in self.plant.outputs:
            values = recording.y.get(one.name)
            sensor = known[one.name]
            if values is None or sensor.count:
                continue
            finite = values[np.isfinite(values)]
            steps = np.diff(np.unique(finite))
            if not len(steps) or white_noise([values]) < NOISY * sensor.noise:
                continue  # no noise to speak of: what rests stands still
            p = float(steps.min()) / (2.0 * sqrt(pi) * sensor.noise)
            if p >= 0.5:
                continue
            fewest = 2 + int(np.ceil((log(UNLIKELY) - log(len(values))) / log(p)))
            same = np.diff(values) == 0.0
            inside = (values[1:] > one.lower) & (values[1:] < one.upper)
            edges = np.flatnonzero(np.diff(np.r_[False, same & inside, False].astype(int)))
            for first, last in zip(edges[::2], edges[1::2], strict=True):
                if last - first + 1 >= fewest:
                    time = recording.time_s
                    yield InvalidStretch(
                        recording.file, one.name, float(time[first]), float(time[last]), "stuck"
                    )

    def _missing(self, recordings: Sequence[Recording]) -> Iterator[Caution]:
        missing = {
            one.name: sum(int((~np.isfinite(r.y[one.name])).sum()) for r in recordings if one.name in r.y)
            for one in self.plant.outputs
        }
        lost = [f"{count} of {name}" for name, count in missing.items() if count]
        if lost:
            yield Caution("samples-missing", f"Missing samples, which count for nothing: {', '.join(lost)}.")
        absent = [
            f"{one.name} in {', '.join(without)}"
            for one in self.plant.outputs
            if (without := [r.file for r in recordings if one.name not in r.y])
        ]
        if absent:
            yield Caution("not-recorded", f"Not recorded: {'; '.join(absent)}.")

    def sensors(self, recordings: Sequence[Recording]) -> dict[str, Sensor]:
        """As given, or told from the samples."""
        return sensors(self.plant, recordings)

    def unknowns(
        self,
        held: Collection[str] = (),
        also: Collection[str] = (),
        together: Sequence[Sequence[str]] = (),
    ) -> tuple[Unknown, ...]:
        """The plant's parameters that are not known, and shared free starts.

        Raises
        ------
        ForkliftError
            ``"parameter-unknown"``; ``"argument-invalid"`` for a group that mixes scales.
        """
        every = {one.name: one for one in super().unknowns()}
        known = {one.name: one for one in self.plant.params if one.per == "plant"}
        for name in (*held, *also, *(name for group in together for name in group)):
            if name not in every and name not in known:
                raise ForkliftError(
                    "parameter-unknown",
                    f"{self.name} has no parameter {name}; it has {', '.join({**known, **every})}",
                    name=name,
                )
        every |= {name: known[name].unknown() for name in also if name not in every}
        free = {name: one for name, one in every.items() if name not in held}
        groups = [[name for name in group if name in free] for group in together]
        joined = {group[0]: _joined([free[name] for name in group]) for group in groups if group}
        rest = {name for group in groups for name in group[1:]}
        return tuple(joined.get(name, one) for name, one in free.items() if name not in rest)

    def hypotheses(
        self, recordings: Sequence[Recording], sensors: Mapping[str, Sensor]
    ) -> tuple[Hypothesis, ...]:
        """The catalogue's effects, and their dull rivals."""
        return hypotheses(self.plant, recordings)

    def covariates(
        self, recordings: Sequence[Recording], judged: Sequence[Residual], sensors: Mapping[str, Sensor]
    ) -> dict[str, dict[str, Floats]]:
        """Each input and its change; each condition, as its deviation from the mean of all."""
        names = {name for one in recordings for name in one.conditions}
        told = {
            name: [one.conditions[name] for one in recordings if name in one.conditions] for name in names
        }
        known = {}
        for recording in recordings:
            columns: dict[str, Floats] = {}
            for one in self.plant.inputs:
                u = recording.u[one.name]
                if np.ptp(u) > 0.0:
                    columns[f"input {one.name}"] = (u - u.mean())[:, None]
                    columns[f"change of the input {one.name}"] = np.gradient(u, recording.time_s)[:, None]
            for name, values in told.items():
                if len(set(values)) > 1 and name in recording.conditions:
                    off = recording.conditions[name] - float(np.mean(values))
                    columns[name] = np.full((len(recording), 1), off)
            known[recording.file] = columns
        return known

    def part_where(self, where: str) -> str:
        """There is one part."""
        return ""

    def driven(self, recording: Recording) -> Sequence[str]:
        """The one part."""
        return ("",)

    def rate_hz(self, recording: Recording, channel: str) -> float:
        """Of the recording [Hz]: the mean, if its steps differ."""
        return (len(recording) - 1) / float(np.ptp(recording.time_s))

    def labels(self, recording: Recording) -> Labels:
        """Driven for `RECENT` of its length after any input has changed, else held."""
        moved = np.zeros(len(recording), bool)
        for one in self.plant.inputs:
            u = recording.u[one.name]
            moved |= np.abs(np.diff(u, prepend=u[:1])) > 0.01 * float(np.ptp(u))
        last = np.maximum.accumulate(np.where(moved, np.arange(len(moved)), -len(moved)))
        held = (np.arange(len(moved)) - last > RECENT * len(moved)).astype(np.intp)
        return dict.fromkeys(recording.y, held)

    def replay(self, recording: Recording, **settings: Any) -> Mapping[str, Floats]:
        """As the plant is scored, from starts as the first samples or the plant tell them."""
        if settings:
            raise ForkliftError(
                "argument-invalid",
                f"a plant has its own steps (max_dt, order), and no setting {next(iter(settings))}",
                name=next(iter(settings)),
            )
        whole = completed(self.plant, recording)
        known = self.sensors([whole])
        found = {name: np.full(len(whole), np.nan) for name in self.outputs}
        for piece in self.pieces(whole):
            case = self.case(piece, known)
            run = self.run({}, [case], [case.centre], substeps=1)[0]
            first = int(np.searchsorted(whole.time_s, piece.time_s[0]))
            for name, column in zip(self.outputs, run.outputs.T, strict=True):
                found[name][first : first + len(column)] = column
        return found

    def operating_points(self, conditions: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
        """As they were given."""
        return [dict(one) for one in conditions]

    def unjudged(self, recordings: Sequence[Recording], part: str) -> str:
        """None of its outputs was recorded."""
        return f"no recording has {' or '.join(self.outputs)}"

    def splits(self, recordings: Sequence[Recording]) -> tuple[Split, ...]:
        """At the widest gap of every condition, and of every input at the middle of its range."""
        names = sorted({name for one in recordings for name in one.conditions})
        return (
            *(split for name in names for split in _by_condition(recordings, name)),
            *(
                split
                for one in self.plant.inputs
                if not one.derived
                for split in _by_input(recordings, one.name, one.unit)
            ),
        )

    def possible(
        self,
        recordings: Sequence[Recording],
        found: Sequence[Mapping[str, float]],
        sensors: Mapping[str, Sensor],
    ) -> Iterable[Possible]:
        """Those that were given."""
        zeros = [
            replace(
                completed(self.plant, one), y={out.name: np.zeros(len(one)) for out in self.plant.outputs}
            )
            for one in self.candidates
        ]
        pieces = [piece for one in zeros for piece in self.pieces(one)]
        return [Possible(one.file, self.case(one, sensors)) for one in pieces]

    def once_more(self, recordings: Sequence[Recording], condition: str, part: str) -> None:
        """Only what was given can be made."""

    def wanted(self, recording: Recording, why: str) -> WantedRecording:
        """A candidate's inputs."""
        return WantedRecording(self.plant, recording, why)

    def signals(self, recording: Recording, readings: Mapping[str, Floats]) -> Iterator[Signal]:
        """Every output that was recorded; within the ends of its sensor."""
        for one in self.plant.outputs:
            if one.name in recording.y:
                read = np.clip(readings[one.name], one.lower, one.upper)
                yield Signal("", one.name, one.unit, True, one.name, recording.y[one.name], read)

    def drives(self, recording: Recording) -> Sequence[Drive]:
        """Every input."""
        return [
            Drive(one.name, one.unit, recording.u[one.name], held=one.hold == "zero")
            for one in self.plant.inputs
        ]

    def conditions(self, recording: Recording, found: Mapping[str, float]) -> Mapping[str, float]:
        """As they were given."""
        return recording.conditions

    def states(self, recording: Recording, outputs: Mapping[str, Floats]) -> Mapping[str, Floats]:
        """Every output."""
        return {one.name: outputs[one.name] for one in self.plant.outputs}

    def terms(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        moments: Sequence[Mapping[str, Floats]],
    ) -> Sequence[Term]:
        """Each effect's own terms, at every moment."""
        present = self.present(values)
        found = [Term(one.name, {port: [] for port in one.ports}) for one in present.effects]
        for case, own, seen in zip(cases, conditions, moments, strict=True):
            p = {**self.parameters(values), **dict(zip(case.names, own.tolist(), strict=True))}
            for term, effect, its in zip(found, present.effects, present.own(p), strict=True):
                said = effect.term(seen, seen, its, seen)
                for port, columns in term.added.items():
                    value = np.asarray(said.get(port, 0.0), float)
                    columns.append(np.broadcast_to(value, len(case.recording)))  # type: ignore[attr-defined]
        return found

    def physical(self, one: Hypothesis, values: Mapping[str, float], recordings: Sequence[Recording]) -> str:
        """Its parameters are what a reader knows."""
        return ""

    def use(
        self, values: Mapping[str, float], recordings: Sequence[Recording], causes: Sequence[Hypothesis]
    ) -> Use:
        """A call with the parameters and effects that were found."""
        plant = self.plant
        present = self._present(values)
        heads = tuple(f"{name}." for name in present)
        own = {one.name for one in plant.params} | {f"{state.name}.start" for state in plant.states}
        shown = {name: value for name, value in values.items() if name in own or name.startswith(heads)}
        given = ", ".join(f'"{name}": {value:.6g}' for name, value in shown.items())
        more = f", present={present}".replace("'", '"') if present else ""
        others = [one.label for one in causes if one.id not in present]
        return Use(
            f"{FILE}, beside this page, holds the parameters and effects that were found.",
            "Simulate with what was found, through times and inputs of your own",
            f"forklift.simulate_plant(plant, time_s, u, {{{given}}}{more})",
            f"It leaves out what is no effect of the model's own: {', '.join(others)}." if others else "",
        )

    def corrected(
        self, name: str, recordings: Sequence[Recording], conditions: Sequence[Mapping[str, float]]
    ) -> None:
        """Its conditions are what was given."""

    def command(self, verb: str, folder: Path, options: Sequence[str] = ()) -> str | None:
        """With the file that the plant came from."""
        if not self.origin:
            return None
        words = ["forklift", verb, str(folder), "--machine", self.origin, *options, "--out", "result"]
        return shlex.join(words)

    @property
    def runs(self) -> str:
        """As the plant is scored."""
        if self.plant.score == "algebraic":
            return "The machine has no states: every moment is predicted from its inputs alone."
        if self.plant.score == "restart":
            return (
                f"Simulations start anew every {self.plant.horizon_s:g} s, and run free in between: no state "
                "is corrected by a measurement."
            )
        return (
            "Simulations run free from the start of each recording: no state is corrected by a measurement."
        )

    def write(self, folder: Path, values: Mapping[str, float], sources: Sources, name: str) -> str:
        """As ``parameters.json``: name, source, parameters by name, and the effects that are present."""
        told = {"name": name, **self._told(values, sources)}
        (folder / FILE).write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
        return FILE

    def tables(self, values: Mapping[str, float]) -> Mapping[str, Tabled]:
        """None."""
        return {}

    @property
    def table_files(self) -> Sequence[str]:
        """None."""
        return ()


@dataclass(frozen=True, eq=False)
class WantedRecording:
    """A candidate that was chosen; see `forklift.plant.subject.Wanted`."""

    plant: Plant
    recording: Recording
    why: str

    @property
    def title(self) -> str:
        """Its name."""
        return self.recording.file

    @property
    def settings(self) -> Sequence[tuple[str, str]]:
        """Its conditions."""
        return [(name, number(value)) for name, value in self.recording.conditions.items()]

    @property
    def drives(self) -> tuple[Floats, Sequence[Drive]]:
        """Its inputs, what moves first."""
        u = self.recording.u
        own = [one for one in self.plant.inputs if one.derived is None]
        own.sort(key=lambda one: not np.ptp(u[one.name]))
        return self.recording.time_s, [
            Drive(one.name, one.unit, u[one.name], held=one.hold == "zero") for one in own
        ]

    def write(self, path: str | Path) -> Path:
        """Its inputs as CSV."""
        time, drives = self.drives
        head = ",".join(["time_s", *(one.name for one in drives)])
        table = np.column_stack([time, *(one.values for one in drives)])
        np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")
        return Path(path)

    def to_dict(self, command: str) -> dict[str, Any]:
        """Name, conditions and the file of its inputs."""
        return {
            "why": self.why,
            "recording": self.recording.file,
            **self.recording.conditions,
            "command": command,
        }


def _stuck_cautions(invalid: Sequence[InvalidStretch]) -> Iterator[Caution]:
    for one in invalid:
        what = f"{one.channel}: {one.said}, which its noise does not; those samples count for nothing"
        yield Caution("channel-stuck", f"{what}.", {"file": one.file, "channel": one.channel})


def _joined(group: Sequence[Unknown]) -> Unknown:
    """Numbers that move by the same factor, or the same amount."""
    first = group[0]
    if len({one.scale for one in group}) > 1:
        names = " and ".join(one.name for one in group)
        raise ForkliftError(
            "argument-invalid",
            f"{names} cannot move together: their scales differ; group like with like",
            name=first.name,
        )
    return Unknown(
        tuple(one.name for one in group),
        first.unit,
        first.scale,
        tuple(one.start[0] for one in group),
        first.width,
        max(one.lower * one.width for one in group) / first.width,
        min(one.upper * one.width for one in group) / first.width,
    )


def _blocked(recordings: Sequence[Recording]) -> list[Recording]:
    """Few held-out recordings count as several stretches each."""
    held = [one for one in recordings if one.role == "validate"] or list(recordings)
    each = max(1, round(BLOCKS / max(len(held), 1)))
    return [replace(one, blocks=each) if one in held else one for one in recordings]


def _by_condition(recordings: Sequence[Recording], name: str) -> Iterator[Split]:
    values = [one.conditions.get(name, np.nan) for one in recordings]
    levels = np.unique(values)
    if not np.isfinite(values).all() or len(levels) < 2:
        return
    widest = int(np.argmax(np.diff(levels)))
    low, high = levels[widest], levels[widest + 1]
    rows = tuple(np.full(len(one), value <= low) for one, value in zip(recordings, values, strict=True))
    yield Split(name, f"recordings up to {low:.3g}", f"recordings from {high:.3g}", rows)


def _by_input(recordings: Sequence[Recording], name: str, unit: str) -> Iterator[Split]:
    columns = [one.u[name] for one in recordings]
    middle = 0.5 * (min(float(u.min()) for u in columns) + max(float(u.max()) for u in columns))
    said = f"{middle:.3g} {printed(unit)}".rstrip()
    rows = tuple(u < middle for u in columns)
    yield Split(
        f"input {name}", f"samples with {name} below {said}", f"samples with {name} from {said} on", rows
    )
