"""A user's plant behind the machine protocol: runs in lanes of NumPy, slopes by difference quotients."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.calls import call
from forklift.plant.parameter import Unknown
from forklift.plant.parts import STEADY, Effect, Param, Plant, State, Values
from forklift.plant.present import Present
from forklift.plant.protocol import Addition, Case, Hypothesis, Place, Run, Steps
from forklift.plant.recording import Recording
from forklift.plant.run import run
from forklift.recordings.noise import Sensor

CORRELATED = 16
"""Residuals may be correlated over one in so many of a recording's samples."""
KNOTS = 7
"""Of a free curve."""
MOST = 10.0
"""Of what a curve may add, in the place's usual size."""
HATS = 60
"""Of an unknown input, over the longest recording."""
SAMPLES = 4
"""Fewest samples from one hat to the next."""
USUAL = 8
"""Substeps of the engine's stages that stand for the plant's own steps."""
_CURVE = re.compile(r"^(.+)\.over\.(.+)\.(knot_\d+|lower|upper)$")


@dataclass(frozen=True)
class Quotients:
    """Answers to hats over time, a run in lanes for each port: `forklift.plant.protocol.Responses`."""

    at: Callable[[str], Floats]
    directions: int


@dataclass(frozen=True)
class NumpyMachine:
    """A plant with the effects whose parameters are given.

    Attributes
    ----------
    plant
        The user's.
    """

    plant: Plant

    @property
    def name(self) -> str:
        """The plant's."""
        return self.plant.name

    @property
    def outputs(self) -> Sequence[str]:
        """As the plant lists them."""
        return [one.name for one in self.plant.outputs]

    def parameters(self, values: Mapping[str, float]) -> dict[str, float]:
        """All shared numbers by name: the plant's, and what these values change or add."""
        return {one.name: one.value for one in self.plant.params if one.per == "plant"} | dict(values)

    def present(self, values: Mapping[str, float]) -> Present:
        """The plant with the effects, and the free curves, that these values give parameters of."""
        found = [effect for effect in self.plant.effects if effect.amplitude in values]
        return Present(self.plant, (*found, *_curves(self.plant, values)))

    @property
    def ends(self) -> Mapping[str, tuple[float, float]]:
        """As the plant's outputs have them."""
        return {one.name: (one.lower, one.upper) for one in self.plant.outputs}

    @property
    def condition_units(self) -> Mapping[str, str]:
        """Of free starts, and of parameters that each recording has of its own."""
        starts = {f"{one.name}.start": one.unit for one in self.plant.states}
        return starts | {one.name: one.unit for one in self.plant.params if one.per == "recording"}

    @property
    def lag_share(self) -> float:
        """One in `CORRELATED`."""
        return 1.0 / CORRELATED

    def measured(self, recording: Recording) -> Mapping[str, Floats]:
        """By output."""
        return recording.y

    def instants(self, recording: Recording) -> Mapping[str, NDArray[np.intp]]:
        """Of outputs on clocks of their own."""
        return recording.rows

    def unknowns(self) -> tuple[Unknown, ...]:
        """The plant's parameters that are not known, and shared free starts."""
        moved = [one.unknown() for one in self.plant.params if not one.known and one.per == "plant"]
        moved += [
            free_start(one).unknown() for one in self.plant.states if one.start == "free" and one.shared
        ]
        return tuple(moved)

    def pieces(self, recording: Recording) -> list[Recording]:
        """A recording as it is, or from one restart to the next."""
        if self.plant.score != "restart":
            return [recording]
        time = recording.time_s - recording.time_s[0]
        begins = np.searchsorted(time, np.arange(0.0, time[-1], self.plant.horizon_s))
        edges = [0]
        for edge in map(int, begins[1:]):
            if edge - edges[-1] > 1:  # one sample is no piece: it ends with the one after
                edges.append(edge)
        if len(time) - edges[-1] < 2 and len(edges) > 1:  # or the last with the one before
            edges.pop()
        pairs = pairwise([*edges, len(time)])
        return [recording.between(a, b, f"{recording.file} from {time[a]:g} s") for a, b in pairs]

    def case(self, recording: Recording, sensors: Mapping[str, Sensor]) -> Case:
        """A recording with its free starts, and with parameters of its own.

        An output's first sample tells a start as well as its sensor's noise allows.
        """
        rows: list[tuple[str, float, float, float, float]] = []
        for state in self.plant.states:
            name = f"{state.name}.start"
            if state.start == "free":
                if not state.shared:
                    start = free_start(state)
                    rows.append((name, start.value, start.width, state.lower, state.upper))
            elif isinstance(state.start, str) and state.start != STEADY and state.start not in recording.u:
                seen = recording.y.get(state.start, np.full(1, np.nan))
                finite = seen[np.isfinite(seen)]
                if not len(finite):
                    raise ForkliftError(
                        "sample-missing",
                        f"recording {recording.file} starts at output {state.start}, which has no "
                        "sample there",
                        channel=state.start,
                    )
                rows.append((name, float(finite[0]), sensors[state.start].noise, -inf, inf))
        rows += [
            (one.name, one.value, one.width, one.lower, one.upper)
            for one in self.plant.params
            if one.per == "recording"
        ]
        names = tuple(row[0] for row in rows)
        centre, width, least, most = (np.array([row[k] for row in rows], dtype=float) for k in range(1, 5))
        return Case(recording, names, centre, width, least, most)

    def check(self, values: Mapping[str, float]) -> None:
        """Bounds are all there is."""

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
        """Recordings as lanes side by side, and of each a lane for every direction."""
        finer = max(1, substeps // USUAL)
        moves = steps() if steps and (along or own) else None
        return [
            found
            for which in self._together(values, cases)
            for found, _ in self._lanes(values, cases, conditions, which, along, own, moves, finer)
        ]

    def moments(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        part: str = "",
        *,
        substeps: int,
    ) -> list[dict[str, Floats]]:
        """Of every recording each state, input and quantity of the bus, (times,)."""
        finer = max(1, substeps // USUAL)
        return [
            seen
            for which in self._together(values, cases)
            for _, seen in self._lanes(values, cases, conditions, which, (), (), None, finer)
        ]

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
    ) -> Quotients:
        """By difference quotients, port by port as they are asked; see `forklift.plant.protocol.Machine`."""
        return Quotients(
            lambda port: self._respond(values, case, conditions, port, centres, width_s),
            len(ports) * len(centres),
        )

    def _respond(
        self,
        values: Mapping[str, float],
        case: Case,
        conditions: Floats,
        port: str,
        centres: Floats,
        width_s: float,
    ) -> Floats:
        """(times, outputs, hats)."""
        sizes = {one.name: one.size for one in self.plant.ports}
        driven = case.recording.u
        size = 1e-3 * sizes.get(port, float(np.ptp(driven[port])) or 1.0 if port in driven else 1.0)
        p = self.parameters(values) | dict(zip(case.names, conditions.tolist(), strict=True))
        lanes = 1 + len(centres)
        heights = np.concatenate([[0.0], np.full(len(centres), size)])
        middles = np.concatenate([[0.0], centres])

        def push(t: Floats) -> dict[str, Floats]:
            return {port: heights * np.maximum(0.0, 1.0 - np.abs(t - middles) / width_s)}

        wide = {name: np.full(lanes, float(value)) for name, value in p.items()}
        present = self.present(values)
        time, u = self._driven([case], lanes, wide)
        said, _ = run(present, time, u, self._begins(present, wide, [case], lanes), wide, push)
        return np.stack([(said[one][:, 1:] - said[one][:, :1]) / size for one in self.outputs], axis=1)

    @property
    def places(self) -> tuple[Place, ...]:
        """Ports, and inputs."""
        ports = [Place(one.name, "", one.kind, one.unit, one.size) for one in self.plant.ports]
        inputs = [Place(one.name, "", "input", one.unit) for one in self.plant.inputs]
        return (*ports, *inputs)

    def part_of(self, name: str) -> str:
        """There is one."""
        return ""

    def hat_width_s(self, cases: Sequence[Case]) -> float:
        """`HATS` over the longest recording, and no fewer than `SAMPLES` samples from one to the next."""
        longest = max(float(np.ptp(one.recording.time_s)) for one in cases)
        usual = max(float(np.median(np.diff(one.recording.time_s))) for one in cases)
        return max(longest / HATS, SAMPLES * usual)

    @property
    def past(self) -> frozenset[str]:
        """None."""
        return frozenset()

    def curves(self, place: Place, variable: str, lower: float, upper: float) -> tuple[Hypothesis, ...]:
        """Σ kₙ hat((v − vₙ)/(v₁ − v₀)) over evenly spaced knots vₙ, constant beyond them."""
        if place.name not in {port.name for port in self.plant.ports}:
            return ()
        head, most = f"{place.name}.over.{variable}", MOST * place.size
        knots = [Param(f"{head}.knot_{k}", place.unit, 0.0, -most, most) for k in range(KNOTS)]
        ends = ((f"{head}.lower", lower), (f"{head}.upper", upper))
        one = Hypothesis(
            "unknown",
            "unknown",
            f"something acts on the {place.name} as a function of {variable}",
            place.name,
            place.equation,
            knots[0].name,
            Addition(
                (*((one.name, one.value) for one in knots), *ends), tuple(one.unknown() for one in knots)
            ),
            further=tuple(one.name for one in knots[1:]),
            over=variable,
        )
        return (one,)

    def acted_on(self, hypothesis: Hypothesis) -> tuple[str, ...]:
        """The effect's ports, or the curve's."""
        if hypothesis.kind == "unknown":
            return (hypothesis.where,)
        return next((one.ports for one in self.plant.effects if one.id == hypothesis.id), ())

    def unnamed(self, place: Place, cases: Sequence[Case]) -> tuple[Hypothesis, ...]:
        """None."""
        return ()

    def ordered(self, values: Mapping[str, float], unknowns: Sequence[Unknown]) -> tuple[Floats, Floats]:
        """Nothing is ordered."""
        return np.zeros((0, len(unknowns))), np.zeros(0)

    def _together(self, values: Mapping[str, float], cases: Sequence[Case]) -> list[list[int]]:
        """Which recordings run side by side: all, or of a plant without states each alone."""
        places = list(range(len(cases)))
        return [places] if self.present(values).states else [[k] for k in places]

    def _lanes(
        self,
        values: Mapping[str, float],
        cases: Sequence[Case],
        conditions: Sequence[Floats],
        which: Sequence[int],
        along: Sequence[str],
        own: Sequence[int],
        steps: Steps | None,
        finer: int,
    ) -> list[tuple[Run, dict[str, Floats]]]:
        """Of each recording a lane at these values, and one along every direction."""
        chosen = [cases[k] for k in which]
        directions = len(along) + len(own) if steps else 0
        lanes = 1 + directions
        moved = np.ones((len(which), directions))
        base = self.parameters(values)
        columns = {name: np.full((len(which), lanes), value) for name, value in base.items()}
        if steps:
            for j, name in enumerate(along):
                columns[name][:, 1 + j] = base[name] + steps.along[j]
                moved[:, j] = steps.along[j]
        for row, k in enumerate(which):
            for i, name in enumerate(cases[k].names):
                column = columns.setdefault(name, np.zeros((len(which), lanes)))
                column[row] = conditions[k][i]
            if steps:
                for j, i in enumerate(own):
                    if step := steps.own[k, j]:
                        columns[cases[k].names[i]][row, 1 + len(along) + j] += step
                        moved[row, len(along) + j] = step
        p = {name: column.ravel() for name, column in columns.items()}
        present = self.present(values)
        time, u = self._driven(chosen, lanes, p)
        said, seen = run(present, time, u, self._begins(present, p, chosen, lanes), p, finer=finer)
        found = []
        for row, case in enumerate(chosen):
            place, length = slice(row * lanes, (row + 1) * lanes), len(case.recording)
            read = [said[name][:length, place] for name in self.outputs]
            outputs = np.stack([one[:, 0] for one in read], axis=1)
            slopes = (
                np.stack([(one[:, 1:] - one[:, :1]) / moved[row] for one in read], axis=1)
                if directions
                else np.zeros((*outputs.shape, 0))
            )
            moments = {name: column[:length, place.start] for name, column in seen.items()}
            found.append((Run(outputs, slopes), moments))
        return found

    def _begins(
        self, present: Present, p: Mapping[str, Floats], cases: Sequence[Case], lanes: int
    ) -> dict[str, Floats]:
        """Where states start in every lane: estimated, at an input's first sample, or at a number.

        Those that start steady are left to the run.
        """
        start = {}
        for state in present.states:
            if f"{state.name}.start" in p:
                start[state.name] = p[f"{state.name}.start"]
            elif state.start == "free":  # shared by all recordings, and not estimated
                start[state.name] = np.full(len(cases) * lanes, free_start(state).value)
            elif isinstance(state.start, str) and state.start != STEADY:
                first = [float(case.recording.u[state.start][0]) for case in cases]
                start[state.name] = np.repeat(first, lanes)
            elif not isinstance(state.start, str):
                start[state.name] = np.full(len(cases) * lanes, state.start)
        return start

    def _driven(
        self, cases: Sequence[Case], lanes: int, p: Mapping[str, Floats]
    ) -> tuple[Floats, dict[str, Floats]]:
        """Times and inputs of the recordings (times, lanes), each recording's last sample held on."""
        recordings = [case.recording for case in cases]
        longest = max(map(len, recordings))

        def wide(columns: Sequence[Floats]) -> Floats:
            padded = [np.concatenate([c, np.full(longest - len(c), c[-1])]) for c in columns]
            return np.repeat(np.array(padded).T, lanes, axis=1)

        u = {}
        for one in self.plant.inputs:
            values = wide([found.u[one.name] for found in recordings])
            if f"{one.name}.gain" in p:
                values = values * p[f"{one.name}.gain"]
            if f"{one.name}.offset" in p:
                values = values + p[f"{one.name}.offset"]
            u[one.name] = values
        return wide([found.time_s for found in recordings]), u


def _curves(plant: Plant, values: Mapping[str, float]) -> list[Effect]:
    """The free curves that these values describe, as effects."""
    heads: dict[tuple[str, str], dict[str, float]] = {}
    for name, value in values.items():
        if match := _CURVE.match(name):
            heads.setdefault((match[1], match[2]), {})[match[3]] = value
    return [_as_effect(port, variable, given) for (port, variable), given in heads.items()]


def _as_effect(port: str, variable: str, given: Mapping[str, float]) -> Effect:
    names = sorted((name for name in given if name.startswith("knot_")), key=lambda name: int(name[5:]))
    at = np.linspace(given["lower"], given["upper"], len(names))

    def term(x: Values, u: Values, p: Values, bus: Values) -> Mapping[str, Floats]:
        value = np.clip({**x, **u, **bus}[variable], at[0], at[-1])
        gap = at[1] - at[0]
        return {
            port: sum(
                p[name] * np.maximum(0.0, 1.0 - np.abs(value - knot) / gap)
                for name, knot in zip(names, at, strict=True)
            )
        }

    return Effect(
        f"{port}.over.{variable}",
        f"something acts on the {port} as a function of {variable}",
        tuple(Param(name, "1", 0.0) for name in names),
        (port,),
        term,
    )


def completed(plant: Plant, recording: Recording) -> Recording:
    """The recording with the inputs that are derived from others, in the plant's order.

    Raises
    ------
    ForkliftError
        ``"channel-unknown"`` for an input that it lacks, ``"recording-invalid"``; ``"plant-invalid"`` for a
        mistake in the plant.
    """
    u = dict(recording.u)
    for one in plant.inputs:
        if one.derived and one.name not in u:
            what = f"derived input {one.name}"
            u[one.name] = call(plant.name, what, one.derived, recording.time_s, u)
        elif one.name not in u:
            raise ForkliftError(
                "channel-unknown", f"recording {recording.file} has no input {one.name}", channel=one.name
            )
    return replace(recording, u=u)


def free_start(state: State) -> Param:
    """The free start of a state as a parameter."""
    guess = 0.5 * (state.lower + state.upper) if state.guess is None else state.guess
    return Param(f"{state.name}.start", state.unit, guess, state.lower, state.upper, spread=state.spread)
