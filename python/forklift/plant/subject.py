"""What the verbs ask of a machine beside its runs: its recordings, its words, and what they may part."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.plant.findings import Caution, Findings
from forklift.plant.misread import Found
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Case, Hypothesis, Machine
from forklift.plant.sensor_faults import SensorUnknown
from forklift.recordings.noise import Sensor

Labels = Mapping[str, NDArray[np.intp]]
"""By channel, (times,) the phase of each sample, an index into `Subject.phases`."""

Sources = str | Mapping[str, str]
"""Where values come from: one sentence for all, or one by name."""


class Residual(Protocol):
    """What a model leaves over of one channel of one recording."""

    @property
    def file(self) -> str:
        """The recording's."""

    @property
    def channel(self) -> str:
        """What was measured."""

    @property
    def rows(self) -> NDArray[np.intp]:
        """(samples,) at which of the recording's times."""

    @property
    def left(self) -> Floats:
        """(samples,) in units of the sensor's noise."""


@dataclass(frozen=True, eq=False)
class Signal:
    """One measured signal beside its simulation, at the recording's times.

    Attributes
    ----------
    part
        Of the machine; empty where there is one.
    channel, unit
        What it is called, and the unit of its values.
    driven
        Whether it answers what drove the recording, rather than being at rest.
    measured_from
        The channel that it is, or is derived from.
    measured, simulated
        (times,), NaN where a sample is missing.
    """

    part: str
    channel: str
    unit: str
    driven: bool
    measured_from: str
    measured: Floats
    simulated: Floats


@dataclass(frozen=True, eq=False)
class Drive:
    """What drove a recording: (times,) of one input, held between samples or not."""

    name: str
    unit: str
    values: Floats
    held: bool


@dataclass(frozen=True, eq=False)
class Split:
    """Two regimes.

    Attributes
    ----------
    name, first, second
        In words: ``"load"``, ``"up to 800 kg"``, ``"1500 kg"``.
    rows
        By recording: (times,) which of its samples belong to the first.
    """

    name: str
    first: str
    second: str
    rows: tuple[NDArray[np.bool_], ...]


@dataclass(frozen=True, eq=False)
class Possible:
    """A recording that could be made: its name in words, and how the machine would run it."""

    name: str
    case: Case


class Wanted(Protocol):
    """A recording to be made next."""

    @property
    def why(self) -> str:
        """What it would tell."""

    @property
    def title(self) -> str:
        """In a few words."""

    def write(self, path: str | Path) -> Path:
        """Write what drives it as a file."""

    def to_dict(self, command: str) -> dict[str, Any]:
        """For JSON; `command` is the name of that file."""

    @property
    def settings(self) -> Sequence[tuple[str, str]]:
        """What to set, each with its value, in words."""

    @property
    def drives(self) -> tuple[Floats, Sequence[Drive]]:
        """(times,) and what drives it."""


class Written(Protocol):
    """What can be written into a folder of its own."""

    def write(self, folder: str | Path) -> Path:
        """Whole or not at all."""


class Tabled(Protocol):
    """A table made of a machine, for use elsewhere."""

    def write(self, path: str | Path) -> Path:
        """As a file."""

    def facts(self) -> Mapping[str, Any]:
        """What it is, for JSON."""


class Shown(NamedTuple):
    """A quantity as text and figures have it: its name, its unit there, and how many of that one of its own
    is."""

    name: str
    unit: str = ""
    scale: float = 1.0

    @property
    def is_amount(self) -> bool:
        """Whether zero is none of it: not of a temperature."""
        return self.unit != "°C"


class Term(NamedTuple):
    """What one effect of a machine adds."""

    name: str
    added: Mapping[str, Sequence[Floats]]
    """By port, of every recording (times,), in the port's unit."""
    over: str = ""
    """The variable that it is a function of; empty if that is not known."""


class Use(NamedTuple):
    """How to go on with what was found."""

    lead: str
    title: str
    code: str
    note: str = ""


class Words(Protocol):
    """What a machine's things are called, in text and on pages."""

    @property
    def noun(self) -> str:
        """``"truck"``, ``"model"``."""

    @property
    def kinds(self) -> Mapping[str, str]:
        """By kind of hypothesis, the word for it."""

    def part(self, name: str) -> str:
        """A part: ``"the main lift"``; empty where there is one."""

    def equation(self, name: str) -> str:
        """An equation of the model, or a kind of place."""

    def place(self, name: str) -> Shown:
        """A place where an unknown input may enter, or a channel's sensor."""

    def signal(self, channel: str) -> str:
        """A channel in words."""

    def circuit(self, marked: Collection[str], tied: Collection[str], part: str) -> str:
        """A drawing (SVG) of a part, with the places of equations marked, and of those that stand for them;
        empty if there is none."""

    def like(self, channel: str) -> str:
        """What a table of a channel's fits is laid out as; empty if it is as any."""

    def parameters_like(self, part: str) -> str:
        """The same of a table of a part's parameters."""

    def drawn(self, channel: str, unit: str) -> Shown:
        """A signal as a figure has it."""

    def used(self, channel: str, unit: str) -> Shown:
        """What a driven channel is to who uses the machine: words that its value comes after."""

    def fine(self, channel: str, unit: str) -> Shown:
        """An error of a signal, in the unit that suits its size."""

    def variable(self, name: str, part: str) -> Shown:
        """A variable of operation."""

    def condition(self, name: str) -> Shown:
        """A condition of a recording."""

    def at(self, name: str, where: str) -> str:
        """What has a name, with where it acts."""

    def sentence(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> str:
        """What is the matter, with its numbers; empty if its name says it."""

    def found(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> Found:
        """Of a sensor or a condition: how it is off, with direction and size; empty of all else."""

    def check(self, one: Hypothesis) -> str:
        """What to look at on the machine to tell what no recording does; empty, if nothing is known."""

    def sound(self, one: Hypothesis) -> str:
        """That the machine has an effect, and whether a sound one has it too; empty, if that is not known."""

    def law(self, one: Hypothesis) -> Sequence[str]:
        """Of an effect that the catalogue knows its equation, how it shows itself, and its source."""


OUT = {"compare": "result", "fit": "fitted", "diagnose": "found"}
"""The folder that a verb's command names: one verb does not write over another's result."""


class Subject(Machine, Protocol):
    """A machine with what a diagnosis asks of it."""

    @property
    def words(self) -> Words:
        """What its things are called."""

    @property
    def headline(self) -> str:
        """How the channels begin by whose fit (NRMSE) the machine is told; empty: by its outputs' errors."""

    @property
    def part_word(self) -> str:
        """What its parts are called: ``"lift"``."""

    def facts(self) -> Mapping[str, Any]:
        """What the fit started from, for JSON."""

    def facts_of(self, values: Mapping[str, float], sources: Sources, name: str) -> Mapping[str, Any]:
        """What the machine is with these values, for JSON."""

    def named(self, values: Mapping[str, float], sources: Sources, name: str) -> Any:
        """The machine as its user has it, with these values: a `Truck`, a `Plant`."""

    @property
    def parts(self) -> Sequence[str]:
        """Those that are fitted; one without a name where there is one."""

    @property
    def reaches_noise(self) -> bool:
        """Whether a complete model of it is known to leave no more than the sensors' noise."""

    @property
    def phases(self) -> Sequence[str]:
        """The phases of a motion, in words."""

    @property
    def phase_note(self) -> str:
        """What they mean, in a sentence."""

    @property
    def phase_words(self) -> Mapping[str, str]:
        """By phase, as a sentence says it: ``"in {steady lowering}"``."""

    def cautions(self, recordings: Sequence[Any]) -> Sequence[Caution]:
        """What is wrong with recordings, as whoever only looks at them must know it."""

    def suited(self, recordings: Sequence[Any]) -> tuple[Subject, tuple[Any, ...], Findings]:
        """As `examined`, for a fit alone: what is no measurement is refused, not left out.

        Raises
        ------
        ForkliftError
            If they cannot support a fit.
        """

    def examined(self, recordings: Sequence[Any]) -> tuple[Subject, tuple[Any, ...], Findings]:
        """The machine as these recordings tell it, the recordings without what is no measurement, findings.

        Raises
        ------
        ForkliftError
            If they cannot support a fit.
        """

    def sensors(self, recordings: Sequence[Any]) -> dict[str, Sensor]:
        """By channel, noise and count."""

    def unknowns(
        self,
        held: Collection[str] = (),
        also: Collection[str] = (),
        together: Sequence[Sequence[str]] = (),
    ) -> tuple[Unknown, ...]:
        """What is estimated: but for what is held, with what else is wanted, in groups that move together.

        Raises
        ------
        ForkliftError
            ``"parameter-unknown"``, ``"argument-invalid"``.
        """

    @property
    def clock_rates(self) -> tuple[SensorUnknown, ...]:
        """How fast clocks run that are not the command's; none where all is on one."""

    def hypotheses(self, recordings: Sequence[Any], sensors: Mapping[str, Sensor]) -> tuple[Hypothesis, ...]:
        """What may be amiss."""

    def covariates(
        self, recordings: Sequence[Any], judged: Sequence[Residual], sensors: Mapping[str, Sensor]
    ) -> dict[str, dict[str, Floats]]:
        """By recording and variable, (times, columns) that a residual may be correlated with."""

    def part_where(self, where: str) -> str:
        """The part that a hypothesis acts on, or a word for all of them; empty where there is one."""

    def driven(self, recording: Any) -> Sequence[str]:
        """The parts that a recording drives."""

    def rate_hz(self, recording: Any, channel: str) -> float:
        """Of a channel [Hz]."""

    def labels(self, recording: Any) -> Labels:
        """The phase of every sample."""

    def replay(self, recording: Any, **settings: Any) -> Mapping[str, Floats]:
        """Its own outputs, (times,), free-running as it stands: nothing is adjusted to the recording.

        Raises
        ------
        ForkliftError
            If the run fails, or for a setting of the integrator that it does not have.
        """

    def operating_points(self, conditions: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
        """Conditions of recordings as they were meant: nearly equal ones are one."""

    def unjudged(self, recordings: Sequence[Any], part: str) -> str:
        """Why a part has no signal by whose fit it is told."""

    def splits(self, recordings: Sequence[Any]) -> tuple[Split, ...]:
        """Every way to part these recordings into two regimes."""

    def possible(
        self, recordings: Sequence[Any], found: Sequence[Mapping[str, float]], sensors: Mapping[str, Sensor]
    ) -> Iterable[Possible]:
        """Recordings that could be made, on the machine as each of these values has it."""

    def once_more(self, recordings: Sequence[Any], condition: str, part: str) -> Wanted | None:
        """A recording of a part again, with another value of a condition."""

    def wanted(self, recording: Any, why: str) -> Wanted:
        """A recording that could be made, as one to be made."""

    def signals(self, recording: Any, readings: Mapping[str, Floats]) -> Iterator[Signal]:
        """What of a recording is compared with what the sensors would read."""

    def drives(self, recording: Any) -> Sequence[Drive]:
        """What drove it."""

    def conditions(self, recording: Any, found: Mapping[str, float]) -> Mapping[str, float]:
        """Conditions by name, as entered and corrected by what was found of the recording."""

    def states(self, recording: Any, outputs: Mapping[str, Floats]) -> Mapping[str, Floats]:
        """The columns of a prediction's file."""

    def terms(
        self,
        draws: Sequence[Mapping[str, float]],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        moments: Sequence[Mapping[str, Floats]],
        part: str,
    ) -> Sequence[Sequence[Term]]:
        """Of each draw of values, what every effect that they bring adds on a part, whose `moments` these
        are with the first draw's values: the same terms in the same order. None if the machine cannot say.
        """

    def physical(self, one: Hypothesis, values: Mapping[str, float], recordings: Sequence[Any]) -> str:
        """What a cause comes to in quantities that a reader knows: a sentence, or nothing."""

    def use(
        self, values: Mapping[str, float], recordings: Sequence[Any], causes: Sequence[Hypothesis]
    ) -> Use:
        """How to simulate with what was found."""

    def corrected(
        self, name: str, recordings: Sequence[Any], conditions: Sequence[Mapping[str, float]]
    ) -> Written | None:
        """The recordings with the conditions that were found, as a campaign; None if it has none."""

    def command(self, verb: str, folder: Path, options: Sequence[str] = ()) -> str | None:
        """The command that does the same with the recordings of a folder; None if there is none."""

    @property
    def runs(self) -> str:
        """How its simulations run, in a sentence or two."""

    @property
    def file(self) -> str:
        """What `write` writes."""

    def write(self, folder: Path, values: Mapping[str, float], sources: Sources, name: str) -> str:
        """Write the machine with these values; the file's name is given back, empty if there is none."""

    def tables(self, values: Mapping[str, float]) -> Mapping[str, Tabled]:
        """By file, what else a user of the machine with these values wants; none if there is nothing."""
