"""Recordings and a model with unknowns as one least-squares problem: what holds of any machine.

The unknown vector is (θ, φ₁, …, φ_K): the shared unknowns in units of their priors, and of each recording
its own (where it started, how warm it was) in units of theirs. Residuals are those of
`forklift.fitting.likelihood`, so that half their sum of squares is −ln posterior. A machine adds one
thing: what its outputs are and how they answer (`LeastSquares._simulate`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, replace
from os import cpu_count
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, qr

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.fitting import likelihood
from forklift.fitting.interface import Sample
from forklift.fitting.limits import Limits
from forklift.fitting.residuals import LAGS
from forklift.plant.parameter import DEGREES, Unknown

if TYPE_CHECKING:
    from forklift.fitting.observed import Observed

T = TypeVar("T")


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


class LeastSquares(ABC):
    """Residuals and derivatives of recordings along the unknowns, at a given weight of each channel."""

    unknowns: tuple[Unknown, ...]
    samples: Sequence[Sample]
    substeps: int
    sigma: Mapping[str, float]
    """Standard deviation each channel is weighted by, in its unit; of an encoder the softness."""
    lags: int = LAGS
    """Over how many samples residuals may be correlated."""

    @abstractmethod
    def _simulate(self, x: Floats, *, derivatives: bool) -> Sequence[tuple[Floats, Floats]]:
        """Outputs (times, outputs) of every recording, and their slopes (times, outputs, directions).

        The directions are all parameters that the unknowns stand for, in their units and in the unknowns'
        order, and then what recordings have of their own, as far as it is `carried` and in that order.
        """

    def weighted(self, sigma: Mapping[str, float], substeps: int | None = None) -> Self:
        """The same problem with other weights."""
        return self._but(sigma=sigma, substeps=self.substeps if substeps is None else substeps)

    def over(self, samples: Sequence[Sample]) -> Self:
        """The same problem over other recordings."""
        return self._but(samples=tuple(samples))

    def _but(self, **changed: object) -> Self:
        other = copy(self)
        vars(other).update(changed)
        return other

    @property
    def starts(self) -> list[int]:
        """Where each recording's φ begins in the unknown vector; last, its length."""
        lengths = [len(self.unknowns), *(len(sample.free) for sample in self.samples)]
        return [int(end) for end in np.cumsum(lengths)]

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
        rows, least = self.rising()
        beyond = np.zeros((len(rows), self.starts[-1] - len(self.unknowns)))
        return Limits.of(*self.bounds(), np.concatenate([rows, beyond], axis=1), least)

    def rising(self) -> tuple[Floats, Floats]:
        """(orders, shared unknowns) rows and (orders,) what their product with θ must reach."""
        return np.zeros((0, len(self.unknowns))), np.zeros(0)

    def at(self, theta: Floats) -> Floats:
        """The unknown vector of these shared unknowns (what follows them does not count), and of every
        recording's own at its most likely."""
        shared = len(self.unknowns)
        return np.concatenate([theta[:shared], np.zeros(self.starts[-1] - shared)])

    def nuisance(self, x: Floats, k: int) -> Floats:
        """φ of recording k."""
        return x[self.starts[k] : self.starts[k + 1]]

    def conditions(self, x: Floats, k: int) -> Floats:
        """(own,) what recording k has of its own, in its units."""
        sample = self.samples[k]
        here: Floats = sample.centre.copy()
        here[sample.free] += sample.width[sample.free] * self.nuisance(x, k)
        return here

    def conditions_held(self, x: Floats) -> tuple[Any, ...]:
        """The recordings with what is their own held at x."""
        samples: Sequence[Any] = self.samples
        return tuple(
            replace(sample, centre=self.conditions(x, k), width=np.zeros_like(sample.width))
            for k, sample in enumerate(samples)
        )

    def _holding(
        self, x: Floats, kept: Sequence[int], conditions: bool, **fixed: object
    ) -> tuple[Self, Floats]:
        """The same place with these unknowns only, the others `fixed` in the model; unless `conditions`, what
        recordings have of their own is known."""
        problem = self._but(
            unknowns=tuple(self.unknowns[k] for k in kept),
            samples=self.samples if conditions else self.conditions_held(x),
            **fixed,
        )
        return problem, np.concatenate([x[list(kept)], x[len(self.unknowns) :] if conditions else []])

    @property
    def carried(self) -> NDArray[np.intp]:
        """Which of what recordings have of their own are unknown in any of them."""
        return np.flatnonzero(np.any([sample.width for sample in self.samples], axis=0))

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

    def _linearise(self, sample: Sample, values: Floats, slopes: Floats, chain: Floats) -> Linearised:
        along = chain.shape[0]
        own = along + np.searchsorted(self.carried, sample.free)
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
        return seen.misfit(said, self.sigma[seen.sensor.channel])

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
