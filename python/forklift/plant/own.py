"""A machine of one's own as a diagnosis asks it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.calls import named
from forklift.plant.findings import Caution, Findings, without
from forklift.plant.gaps import missing, stuck, stuck_cautions
from forklift.plant.hypotheses import hypotheses
from forklift.plant.machine import NumpyMachine, completed
from forklift.plant.parameter import Unknown, moved_together
from forklift.plant.parts import Plant
from forklift.plant.plant_words import PlantWords
from forklift.plant.protocol import Case, Hypothesis
from forklift.plant.recording import Recording
from forklift.plant.sensor_faults import SensorUnknown
from forklift.plant.sensors import sensors
from forklift.plant.splits import splits
from forklift.plant.subject import (
    OUT,
    Drive,
    Labels,
    Possible,
    Residual,
    Signal,
    Sources,
    Split,
    Tabled,
    Term,
    Use,
)
from forklift.plant.wanted import WantedRecording
from forklift.recordings.noise import Sensor

FILE = "parameters.json"
BLOCKS = 8
"""Stretches of the held-out recordings, in all, by whose resampling credibility is told: whole recordings
where there are as many."""
PHASES = ("driven", "held")
"""Whether any input has changed within the last `RECENT` of a recording's samples."""
RECENT = 0.02


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
            raise ForkliftError(
                "estimate-missing",
                f"none of the {len(whole)} recordings of {self.name} may be fitted on; give some of them the "
                'role "estimate"',
                value=0,
                lower=1,
            )
        invalid = stuck(self.plant, whole, self.sensors(whole))
        kept = _blocked([replace(r, y=without(r.file, r.time_s, r.y, invalid)) for r in whole])
        return self, tuple(kept), Findings(invalid, tuple(missing(self.plant, kept)))

    def suited(self, recordings: Sequence[Recording]) -> tuple[PlantSubject, tuple[Recording, ...], Findings]:
        """As `examined`; what was left out is told among the cautions."""
        model, kept, found = self.examined(recordings)
        return model, kept, replace(found, cautions=(*stuck_cautions(found.invalid), *found.cautions))

    def cautions(self, recordings: Sequence[Recording]) -> Sequence[Caution]:
        """Outputs that stand still, and samples that are missing."""
        whole = [completed(self.plant, one) for one in recordings]
        invalid = stuck(self.plant, whole, self.sensors(whole))
        return (*stuck_cautions(invalid), *missing(self.plant, whole))

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
        every |= {name: one.unknown() for name, one in known.items() if name in also and name not in every}
        free = {name: one for name, one in every.items() if name not in held}
        groups = [[name for name in group if name in free] for group in together]
        joined = {group[0]: moved_together([free[name] for name in group]) for group in groups if group}
        rest = {name for group in groups for name in group[1:]}
        return tuple(joined.get(name, one) for name, one in free.items() if name not in rest)

    @property
    def clock_rates(self) -> tuple[SensorUnknown, ...]:
        """None: time stamps are taken as they are, and an output that is late is a hypothesis."""
        return ()

    def hypotheses(
        self, recordings: Sequence[Recording], sensors: Mapping[str, Sensor]
    ) -> tuple[Hypothesis, ...]:
        """The catalogue's effects, and their dull rivals."""
        return hypotheses(self.plant, recordings)

    def covariates(
        self, recordings: Sequence[Recording], judged: Sequence[Residual], sensors: Mapping[str, Sensor]
    ) -> dict[str, dict[str, Floats]]:
        """Each input and its change; each condition, as its deviation from the mean of all."""
        names = sorted({name for one in recordings for name in one.conditions})
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
        """Of the output's own clock [Hz]: the mean, if its steps differ."""
        own = recording.time_s[recording.own(channel)]
        time = own if len(own) > 1 else recording.time_s
        return (len(time) - 1) / float(np.ptp(time))

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
        return splits(self.plant, recordings)

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
        draws: Sequence[Mapping[str, float]],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        moments: Sequence[Mapping[str, Floats]],
        part: str,
    ) -> Sequence[Sequence[Term]]:
        """Each effect's own terms, at every moment."""
        return [self._terms(values, cases, conditions, moments) for values in draws]

    def _terms(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        moments: Sequence[Mapping[str, Floats]],
    ) -> list[Term]:
        present = self.present(values)
        found = [Term(one.name, {port: [] for port in one.ports}) for one in present.effects]
        for case, own, seen in zip(cases, conditions, moments, strict=True):
            p = {**self.parameters(values), **dict(zip(case.names, own.tolist(), strict=True))}
            for term, effect, its in zip(found, present.effects, present.own(p), strict=True):
                what = f"term of effect {effect.id}"
                said = named(self.plant.name, what, effect.term, seen, seen, its, seen)
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
        words = ["forklift", verb, str(folder), "--machine", self.origin, *options, "--out", OUT[verb]]
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


def _blocked(recordings: Sequence[Recording]) -> list[Recording]:
    """Few held-out recordings count as several stretches each."""
    held = [one for one in recordings if one.role == "validate"] or list(recordings)
    each = max(1, round(BLOCKS / max(len(held), 1)))
    return [replace(one, blocks=each) if one in held else one for one in recordings]
