"""Recordings and a machine with unknowns as one least-squares problem.

The unknown vector is (θ, φ₁, …, φ_K): the shared unknowns in units of their priors, and of each recording
its own (where it started, how warm it was) in units of theirs. Residuals are those of
`forklift.fitting.likelihood`, so that half their sum of squares is −ln posterior. The problem holds a
`forklift.plant.protocol.Machine`, which runs the recordings; sensors that read wrongly are put on top of what
the machine says.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from forklift import _core
from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.fitting import likelihood
from forklift.fitting.limits import Limits
from forklift.fitting.linearised import Linearised, Products
from forklift.fitting.observed import Seen, by_channel
from forklift.fitting.residuals import LAGS
from forklift.fitting.sample import Sample
from forklift.fitting.work import Work
from forklift.plant.parameter import DEGREES, Together, Unknown
from forklift.plant.protocol import Addition, Machine, Responses, Run, Steps
from forklift.plant.sensor_faults import ConditionOffset, SensorUnknown
from forklift.plant.sensor_faults import read as sensed

Found = tuple[Floats, Floats, Floats, Floats]
"""Residuals, model, Jacobian, and the model's slopes, no rows if they were not asked for."""

KEPT = 3
"""Places whose runs are kept: of the recordings that are fitted, of those held out, and of some of these."""

STEP = 1e-4
"""Of difference quotients, in standard deviations of a prior."""


@dataclass
class Last:
    """The last places at which recordings were differentiated, with the runs: weights do not enter them."""

    places: deque[tuple[tuple[object, ...], int, Floats, list[Run]]] = field(
        default_factory=lambda: deque(maxlen=KEPT)
    )

    def known(self, of: tuple[object, ...], substeps: int, x: Floats) -> list[Run] | None:
        """Those at x of the same machine, unknowns and recordings, if they are kept."""
        for known, steps, place, found in self.places:
            same = steps == substeps and all(a is b for a, b in zip(known, of, strict=True))
            if same and np.array_equal(place, x):
                return found
        return None

    def keep(self, of: tuple[object, ...], substeps: int, x: Floats, runs: list[Run]) -> list[Run]:
        """The same runs, kept."""
        self.places.append((of, substeps, x.copy(), runs))
        return runs


@dataclass
class LeastSquares:
    """Residuals and derivatives of recordings along the unknowns, at a given weight of each channel."""

    machine: Machine
    unknowns: tuple[Unknown, ...]
    """The machine's, then offsets of conditions, then those of sensors."""
    samples: tuple[Sample, ...]
    substeps: int
    sigma: Mapping[str, float] = field(default_factory=dict)
    """Standard deviation each channel is weighted by, in its unit; of an encoder the softness."""
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Parameters that are not as the machine starts with them, and are not unknown."""
    lags: int = LAGS
    """Over how many samples residuals may be correlated."""
    work: Work = field(default_factory=Work)
    """What this problem and those made of it have computed."""
    last: Last = field(default_factory=Last, repr=False, compare=False)
    """Where they were last differentiated: the next stage begins there, and so does every judgement."""

    def weighted(self, sigma: Mapping[str, float], substeps: int | None = None) -> Self:
        """The same problem with other weights."""
        return replace(self, sigma=sigma, substeps=self.substeps if substeps is None else substeps)

    def over(self, samples: Sequence[Sample]) -> Self:
        """The same problem over other recordings."""
        return replace(self, samples=tuple(samples))

    def with_addition(self, addition: Addition) -> Self:
        """The same problem with what a hypothesis adds, at its null value."""
        machine, offsets, sensors = self._split(self.unknowns)
        more, off, wrong = self._split(addition.free)
        return replace(
            self,
            fixed={**self.fixed, **dict(addition.values)},
            unknowns=(*machine, *more, *offsets, *off, *sensors, *wrong),
            samples=tuple(_widened(sample, addition.widened) for sample in self.samples),
        )

    def values(self, x: Floats) -> dict[str, float]:
        """All parameters at x that are not as the machine starts with them, by name."""
        own = self._of_machine
        return {**self.fixed, **dict(zip(own.names, own.values(x).tolist(), strict=True))}

    @cached_property
    def _of_machine(self) -> Together:
        return Together(self._split(self.unknowns)[0])

    @cached_property
    def _all(self) -> Together:
        return Together(self.unknowns)

    @staticmethod
    def _split(
        unknowns: Sequence[Unknown],
    ) -> tuple[list[Unknown], list[ConditionOffset], list[SensorUnknown]]:
        """The machine's unknowns, offsets of conditions, and those of sensors."""
        offsets = [one for one in unknowns if isinstance(one, ConditionOffset)]
        sensors = [one for one in unknowns if isinstance(one, SensorUnknown)]
        machine = [one for one in unknowns if not isinstance(one, ConditionOffset | SensorUnknown)]
        return machine, offsets, sensors

    def run(self, x: Floats, *, derivatives: bool = False, read: bool = True) -> list[Run]:
        """Every recording at x; its slopes along parameters, sensors and conditions that are unknown.

        `read`: as the sensors read it; else what is the machine's own.
        """
        if not read:
            return self._run(x, derivatives=derivatives, read=False)
        of = (self.machine, self.unknowns, self.samples, self.fixed)
        known = self.last.known(of, self.substeps, x)
        if known is not None:
            return known
        runs = self._run(x, derivatives=derivatives, read=True)
        return self.last.keep(of, self.substeps, x, runs) if derivatives else runs

    def visited(self) -> list[tuple[int, Floats]]:
        """Substeps and unknown vector of each run with slopes that is still kept."""
        of = (self.machine, self.unknowns, self.samples, self.fixed)
        return [
            (substeps, x)
            for known, substeps, x, _ in self.last.places
            if all(a is b for a, b in zip(known, of, strict=True))
        ]

    def visit(self, places: Sequence[tuple[int, Floats]]) -> None:
        """Run there again, so that what follows finds the same runs kept."""
        for substeps, x in places:
            self.weighted(self.sigma, substeps).run(x, derivatives=True)

    def _run(self, x: Floats, *, derivatives: bool, read: bool) -> list[Run]:
        machine, offsets, sensors = self._split(self.unknowns)
        values = self.values(x)
        conditions = [self.conditions(x, k) for k in range(len(self.samples))]
        names = [name for unknown in machine for name in unknown.names] if derivatives else []
        own = self.carried.tolist() if derivatives else []
        runs = self.machine.run(
            values,
            self.samples,
            conditions,
            substeps=self.substeps,
            along=names,
            own=own,
            steps=lambda: self._steps(x, conditions),
        )
        self.work.add(sum(len(run.outputs) for run in runs), len(names) + len(own), self.substeps)
        if offsets and derivatives:
            runs = [
                _along_offsets(run, sample, offsets, len(names), own)
                for sample, run in zip(self.samples, runs, strict=True)
            ]
        if not sensors or not read:
            return runs
        place = {name: k for k, name in enumerate(self.machine.outputs)}
        first = len(machine) + len(offsets)
        pairs = list(zip(sensors, x[first : len(self.unknowns)].tolist(), strict=True))
        along = len(names) + len(offsets)
        return [
            Run(*sensed(sample.recording.time_s, *run, pairs, place, along, derivatives=derivatives))
            for sample, run in zip(self.samples, runs, strict=True)
        ]

    def _steps(self, x: Floats, conditions: Sequence[Floats]) -> Steps:
        """Of difference quotients: `STEP` standard deviations, away from a bound."""
        machine, *_ = self._split(self.unknowns)
        upper = self.bounds()[1]
        along: list[float] = []
        for k, unknown in enumerate(machine):
            step = STEP if x[k] + STEP <= upper[k] else -STEP
            along += (unknown.values(float(x[k] + step)) - unknown.values(float(x[k]))).tolist()
        own = np.array([STEP * sample.width for sample in self.samples])
        own = np.where(np.array(conditions) + own > np.array([one.most for one in self.samples]), -own, own)
        return Steps(np.array(along), own[:, self.carried])

    def respond(self, x: Floats, k: int, ports: Sequence[str], centres: Floats, width_s: float) -> Responses:
        """How recording k answers hats over time at some ports."""
        answers = self.machine.respond(
            self.values(x),
            self.samples[k],
            self.conditions(x, k),
            ports,
            centres,
            width_s,
            substeps=self.substeps,
        )
        self.work.add(len(self.samples[k].recording), answers.directions, self.substeps)
        return answers

    def moments(self, x: Floats, part: str) -> list[dict[str, Floats]]:
        """Of every recording the machine's variables at x, (times,) each, for what acts on `part`."""
        conditions = [self.conditions(x, k) for k in range(len(self.samples))]
        return self.machine.moments(self.values(x), self.samples, conditions, part, substeps=self.substeps)

    def with_fixed(self, x: Floats, amplitudes: Collection[str], *, conditions: bool) -> tuple[Self, Floats]:
        """All held at x but these unknowns, offsets and the sensors', and unless `conditions` what recordings
        have of their own; and the same place. So much is cheaper to differentiate."""
        kept = [
            k
            for k, unknown in enumerate(self.unknowns)
            if unknown.name in amplitudes or isinstance(unknown, ConditionOffset | SensorUnknown)
        ]
        problem = replace(
            self,
            unknowns=tuple(self.unknowns[k] for k in kept),
            samples=self.samples if conditions else self.conditions_held(x),
            fixed=self.values(x),
        )
        return problem, np.concatenate([x[kept], x[len(self.unknowns) :] if conditions else []])

    @cached_property
    def starts(self) -> list[int]:
        """Where each recording's φ begins in the unknown vector; last, its length."""
        return list(accumulate((len(sample.free) for sample in self.samples), initial=len(self.unknowns)))

    def bounds(self) -> tuple[Floats, Floats]:
        """Least and greatest of the unknown vector."""
        lower = [unknown.lower for unknown in self.unknowns]
        upper = [unknown.upper for unknown in self.unknowns]
        for sample in self.samples:
            upper += [*((sample.most[sample.free] - sample.centre[sample.free]) / sample.width[sample.free])]
            lower += [*((sample.least[sample.free] - sample.centre[sample.free]) / sample.width[sample.free])]
        return np.array(lower), np.array(upper)

    def limits(self) -> Limits:
        """What the unknown vector may not leave: its bounds, and the order of what must rise."""
        rows, least = self.machine.ordered(self.fixed, self.unknowns)
        beyond = np.zeros((len(rows), self.starts[-1] - len(self.unknowns)))
        return Limits.of(*self.bounds(), np.concatenate([rows, beyond], axis=1), least)

    def at(self, theta: Floats) -> Floats:
        """The unknown vector of these shared unknowns (what follows them does not count), and of every
        recording's own at its most likely."""
        shared = len(self.unknowns)
        return np.concatenate([theta[:shared], np.zeros(self.starts[-1] - shared)])

    def nuisance(self, x: Floats, k: int) -> Floats:
        """φ of recording k."""
        return x[self.starts[k] : self.starts[k + 1]]

    def conditions(self, x: Floats, k: int) -> Floats:
        """(own,) what recording k has of its own, in its units, with what all are off by."""
        here = self._as_told(x, k)
        sample = self.samples[k]
        for place, one in enumerate(self.unknowns):
            if isinstance(one, ConditionOffset) and sample.recording.file in one.files:
                at = sample.names.index(one.condition)
                acts = here[at] + float(one.values(float(x[place]))[0])
                here[at] = min(max(acts, sample.least[at]), sample.most[at])
        return here

    def _as_told(self, x: Floats, k: int) -> Floats:
        """The same, as if no condition were off in all recordings."""
        sample = self.samples[k]
        here: Floats = sample.centre.copy()
        here[sample.free] += sample.width[sample.free] * self.nuisance(x, k)
        # At its bound a sum of centre and width may lie beyond it by a rounding: a load of -1e-14 kg.
        return np.clip(here, sample.least, sample.most)

    def conditions_held(self, x: Floats) -> tuple[Sample, ...]:
        """The recordings with what is their own held at x."""
        return tuple(
            replace(sample, centre=self._as_told(x, k), width=np.zeros_like(sample.width))
            for k, sample in enumerate(self.samples)
        )

    @cached_property
    def carried(self) -> NDArray[np.intp]:
        """Which of what recordings have of their own are unknown in any of them, or in all alike."""
        wide = np.any([sample.width for sample in self.samples], axis=0)
        names = self.samples[0].names if self.samples else ()
        wide[[names.index(one.condition) for one in self._split(self.unknowns)[1]]] = True
        return np.flatnonzero(wide)

    def columns(self, k: int) -> NDArray[np.intp]:
        """Where θ and the φ of recording k stand in the unknown vector."""
        own = np.arange(self.starts[k], self.starts[k + 1])
        return np.concatenate([np.arange(len(self.unknowns)), own])

    def linearise(self, x: Floats) -> list[Linearised]:
        """Every recording simulated and differentiated at x.

        Raises
        ------
        ForkliftError
            If the machine at x is impossible or a run fails.
        """
        found = []
        for sample, at in zip(self.samples, self._linearised(x, slopes_too=True), strict=True):
            residual, model, jacobian, slope = (by_channel(sample.observed, one) for one in at)
            found.append(Linearised(residual, jacobian, model, slope))
        return found

    def products(self, x: Floats) -> list[Products]:
        """Every recording linearised at x, with its share of the normal equations.

        Raises
        ------
        ForkliftError
            As `linearise`.
        """
        found = []
        with one_thread(), np.errstate(over="ignore", invalid="ignore"):  # a machine may swing up by itself
            for residual, _, jacobian, _ in self._linearised(x):
                normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
                found.append(Products(residual, jacobian, normal, gradient, float(residual @ residual)))
        return found

    def residuals(self, x: Floats) -> list[Floats]:
        """Every recording's residuals at x, one channel after the other; several times faster than
        `linearise`.

        Raises
        ------
        ForkliftError
            As `linearise`.
        """
        runs = zip(self.samples, self.run(x), strict=True)
        return _core.residuals([(np.ascontiguousarray(run.outputs), self._seen(one)) for one, run in runs])

    def said(self, x: Floats) -> list[dict[str, Floats]]:
        """What the model says at x of every recording, channel by channel, each in its unit.

        Raises
        ------
        ForkliftError
            As `linearise`.
        """
        runs = self.run(x)
        return [
            {seen.sensor.channel: seen.of(values) for seen in sample.observed}
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
        with one_thread():
            triangles = [_triangle(at[0], at[2]) for at in self._linearised(x)]
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

    def _linearised(self, x: Floats, *, slopes_too: bool = False) -> list[Found]:
        """Of every recording, one channel after the other: residuals, what the model says, the residuals'
        Jacobian over θ and the recording's φ, and `slopes_too` the model's."""
        unknown_of = self._all.of
        runs = self.run(x, derivatives=True)
        given = []
        for sample, run in zip(self.samples, runs, strict=True):
            own = (len(unknown_of) + np.searchsorted(self.carried, sample.free)).tolist()
            widths = sample.width[sample.free].tolist()
            values, along = (np.ascontiguousarray(each) for each in run)
            given.append((values, along, self._seen(sample), own, widths))
        factors = self._all.slopes(x).tolist()
        return _core.linearised(given, unknown_of, factors, len(self.unknowns), slopes_too=slopes_too)

    def _seen(self, sample: Sample) -> list[Seen]:
        """What was read of a recording, at the channels' weights."""
        return [seen.weighted(self.sigma[seen.sensor.channel]) for seen in sample.observed]


def _triangle(residual: Floats, jacobian: Floats) -> Floats:
    """R of the QR decomposition of both, side by side."""
    rows = np.column_stack([jacobian, residual])
    if not len(rows):
        return rows
    triangle: Floats = qr(rows, mode="r", overwrite_a=True, check_finite=False)[0][: rows.shape[1]]
    return triangle


def _widened(sample: Sample, widths: Sequence[tuple[str, float]]) -> Sample:
    """The sample with some of its conditions known to these standard deviations only."""
    if not widths:
        return sample
    wide = sample.width.copy()
    for name, width in widths:
        place = sample.names.index(name)
        wide[place] = max(width, wide[place])
    return replace(sample, width=wide)


def _along_offsets(
    run: Run, sample: Sample, offsets: Sequence[ConditionOffset], along: int, own: Sequence[int]
) -> Run:
    """The run with its slopes along offsets of conditions, before those along conditions, from `along` on."""
    values, slopes = run
    more = [
        slopes[..., along + list(own).index(sample.names.index(one.condition))]
        * (sample.recording.file in one.files)
        for one in offsets
    ]
    return Run(values, np.concatenate([slopes[..., :along], np.stack(more, -1), slopes[..., along:]], axis=2))
