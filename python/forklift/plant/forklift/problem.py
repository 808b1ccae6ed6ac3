"""The recordings of a forklift as one least-squares problem, with the core's exact derivatives.

What a recording has of its own is the oil temperature's offset, where the lifts started, and the load's
offset if that is free. All else is as `forklift.fitting.problem` has it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.base.arrays import Floats
from forklift.fitting.observed import Observed as Observed
from forklift.fitting.problem import LeastSquares as LeastSquares
from forklift.fitting.problem import Linearised as Linearised
from forklift.fitting.problem import Products as Products
from forklift.fitting.sensor_faults import SensorUnknown
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.simulate import START_WITHIN_S, mean_temperature, simulate
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.unknowns import move, rising
from forklift.plant.parameter import Unknown
from forklift.recordings.channels import LIFTS, Lift
from forklift.recordings.clocks import driving

if TYPE_CHECKING:
    from forklift.fitting.interface import Problem as AnyProblem
    from forklift.plant.forklift.simulate import Simulation
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.noise import Sensor
    from forklift.recordings.recording import Recording


OWN = ("load", "oil_temperature", "oil_warming", "free.start", "main.start")
"""What a recording has of its own, in the core's order and by its names."""

TEMPERATURE_WIDTH_K = 0.15
"""Standard deviation of a recording's mean oil temperature: a sensor that reads in steps of 0.5 K."""

WARMING_WIDTH_K = 1.0
"""Standard deviation of how much the oil warms up during a recording: lowering heats it, and a sensor in the
tank lags by more than a recording lasts."""

USUAL_TICK_S = 0.02
"""Of the commands: the control unit's, to which a number of substeps refers [s]."""

START_WIDTH_M = 3e-4
"""Standard deviation of a cylinder's position at the start where no encoder tells it better."""


@dataclass(frozen=True)
class Sample:
    """One recording as the problem sees it."""

    recording: Recording
    case: _core.Case
    centre: Floats
    """(own,) of `OWN`: load [kg], offset of the oil temperature and how much it rises from start to end [K],
    cylinder positions at the start [m]."""
    width: Floats
    """(own,) prior standard deviations of the same; 0: known."""
    observed: tuple[Observed, ...]
    tick_s: float = USUAL_TICK_S
    """Step of the commands that drive the case [s]."""

    def substeps(self, usual: int) -> int:
        """Substeps of a tick, where the usual tick has so many: as long ones, whatever the command's rate."""
        return max(1, round(usual * self.tick_s / USUAL_TICK_S))

    @property
    def names(self) -> tuple[str, ...]:
        """What it has of its own."""
        return OWN

    @property
    def least(self) -> Floats:
        """(own,) lower bounds: no load is below zero."""
        return np.where(np.array(OWN) == "load", 0.0, -np.inf)

    @property
    def most(self) -> Floats:
        """(own,) upper bounds: none."""
        return np.full(len(self.centre), np.inf)

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Which of `OWN` are unknown."""
        return np.flatnonzero(self.width)


@dataclass
class Problem(LeastSquares):
    """Residuals and derivatives of a truck's recordings along the unknowns, at given weights."""

    truck: Truck
    unknowns: tuple[Unknown, ...]
    samples: tuple[Sample, ...]
    substeps: int
    sigma: Mapping[str, float] = field(default_factory=dict)

    def rising(self) -> tuple[Floats, Floats]:
        """The knots of tables stay in order."""
        return rising(self.truck, self.unknowns)

    def _simulate(self, x: Floats, *, derivatives: bool) -> list[tuple[Floats, Floats]]:
        """Outputs of every recording, and slopes along parameters, readings and what is its own."""
        moved, readings = self._split(x)
        truck = self.truck_at(x)
        names = [name for unknown, _ in moved for name in unknown.names]
        along = [*names, *(OWN[place] for place in self.carried)] if derivatives else []
        conditions = np.array([self.conditions(x, k) for k in range(len(self.samples))])
        runs: list[tuple[Floats, Floats]] = [(np.empty(0), np.empty(0))] * len(self.samples)
        for substeps in sorted({sample.substeps(self.substeps) for sample in self.samples}):
            some = [k for k, one in enumerate(self.samples) if one.substeps(self.substeps) == substeps]
            cases = [self.samples[k].case for k in some]
            found = truck.core.differentiate(cases, conditions[some], along, substeps=substeps)
            for k, run in zip(some, found, strict=True):
                runs[k] = run
        return [
            _read(sample.recording.time_s, run, readings, len(names) if derivatives else 0)
            for sample, run in zip(self.samples, runs, strict=True)
        ]

    def with_fixed(
        self, x: Floats, amplitudes: Collection[str], *, conditions: bool
    ) -> tuple[Problem, Floats]:
        """All of the truck held at x but the amplitudes, and unless `conditions` what recordings have of
        their own; and the same place. So much is cheaper to differentiate."""
        kept = [
            k
            for k, unknown in enumerate(self.unknowns)
            if unknown.name in amplitudes or isinstance(unknown, SensorUnknown)
        ]
        return self._holding(x, kept, conditions, truck=self.truck_at(x))

    def truck_at(self, x: Floats, source: str = "fit") -> Truck:
        """The truck at x; its moved values carry `source`.

        Raises
        ------
        ForkliftError
            As `forklift.plant.forklift.truck.Truck`, if it is impossible.
        """
        moved, _ = self._split(x)
        return move(self.truck, [unknown for unknown, _ in moved], np.array([at for _, at in moved]), source)

    def _split(self, x: Floats) -> tuple[list[tuple[Unknown, float]], list[tuple[SensorUnknown, float]]]:
        """The truck's unknowns and the sensors', each with its θ; the sensors' come last."""
        pairs = list(zip(self.unknowns, x.tolist(), strict=False))
        readings = [(unknown, at) for unknown, at in pairs if isinstance(unknown, SensorUnknown)]
        return pairs[: len(pairs) - len(readings)], readings


def _read(
    time: Floats, run: tuple[Floats, Floats], readings: Sequence[tuple[SensorUnknown, float]], own: int
) -> tuple[Floats, Floats]:
    """What the sensors read; the slopes along them stand before those from `own` on."""
    values, slopes = run
    if not readings:
        return run
    count = slopes.shape[2]
    for reading, at in readings:
        values, slopes = reading.read(time, values, slopes, at)
    return values, np.concatenate([slopes[..., :own], slopes[..., count:], slopes[..., own:count]], axis=2)


def truck_of(problem: AnyProblem, x: Floats, source: str = "fit") -> Truck:
    """The truck at x of a problem that came back from a search.

    Raises
    ------
    ForkliftError
        As `forklift.plant.forklift.truck.Truck`, if it is impossible.
    """
    assert isinstance(problem, Problem)
    return problem.truck_at(x, source)


def sample(
    recording: Recording,
    truck: Truck,
    sensors: Mapping[str, Sensor],
    *,
    load_width_kg: float = 0.0,
    warming_width_k: float = WARMING_WIDTH_K,
    oil_temperature_degc: float | None = None,
) -> Sample:
    """A recording with what is unknown about its conditions.

    The oil temperature is the mean of the recording's, the start what the first second's first sample tells.
    """
    clock, command = driving(*recording.commanded) if recording.rows else recording.commanded
    tick_s = float(np.median(np.diff(clock))) if len(clock) > 1 else USUAL_TICK_S
    temperature = np.full(len(clock), mean_temperature(recording, oil_temperature_degc))
    case = _core.Case(recording.time_s, clock, command, temperature)
    at_rest = simulate(
        truck,
        Command(clock, *command.T),
        time=recording.time_s[:1],
        load_kg=recording.load_kg,
        oil_temperature_degc=float(temperature[0]),
    )
    starts = [_start(recording, lift, at_rest, sensors) for lift in LIFTS]
    centre = np.array([recording.load_kg, 0.0, 0.0, *(start[0] for start in starts)])
    width = np.array([load_width_kg, TEMPERATURE_WIDTH_K, warming_width_k, *(start[1] for start in starts)])
    columns = {name: place for place, name in enumerate(outputs())}
    observed = []
    for channel, sensor in sensors.items():
        values = recording.channels.get(channel)
        if values is not None:
            rows = np.flatnonzero(np.isfinite(values))
            if len(rows):
                own = recording.rows.get(channel)
                observed.append(Observed(sensor, columns[channel], rows, values[rows], instants=own))
    return Sample(recording, case, centre, width, tuple(observed), tick_s)


def _start(
    recording: Recording, lift: Lift, at_rest: Simulation, sensors: Mapping[str, Sensor]
) -> tuple[float, float]:
    """Cylinder position at the start [m], and its standard deviation."""
    usual = float(at_rest[f"{lift}.position"][0])
    channel = f"position_{lift}_m"
    ratio = float(at_rest[channel][0]) / usual
    sensor = sensors.get(channel)
    values = recording.channels.get(channel)
    if sensor is None or values is None:
        return usual, START_WIDTH_M
    early = values[recording.time_s <= recording.time_s[0] + START_WITHIN_S]
    known = early[np.isfinite(early)]
    if not len(known):
        return usual, START_WIDTH_M
    ends = [
        float(at_rest.truck.values[f"{lift}.cylinder.stroke_{end}"])  # type: ignore[arg-type]
        for end in ("lower", "upper")
    ]
    told = (float(known[0]) + 0.5 * sensor.count) / ratio
    return min(max(told, ends[0]), ends[1]), sensor.noise / ratio
