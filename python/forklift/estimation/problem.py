"""All recordings of a fit as one least-squares problem, with exact derivatives.

The unknown vector is (θ, φ₁, …, φ_K): the shared unknowns in units of their priors, and of each recording
its own: the oil temperature's offset, where the lifts started, and the load's offset if that is free.
Residuals are those of `forklift.estimation.likelihood`, so that half their sum of squares is −ln posterior.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from os import cpu_count
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, qr

from forklift import _core
from forklift.commands import Command
from forklift.estimation import likelihood
from forklift.estimation.algebra import one_thread
from forklift.estimation.readings import Reading
from forklift.estimation.unknowns import DEGREES, Unknown, move
from forklift.names import LIFTS, Lift, outputs
from forklift.simulate import START_WITHIN_S, mean_temperature, simulate

if TYPE_CHECKING:
    from forklift.estimation.sensors import Sensor
    from forklift.recording import Recording
    from forklift.simulate import Simulation
    from forklift.truck import Truck

Floats = NDArray[np.float64]
T = TypeVar("T")

OWN = ("load", "oil_temperature", "oil_warming", "free.start", "main.start")
"""What a recording has of its own, in the core's order and by its names."""

TEMPERATURE_WIDTH_K = 0.15
"""Standard deviation of a recording's mean oil temperature: a sensor that reads in steps of 0.5 K."""

WARMING_WIDTH_K = 1.0
"""Standard deviation of how much the oil warms up during a recording: lowering heats it, and a sensor in the
tank lags by more than a recording lasts."""

START_WIDTH_M = 3e-4
"""Standard deviation of a cylinder's position at the start where no encoder tells it better."""


@dataclass(frozen=True)
class Observed:
    """The finite samples of one channel in one recording."""

    sensor: Sensor
    column: int
    """Its place among the model's outputs."""
    rows: NDArray[np.intp]
    values: Floats


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

    def conditions(self, phi: Floats) -> Floats:
        """(own,) the recording's own values at φ, in prior standard deviations."""
        own = self.centre.copy()
        own[self.free] += self.width[self.free] * phi
        return own

    @property
    def free(self) -> NDArray[np.intp]:
        """Which of `OWN` are unknown."""
        return np.flatnonzero(self.width)


@dataclass(frozen=True)
class Linearised:
    """A recording's residuals and their derivatives at one point, channel by channel."""

    residual: Mapping[str, Floats]
    jacobian: Mapping[str, Floats]
    """(samples, θ and φ of this recording)."""
    model: Mapping[str, Floats]
    """What the model says, in the channel's unit."""
    slope: Mapping[str, Floats]
    """Its derivatives along the same."""


@dataclass(frozen=True)
class Products:
    """A recording linearised, and its share of the normal equations."""

    at: Linearised
    normal: Floats
    """JᵀJ over θ and the recording's φ."""
    gradient: Floats
    """Jᵀr."""
    square: float
    """rᵀr."""


@dataclass
class Problem:
    """Residuals and derivatives of recordings along the unknowns, at a given weight of each channel."""

    truck: Truck
    unknowns: tuple[Unknown, ...]
    samples: tuple[Sample, ...]
    substeps: int
    sigma: Mapping[str, float] = field(default_factory=dict)
    """Standard deviation each channel is weighted by, in its unit; of an encoder the softness."""

    @property
    def starts(self) -> list[int]:
        """Where each recording's φ begins in the unknown vector; last, its length."""
        lengths = [len(self.unknowns), *(len(sample.free) for sample in self.samples)]
        return [int(end) for end in np.cumsum(lengths)]

    def bounds(self) -> tuple[Floats, Floats]:
        """Least and greatest of the unknown vector: no load is below zero."""
        own = self.starts[-1] - len(self.unknowns)
        lower = [unknown.lower for unknown in self.unknowns]
        for sample in self.samples:
            least = np.where(np.array(OWN) == "load", 0.0, -np.inf)[sample.free]
            lower += [*((least - sample.centre[sample.free]) / sample.width[sample.free])]
        upper = [*(unknown.upper for unknown in self.unknowns), *[np.inf] * own]
        return np.array(lower), np.array(upper)

    def own(self, x: Floats, k: int) -> Floats:
        """φ of recording k."""
        return x[self.starts[k] : self.starts[k + 1]]

    def place(self, k: int) -> NDArray[np.intp]:
        """Where θ and the φ of recording k stand in the unknown vector."""
        own = np.arange(self.starts[k], self.starts[k + 1])
        return np.concatenate([np.arange(len(self.unknowns)), own])

    def linearise(self, x: Floats) -> list[Linearised]:
        """Every recording simulated and differentiated at x.

        Raises
        ------
        ForkliftError
            If the truck at x is impossible or a run fails.
        """
        return list(self._each(x, self._linearise))

    def products(self, x: Floats) -> list[Products]:
        """Every recording linearised at x, with its share of the normal equations.

        Raises
        ------
        ForkliftError
            As `linearise`.
        """
        return list(self._each(x, self._products))

    def residuals(self, x: Floats) -> list[dict[str, Floats]]:
        """Every recording's residuals at x, channel by channel; several times faster than `linearise`.

        Raises
        ------
        ForkliftError
            As `linearise`.
        """
        return [
            {seen.sensor.channel: self.misfit(seen, said[seen.sensor.channel])[0] for seen in sample.observed}
            for sample, said in zip(self.samples, self.values(x), strict=True)
        ]

    def values(self, x: Floats) -> list[dict[str, Floats]]:
        """What the model says at x of every recording, channel by channel, each in its unit.

        Raises
        ------
        ForkliftError
            As `linearise`.
        """
        runs = self._simulate(x, derivatives=False)
        return [
            {seen.sensor.channel: values[seen.rows, seen.column] for seen in sample.observed}
            for sample, (values, _) in zip(self.samples, runs, strict=True)
        ]

    def prior(self, x: Floats) -> tuple[Floats, Floats]:
        """Residual of each unknown against its prior, and its derivative along that unknown."""
        shared = len(self.unknowns)
        rho, slope = likelihood.student(x[:shared], DEGREES)
        return np.concatenate([rho, x[shared:]]), np.concatenate([slope, np.ones(len(x) - shared)])

    def compressed(self, x: Floats) -> tuple[Floats, Floats]:
        """Residual (m,) and Jacobian (m, unknowns) with the same sums of squares and products, m small.

        Each recording's rows are replaced by the triangle of their QR decomposition.
        """
        shared, total = len(self.unknowns), self.starts[-1]
        triangles = list(self._each(x, self._triangle))
        rho, slope = self.prior(x)
        residual, jacobian = [rho], [np.diag(slope)]
        for k, triangle in enumerate(triangles):
            place = slice(self.starts[k], self.starts[k + 1])
            rows = np.zeros((len(triangle), total))
            rows[:, :shared] = triangle[:, :shared]
            rows[:, place] = triangle[:, shared:-1]
            jacobian.append(rows)
            residual.append(triangle[:, -1])
        return np.concatenate(residual), np.vstack(jacobian)

    def _each(self, x: Floats, use: Callable[[Sample, Floats, Floats, Floats], T]) -> Iterator[T]:
        theta = x[: len(self.unknowns)]
        columns = [unknown.slopes(at)[:, None] for unknown, at in zip(self.unknowns, theta, strict=True)]
        chain = block_diag(np.zeros((0, 0)), *columns)
        runs = self._simulate(x, derivatives=True)
        with one_thread(), ThreadPoolExecutor(cpu_count()) as pool:
            yield from pool.map(lambda sample, run: use(sample, run[0], run[1], chain), self.samples, runs)

    def _simulate(self, x: Floats, *, derivatives: bool) -> list[tuple[Floats, Floats]]:
        """Outputs of every recording, and slopes along parameters, readings and what is its own."""
        moved, readings = self._split(x)
        truck = self.truck_at(x)
        names = [name for unknown, _ in moved for name in unknown.names]
        runs = truck.core.differentiate(
            [sample.case for sample in self.samples],
            np.array([sample.conditions(self.own(x, k)) for k, sample in enumerate(self.samples)]),
            [*names, *OWN] if derivatives else [],
            substeps=self.substeps,
        )
        return [
            _read(sample.recording.time_s, run, readings, len(names) if derivatives else 0)
            for sample, run in zip(self.samples, runs, strict=True)
        ]

    def truck_at(self, x: Floats, source: str = "fit") -> Truck:
        """The truck at x; its moved values carry `source`.

        Raises
        ------
        ForkliftError
            As `forklift.truck.Truck`, if it is impossible.
        """
        moved, _ = self._split(x)
        return move(self.truck, [unknown for unknown, _ in moved], np.array([at for _, at in moved]), source)

    def _split(self, x: Floats) -> tuple[list[tuple[Unknown, float]], list[tuple[Reading, float]]]:
        """The truck's unknowns and the sensors', each with its θ; the sensors' come last."""
        pairs = list(zip(self.unknowns, x.tolist(), strict=False))
        readings = [(unknown, at) for unknown, at in pairs if isinstance(unknown, Reading)]
        return pairs[: len(pairs) - len(readings)], readings

    def _linearise(self, sample: Sample, values: Floats, slopes: Floats, chain: Floats) -> Linearised:
        along = chain.shape[0]
        own = along + sample.free
        residual, jacobian, model, slope = {}, {}, {}, {}
        for seen in sample.observed:
            said = values[seen.rows, seen.column]
            rho, weight = self.misfit(seen, said)
            raw = slopes[seen.rows, seen.column]
            channel = seen.sensor.channel
            residual[channel], model[channel] = rho, said
            slope[channel] = np.hstack([raw[:, :along] @ chain, raw[:, own] * sample.width[sample.free]])
            jacobian[channel] = slope[channel] * weight[:, None]
        return Linearised(residual, jacobian, model, slope)

    def misfit(self, seen: Observed, said: Floats) -> tuple[Floats, Floats]:
        """Residual of each sample and its derivative along what the model says."""
        sigma = self.sigma[seen.sensor.channel]
        if seen.sensor.count:
            return likelihood.interval(seen.values, said, seen.sensor.count, sigma)
        return likelihood.gaussian(seen.values, said, sigma)

    def _products(self, sample: Sample, values: Floats, slopes: Floats, chain: Floats) -> Products:
        at = self._linearise(sample, values, slopes, chain)
        columns = chain.shape[1] + len(sample.free)
        normal, gradient, square = np.zeros((columns, columns)), np.zeros(columns), 0.0
        for channel, residual in at.residual.items():
            jacobian = at.jacobian[channel]
            normal += jacobian.T @ jacobian
            gradient += jacobian.T @ residual
            square += float(residual @ residual)
        return Products(at, normal, gradient, square)

    def _triangle(self, sample: Sample, values: Floats, slopes: Floats, chain: Floats) -> Floats:
        at = self._linearise(sample, values, slopes, chain)
        columns = chain.shape[1] + len(sample.free) + 1
        if not at.residual:
            return np.zeros((0, columns))
        rows = np.vstack([np.column_stack([at.jacobian[name], at.residual[name]]) for name in at.residual])
        triangle: Floats = qr(rows, mode="r", overwrite_a=True, check_finite=False)[0][:columns]
        return triangle


def _read(
    time: Floats, run: tuple[Floats, Floats], readings: Sequence[tuple[Reading, float]], own: int
) -> tuple[Floats, Floats]:
    """What the sensors read; the slopes along them stand before those from `own` on."""
    values, slopes = run
    if not readings:
        return run
    count = slopes.shape[2]
    for reading, at in readings:
        values, slopes = reading.read(time, values, slopes, at)
    return values, np.concatenate([slopes[..., :own], slopes[..., count:], slopes[..., own:count]], axis=2)


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
    temperature = np.full(len(recording), mean_temperature(recording, oil_temperature_degc))
    case = _core.Case(recording.time_s, recording.time_s, recording.command, temperature)
    at_rest = simulate(
        truck,
        Command(recording.time_s, *recording.command.T),
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
                observed.append(Observed(sensor, columns[channel], rows, values[rows]))
    return Sample(recording, case, centre, width, tuple(observed))


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
