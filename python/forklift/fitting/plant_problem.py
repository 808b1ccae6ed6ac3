"""Recordings of a plant as a least-squares problem; derivatives by difference quotients, as lanes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.fitting.observed import Observed
from forklift.fitting.problem import LeastSquares
from forklift.plant.parameter import Unknown
from forklift.plant.parts import STEADY, Param, Plant, State
from forklift.plant.recording import Recording
from forklift.plant.run import Machine, run
from forklift.recordings.noise import Sensor, encoder_count, white_noise

STEP = 1e-4
"""Of the difference quotients, in standard deviations of a prior."""
LEAST_NOISE = 1e-6
"""No sensor is taken to be better than this share of its range."""
USUAL = 8
"""Substeps of the engine's stages that stand for the plant's own steps."""
CORRELATED = 16
"""Residuals may be correlated over one in so many of a recording's samples."""


@dataclass(frozen=True, eq=False)
class PlantSample:
    """One recording as the problem sees it: its free starts, and its own parameters."""

    recording: Recording
    names: tuple[str, ...]
    """Of its own: states, and parameters."""
    centre: Floats
    width: Floats
    least: Floats
    most: Floats
    observed: tuple[Observed, ...]

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Which of its own are unknown."""
        return np.flatnonzero(self.width)


@dataclass
class PlantProblem(LeastSquares):
    """Residuals and derivatives of a plant's recordings along the unknowns, at given weights."""

    machine: Machine
    unknowns: tuple[Unknown, ...]
    samples: tuple[PlantSample, ...]
    values_at: Mapping[str, float]
    """Of every parameter, whether it is among the unknowns or not; quiet faults of sensors and inputs."""
    substeps: int = 1
    sigma: Mapping[str, float] = field(default_factory=dict)
    lags: int = 25

    def with_effect(
        self, machine: Machine, values: Mapping[str, float], more: Sequence[Unknown]
    ) -> PlantProblem:
        """The problem of another machine, with further unknowns."""
        return replace(
            self,
            machine=machine,
            unknowns=(*self.unknowns, *more),
            values_at={**self.values_at, **values},
        )

    def with_fixed(
        self, x: Floats, amplitudes: Collection[str], *, conditions: bool
    ) -> tuple[PlantProblem, Floats]:
        """All parameters held at x but the amplitudes, and unless `conditions` what recordings have of
        their own; and the same place. So much is cheaper to differentiate."""
        kept = [k for k, unknown in enumerate(self.unknowns) if unknown.name in amplitudes]
        return self._holding(x, kept, conditions, values_at=self.parameters(x))

    def parameters(self, x: Floats) -> dict[str, float]:
        """All shared numbers at x, by name."""
        found = dict(self.values_at)
        for unknown, at in zip(self.unknowns, x, strict=False):
            found[unknown.name] = float(unknown.values(float(at))[0])
        return found

    def _simulate(self, x: Floats, *, derivatives: bool) -> list[tuple[Floats, Floats]]:
        return [found[:2] for found in self.simulated(x, derivatives=derivatives)]

    def simulated(
        self, x: Floats, *, derivatives: bool = False
    ) -> list[tuple[Floats, Floats, dict[str, Floats]]]:
        """Of every recording the outputs (times, outputs), their slopes, and every moment's variables."""
        if not self.machine.states:
            return [self._lanes(x, [k], derivatives)[0] for k in range(len(self.samples))]
        return self._lanes(x, list(range(len(self.samples))), derivatives)

    def _lanes(
        self, x: Floats, which: Sequence[int], derivatives: bool
    ) -> list[tuple[Floats, Floats, dict[str, Floats]]]:
        """Recordings side by side; of each a lane at x and, for derivatives, one along every direction."""
        shared = len(self.unknowns)
        lane = {int(i): shared + j for j, i in enumerate(self.carried)}
        directions = shared + len(lane) if derivatives else 0
        lanes = 1 + directions
        moved = np.ones((len(which), directions))
        base = self.parameters(x)
        columns = {name: np.full((len(which), lanes), value) for name, value in base.items()}
        upper = self.bounds()[1]
        if derivatives:
            for j, unknown in enumerate(self.unknowns):
                step = STEP if x[j] + STEP <= upper[j] else -STEP
                there = float(unknown.values(float(x[j] + step))[0])
                columns[unknown.name][:, 1 + j] = there
                moved[:, j] = there - base[unknown.name]
        for row, k in enumerate(which):
            sample = self.samples[k]
            here = self.conditions(x, k)
            for i, name in enumerate(sample.names):
                column = columns.setdefault(name, np.zeros((len(which), lanes)))
                column[row] = here[i]
                if derivatives and sample.width[i]:
                    step = STEP * sample.width[i]
                    step = -step if here[i] + step > sample.most[i] else step
                    column[row, 1 + lane[i]] += step
                    moved[row, lane[i]] = step
        p = {name: column.ravel() for name, column in columns.items()}
        start = self._begins(p, which, lanes)
        time, u = self._driven(which, lanes, p)
        said, seen = run(self.machine, time, u, start, p, finer=max(1, self.substeps // USUAL))
        return [self._one(k, row, lanes, time, said, seen, p, moved[row]) for row, k in enumerate(which)]

    def _begins(self, p: Mapping[str, Floats], which: Sequence[int], lanes: int) -> dict[str, Floats]:
        """Where states start in every lane: estimated, at an input's first sample, or at a number.

        Those that start steady are left to the run.
        """
        start = {}
        for state in self.machine.states:
            if f"{state.name}.start" in p:
                start[state.name] = p[f"{state.name}.start"]
            elif isinstance(state.start, str) and state.start != STEADY:
                first = [float(self.samples[k].recording.u[state.start][0]) for k in which]
                start[state.name] = np.repeat(first, lanes)
            elif not isinstance(state.start, str):
                start[state.name] = np.full(len(which) * lanes, state.start)
        return start

    def _driven(
        self, which: Sequence[int], lanes: int, p: Mapping[str, Floats]
    ) -> tuple[Floats, dict[str, Floats]]:
        """Times and inputs of the recordings (times, lanes), each recording's last sample held on."""
        recordings = [self.samples[k].recording for k in which]
        longest = max(map(len, recordings))

        def wide(columns: Sequence[Floats]) -> Floats:
            padded = [np.concatenate([c, np.full(longest - len(c), c[-1])]) for c in columns]
            return np.repeat(np.array(padded).T, lanes, axis=1)

        u = {}
        for one in self.machine.plant.inputs:
            values = wide([found.u[one.name] for found in recordings])
            if f"{one.name}.gain" in p:
                values = values * p[f"{one.name}.gain"]
            if f"{one.name}.offset" in p:
                values = values + p[f"{one.name}.offset"]
            u[one.name] = values
        return wide([found.time_s for found in recordings]), u

    def _one(
        self,
        k: int,
        row: int,
        lanes: int,
        time: Floats,
        said: Mapping[str, Floats],
        seen: Mapping[str, Floats],
        p: Mapping[str, Floats],
        moved: Floats,
    ) -> tuple[Floats, Floats, dict[str, Floats]]:
        place = slice(row * lanes, (row + 1) * lanes)
        length = len(self.samples[k].recording)
        own = {name: column[place] for name, column in p.items()}
        read = [
            _read(one.name, time[:length, row * lanes], said[one.name][:length, place], own)
            for one in self.machine.plant.outputs
        ]
        values = np.stack([one[:, 0] for one in read], axis=1)
        slopes = (
            np.stack([(one[:, 1:] - one[:, :1]) / moved for one in read], axis=1)
            if lanes > 1
            else (np.zeros((*values.shape, 0)))
        )
        return values, slopes, {name: column[:length, place.start] for name, column in seen.items()}

    def respond(self, x: Floats, k: int, port: str, centres: Floats, width_s: float) -> Floats:
        """(times, outputs, hats): how recording k answers hats over time at a port or an input."""
        sizes = {one.name: one.size for one in self.machine.plant.ports}
        recording = self.samples[k].recording
        size = 1e-3 * sizes.get(port, float(np.ptp(recording.u[port])) or 1.0 if port in recording.u else 1.0)
        p: dict[str, Floats | float] = dict(self.parameters(x))
        sample = self.samples[k]
        p |= dict(zip(sample.names, self.conditions(x, k).tolist(), strict=True))
        lanes = 1 + len(centres)
        heights = np.concatenate([[0.0], np.full(len(centres), size)])
        middles = np.concatenate([[0.0], centres])

        def push(t: Floats) -> dict[str, Floats]:
            return {port: heights * np.maximum(0.0, 1.0 - np.abs(t - middles) / width_s)}

        wide = {name: np.full(lanes, float(value)) for name, value in p.items()}
        time, u = self._driven([k], lanes, wide)
        said, _ = run(self.machine, time, u, self._begins(wide, [k], lanes), wide, push)
        read = [_read(one.name, time[:, 0], said[one.name], wide) for one in self.machine.plant.outputs]
        return np.stack([(one[:, 1:] - one[:, :1]) / size for one in read], axis=1)


def _read(name: str, time: Floats, values: Floats, p: Mapping[str, Floats]) -> Floats:
    """What a sensor reads of (times, lanes): late, with a gain and an offset."""
    lag = p.get(f"{name}.lag")
    if lag is not None and np.any(lag):
        values = np.stack(
            [np.interp(time - one, time, column) for one, column in zip(lag, values.T, strict=True)], axis=1
        )
    if f"{name}.gain" in p:
        values = values * p[f"{name}.gain"]
    return values + p[f"{name}.offset"] if f"{name}.offset" in p else values


def sensors(plant: Plant, recordings: Sequence[Recording]) -> dict[str, Sensor]:
    """Each output's noise and count: as given, or told from its samples.

    From the samples' sixth differences (`forklift.recordings.noise.white_noise`), stretches at an end of
    the range and gaps left out; never less than a millionth of the output's range.

    Raises
    ------
    ForkliftError
        ``"channel-unknown"`` for an output that no recording has.
    """
    found = {}
    for one in plant.outputs:
        columns = [recording.y[one.name] for recording in recordings if one.name in recording.y]
        inside = [np.where((c > one.lower) & (c < one.upper), c, np.nan) for c in columns]
        finite = np.concatenate([c[np.isfinite(c)] for c in inside]) if inside else np.zeros(0)
        if not len(finite):
            raise ForkliftError(
                "channel-unknown", f"plant {plant.name}: no recording has output {one.name}", channel=one.name
            )
        if one.sigma is not None:
            found[one.name] = Sensor(one.name, one.sigma, one.count)
            continue
        count = one.count or encoder_count(inside)
        noise = max(white_noise(inside), LEAST_NOISE * float(np.ptp(finite)), 1e-300)
        if count and noise < count:
            found[one.name] = Sensor(one.name, count / sqrt(12.0), count)
        else:
            found[one.name] = Sensor(one.name, noise, 0.0)
    return found


def completed(plant: Plant, recording: Recording) -> Recording:
    """The recording with the inputs that are derived from others, in the plant's order.

    Raises
    ------
    ForkliftError
        ``"channel-unknown"`` for an input that it lacks, ``"recording-invalid"``.
    """
    u = dict(recording.u)
    for one in plant.inputs:
        if one.derived and one.name not in u:
            u[one.name] = one.derived(recording.time_s, u)
        elif one.name not in u:
            raise ForkliftError(
                "channel-unknown", f"recording {recording.file} has no input {one.name}", channel=one.name
            )
    return replace(recording, u=u)


def pose(plant: Plant, recordings: Sequence[Recording], known: Mapping[str, Sensor]) -> PlantProblem:
    """The plant's problem over recordings, without any effect, at its parameters' values."""
    each = [piece for recording in recordings for piece in pieces(plant, recording)]
    samples = tuple(_sample(plant, piece, known) for piece in each)
    moved = [one.unknown() for one in plant.params if not one.known and one.per == "plant"]
    moved += [_start(state).unknown() for state in plant.states if state.start == "free" and state.shared]
    values = {one.name: one.value for one in plant.params if one.per == "plant"}
    shortest = min(len(piece) for piece in each)
    return PlantProblem(Machine(plant), tuple(moved), samples, values, lags=max(25, shortest // CORRELATED))


def pieces(plant: Plant, recording: Recording) -> list[Recording]:
    """A recording as it is, or from one restart to the next."""
    if plant.score != "restart":
        return [recording]
    time = recording.time_s - recording.time_s[0]
    edges = np.searchsorted(time, np.arange(0.0, time[-1] + plant.horizon_s, plant.horizon_s))
    pairs = [(int(a), int(b)) for a, b in pairwise(edges) if b - a > 1]
    return [recording.between(a, b, f"{recording.file} from {time[a]:g} s") for a, b in pairs]


def _start(state: State) -> Param:
    """The free start of a state as a parameter."""
    guess = 0.5 * (state.lower + state.upper) if state.guess is None else state.guess
    return Param(f"{state.name}.start", state.unit, guess, state.lower, state.upper, spread=state.spread)


def _sample(plant: Plant, recording: Recording, known: Mapping[str, Sensor]) -> PlantSample:
    rows: list[tuple[str, float, float, float, float]] = []
    for state in plant.states:
        name = f"{state.name}.start"
        if state.start == "free":
            if not state.shared:
                start = _start(state)
                rows.append((name, start.value, start.width, state.lower, state.upper))
        elif isinstance(state.start, str) and state.start != STEADY and state.start not in recording.u:
            seen = recording.y.get(state.start, np.full(1, np.nan))
            finite = seen[np.isfinite(seen)]
            if not len(finite):
                raise ForkliftError(
                    "sample-missing",
                    f"recording {recording.file} starts at output {state.start}, which has no sample there",
                    channel=state.start,
                )
            rows.append((name, float(finite[0]), known[state.start].noise, -inf, inf))
    rows += [
        (one.name, one.value, one.width, one.lower, one.upper)
        for one in plant.params
        if one.per == "recording"
    ]
    observed = []
    for column, one in enumerate(plant.outputs):
        values = recording.y.get(one.name)
        if values is not None and np.isfinite(values).any():
            at = np.flatnonzero(np.isfinite(values))
            observed.append(Observed(known[one.name], column, at, values[at], (one.lower, one.upper)))
    names = tuple(row[0] for row in rows)
    centre, width, least, most = (np.array([row[k] for row in rows], dtype=float) for k in range(1, 5))
    return PlantSample(recording, names, centre, width, least, most, tuple(observed))
