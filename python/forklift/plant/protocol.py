"""What fitting, diagnosis and report may know of a machine: the whole of it.

A machine runs recordings at given values of its parameters, tells how they answer an unknown input at one of
its ports, and says in data what may be missing from it. A user's own `forklift.plant.parts.Plant` becomes one
through `forklift.plant.machine.NumpyMachine`; the forklift is `forklift.plant.forklift.model.Forklift`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.plant.parameter import Unknown
from forklift.plant.sensor_faults import ConditionOffset
from forklift.recordings.noise import Sensor

Kind = Literal["physics", "parameter", "sensor", "unknown"]


@dataclass(frozen=True, eq=False)
class Case:
    """One recording as a machine runs it, and its conditions: what it has of its own.

    Attributes
    ----------
    recording
        What was recorded.
    names
        (own,) its conditions: a load, an oil temperature, where a state starts.
    centre, width
        (own,) their most likely values and the standard deviations of their priors; width 0: known.
    least, most
        (own,) their bounds.
    prepared
        The machine's own form of the recording.
    """

    recording: Any
    names: tuple[str, ...]
    centre: Floats
    width: Floats
    least: Floats
    most: Floats
    prepared: Any = None

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Which conditions are unknown."""
        return np.flatnonzero(self.width)


class Run(NamedTuple):
    """How a machine answered one recording."""

    outputs: Floats
    """(times, outputs) in the machine's order."""
    slopes: Floats
    """(times, outputs, directions) along parameters, then along conditions; no directions if none asked."""


@dataclass(frozen=True)
class Steps:
    """How far each direction may be stepped by a machine that differentiates by difference quotients.

    Attributes
    ----------
    along
        (parameters,) in their units.
    own
        (recordings, conditions) in theirs.
    """

    along: Floats
    own: Floats


@dataclass(frozen=True)
class Addition:
    """What a hypothesis adds to a problem: data, so that it can be compared, stored and sent to a worker.

    Attributes
    ----------
    values
        Parameters that it brings, at which the machine is as it was: an effect at its null value.
    free
        What is estimated with it: some of these parameters, or numbers of a sensor.
    widened
        Conditions of every recording that it doubts, with the standard deviation of the doubt.
    """

    values: tuple[tuple[str, float], ...] = ()
    free: tuple[Unknown, ...] = ()
    widened: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Hypothesis:
    """One explanation, ready to be tried: data, so that it can be compared, stored and sent to a worker.

    Attributes
    ----------
    id
        One word, the same wherever the explanation acts.
    name
        In words.
    where
        The part of the machine or the channel it acts on; empty if on all.
    equation
        The equation of the model that it changes.
    amplitude
        The unknown that is zero where the hypothesis is absent; None for conditions.
    addition
        What it adds to a problem, at its null value: it leaves the model as it is.
    """

    id: str
    kind: Kind
    name: str
    where: str
    equation: str
    amplitude: str | None
    addition: Addition
    confused_with: tuple[str, ...] = ()
    needs_two_of: tuple[str, ...] = ()
    """Conditions of which there must be two values at least."""
    unlikely: bool = False
    """Whether it yields to what explains the same as well."""
    further: tuple[str, ...] = ()
    """More unknowns that are zero where it is absent, and act from there on like the amplitude: a curve's."""
    over: str = ""
    """Of a curve: its variable, in words."""
    law_of: str = ""
    """Of a curve: the id of the name whose law it is with a shape of its own, if it is of one."""
    also_in: tuple[str, ...] = ()
    """Further equations in which the same may be written, so that a curve there mends its law."""
    plausible: tuple[tuple[str, float, float], ...] = ()
    """Of its unknowns, between what they lie in any such part: name, least, most. Beyond it something else
    may act alike. (A part that fails may have any amplitude; but not if that has gone to its bound.)"""

    @property
    def amplitudes(self) -> tuple[str, ...]:
        """All unknowns that are zero where it is absent."""
        return () if self.amplitude is None else (self.amplitude, *self.further)

    @property
    def equations(self) -> tuple[str, ...]:
        """Every equation in which it may be written, first the one that is told."""
        return (self.equation, *self.also_in)

    @property
    def doubts(self) -> tuple[str, ...]:
        """The conditions that it takes for wrong: each recording's own, or all of them by one offset."""
        offsets = [one.condition for one in self.addition.free if isinstance(one, ConditionOffset)]
        return (*offsets, *(name for name, _ in self.addition.widened if self.amplitude is None))

    @property
    def label(self) -> str:
        """What tells it from all others."""
        return f"{self.where}.{self.id}" if self.where else self.id

    def __repr__(self) -> str:
        return f"Hypothesis({self.label!r})"


@dataclass(frozen=True)
class Place:
    """Where an unknown input may enter a machine's equations.

    Attributes
    ----------
    name
        Unique among all.
    part
        The part of the machine; empty where there is one.
    equation
        The equation it stands in, the field's word for it.
    unit
        Of the input.
    size
        A usual size, in the unit.
    """

    name: str
    part: str
    equation: str
    unit: str = "1"
    size: float = 1.0


class Responses(Protocol):
    """How a recording answers hats over time at some ports."""

    @property
    def directions(self) -> int:
        """Along how many a run was differentiated, or will be once all ports are asked."""

    def at(self, port: str) -> Floats:
        """(times, outputs, hats) at one of the ports, in its unit."""


class Machine(Protocol):
    """A machine behind the protocol."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def outputs(self) -> Sequence[str]:
        """The columns of a `Run`, in order."""

    @property
    def ends(self) -> Mapping[str, tuple[float, float]]:
        """By output, between which its sensor reads, where that is known."""

    @property
    def condition_units(self) -> Mapping[str, str]:
        """By condition, its unit."""

    @property
    def lag_share(self) -> float:
        """Over which share of a recording's samples residuals may be correlated."""

    def pieces(self, recording: Any) -> Sequence[Any]:
        """The stretches of a recording that are run each from its own start."""

    def case(self, recording: Any, sensors: Mapping[str, Sensor]) -> Case:
        """A recording with what is unknown about its conditions."""

    def measured(self, recording: Any) -> Mapping[str, Floats]:
        """By channel, (times,) with NaN where a sample is missing."""

    def instants(self, recording: Any) -> Mapping[str, NDArray[np.intp]]:
        """By channel on a clock of its own, at which of the recording's times it was sampled."""

    def check(self, values: Mapping[str, float]) -> None:
        """Nothing if the machine is possible at these values.

        Raises
        ------
        ForkliftError
            If it is not.
        """

    def run(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        *,
        substeps: int,
        along: Sequence[str] = (),
        own: Sequence[int] = (),
        steps: Callable[[], Steps] | None = None,
    ) -> list[Run]:
        """Every recording, at these values and conditions.

        Parameters
        ----------
        values
            Parameters that are not as the machine starts with them; an effect is present if its own are here.
        conditions
            By recording, (own,) in the order of `Case.names`.
        substeps
            How finely it is simulated.
        along, own
            Directions of the slopes: parameters by name, then conditions by their place. None: no slopes.
        steps
            Tells a machine without exact slopes how far each direction may be stepped.

        Raises
        ------
        ForkliftError
            If the machine is impossible at these values, or a run fails.
        """

    def respond(
        self,
        values: Mapping[str, float],
        case: Case,
        conditions: Floats,
        ports: Sequence[str],
        centres: Floats,
        width_s: float,
        *,
        substeps: int,
    ) -> Responses:
        """How a recording answers hats over time at some ports: tops at `centres` [s], `width_s` apart, where
        their neighbours end."""

    @property
    def places(self) -> tuple[Place, ...]:
        """Where an unknown input may enter, sensors apart. Of those that recordings cannot part what comes
        first is told, so that the most general comes first."""

    def part_of(self, name: str) -> str:
        """The part of a place, or of what a channel's sensor reads."""

    def hat_width_s(self, cases: Sequence[Case]) -> float:
        """Distance of an unknown input's hats over time [s]."""

    def moments(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        part: str,
        *,
        substeps: int,
    ) -> list[dict[str, Floats]]:
        """Of every recording its variables, each (times,): what something that acts on `part` may depend on.

        As the machine has them where it computes them, else as they were recorded.
        """

    @property
    def past(self) -> frozenset[str]:
        """Which of its variables are of the past: what others were, or have changed by."""

    def curves(self, place: Place, variable: str, lower: float, upper: float) -> tuple[Hypothesis, ...]:
        """Free curves over one variable at a place, from `lower` to `upper`; zero at their null values.

        Of several resolutions, the coarsest first, where the variable asks for it; none where it takes no
        curve.
        """

    def acted_on(self, hypothesis: Hypothesis) -> tuple[str, ...]:
        """The places where it enters; none if it is no physics."""

    def unnamed(self, place: Place, cases: Sequence[Case]) -> tuple[Hypothesis, ...]:
        """Further hypotheses without a name for a mismatch at a place: dynamics rather than a curve."""

    def ordered(self, values: Mapping[str, float], unknowns: Sequence[Unknown]) -> tuple[Floats, Floats]:
        """(orders, unknowns) rows and (orders,) what their product with θ must reach at least."""
