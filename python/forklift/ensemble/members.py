"""The members of a sweep: each a pure function of the seed and its index."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.control.controller import Controller
from forklift.ensemble import specification
from forklift.ensemble.controllers import given, names, value
from forklift.ensemble.specification import Specification, Vary
from forklift.ensemble.tables import conditions
from forklift.plant.forklift.truck import Truck
from forklift.recordings.channels import commanded

Streams = NDArray[np.uint64]

LOWEST, HIGHEST = 2.0**-54, 1.0 - 2.0**-53
"""Uniform numbers lie between them: no distribution is infinite there."""
MOST_MEMBERS = 2**40
"""Their noise has sequences of its own: three times their number stays far below 2^64."""


@dataclass(frozen=True, eq=False)
class Members:
    """What a sweep's members are made of.

    Attributes
    ----------
    controller
        None: the profile gives the current.
    threads
        Of the core; 0 takes as many as there are processors. No bit depends on it.
    """

    specification: Specification
    truck: Truck
    controller: Controller | None = None
    threads: int = 0

    @classmethod
    def of(
        cls,
        given: Specification | Mapping[str, Any] | str | Path,
        truck: Truck | None = None,
        controller: Controller | None = None,
        threads: int = 0,
    ) -> Members:
        """Of a specification, its content or its file, with the truck and controller that it names.

        Raises
        ------
        ForkliftError
            As `specification.of`, `Truck.read` and `Controller.read` do.
        """
        spec = specification.of(given)
        if controller is None and spec.controller:
            controller = Controller.read(spec.controller)
        return cls(spec, truck or Truck.read(spec.truck), controller, threads)

    @cached_property
    def core(self) -> _core.Ensemble:
        """The same as the core runs it.

        Raises
        ------
        ForkliftError
            ``"argument-invalid"`` for names, bounds and distributions that the core refuses.
        """
        spec = self.specification
        lifts = commanded(spec.lifts)
        return _core.Ensemble(
            self.truck.core,
            spec.lifts,
            conditions=dict(spec.conditions),
            profile=[(stretch.from_s, stretch.level) for stretch in spec.profile],
            vary=[self._varied(name, vary) for name, vary in spec.vary.items()],
            require=[require.asked(lifts) for require in spec.require],
            settle_s=spec.settle_s,
            band_m_s=spec.band_m_s,
            duration_s=spec.duration_s,
            substeps=spec.substeps,
            seed=spec.seed,
            controller=given(self.controller, spec.lifts) if self.controller else None,
            threads=self.threads,
            precision=spec.precision,
        )

    @cached_property
    def grid(self) -> tuple[int, ...]:
        """How many values each varied quantity has, if all have a number of them."""
        return tuple(_count(name, vary) for name, vary in self.specification.vary.items())

    @cached_property
    def count(self) -> int:
        """How many members there are.

        Raises
        ------
        ForkliftError
            ``"value-invalid"`` for a number that the sampling cannot have.
        """
        spec = self.specification
        found = int(prod(self.grid)) if spec.sampling == "grid" else spec.members
        if not 1 <= found <= MOST_MEMBERS:
            raise ForkliftError(
                "value-invalid", f"members is {found}; give 1 to 2^40", name="members", value=found
            )
        if spec.sampling == "sobol":
            each = found // spec.scrambles if spec.scrambles > 0 else 0
            if spec.scrambles < 2 or each * spec.scrambles != found or each & (each - 1) or each < 1:
                raise ForkliftError(
                    "value-invalid",
                    f"members is {found} in {spec.scrambles} scrambles; give two scrambles or more and a "
                    "power of two times as many members, such as "
                    f"{max(spec.scrambles, 2) * 2 ** max(each, 1).bit_length()}",
                    name="members",
                    value=found,
                )
        return found

    @property
    def chunk(self) -> int:
        """Members of a chunk; of a Sobol sequence a chunk lies in one scramble."""
        spec = self.specification
        if spec.chunk < 1:
            raise ForkliftError("value-invalid", f"chunk is {spec.chunk}; give 1 or more", name="chunk")
        if spec.sampling == "sobol":
            each = self.count // spec.scrambles
            return min(each, 1 << (spec.chunk.bit_length() - 1))
        return min(spec.chunk, self.count)

    @property
    def chunks(self) -> int:
        return -(-self.count // self.chunk)

    def span(self, chunk: int) -> tuple[int, int]:
        """First member of a chunk, and the one after its last."""
        return chunk * self.chunk, min((chunk + 1) * self.chunk, self.count)

    def draw(self, first: int, last: int) -> tuple[Floats, Streams]:
        """Values (n, varied) and sequences of noise (n,) of the members from `first` up to `last`."""
        spec = self.specification
        if spec.sampling == "independent":
            uniform = self.core.uniform(first, last - first)
        elif spec.sampling == "grid":
            places = np.unravel_index(np.arange(first, last), self.grid) if self.grid else ()
            columns = [(place + 0.5) / n for place, n in zip(places, self.grid, strict=True)]
            uniform = np.stack(columns, axis=1) if columns else np.empty((last - first, 0))
        else:
            uniform = self._sobol(first, last)
        return self.values(uniform), np.arange(first, last, dtype=np.uint64)

    def values(self, uniform: Floats) -> Floats:
        """Values (n, varied) at uniform numbers (n, varied), those of `Correlate` drawn together."""
        return self.core.values(np.ascontiguousarray(self._together(uniform)))

    def _together(self, uniform: Floats) -> Floats:
        """The same numbers, those of `Correlate` correlated: u' = Φ(L Φ⁻¹(u)), a Gaussian copula.

        Sums run in a fixed order and member by member, so that no bit depends on the chunk.
        """
        from scipy.special import ndtri

        moved = uniform.copy()
        place = {name: k for k, name in enumerate(self.specification.vary)}
        for one in self.specification.correlate:
            factor = one.factor
            assert factor is not None  # `specification.check` saw to it
            normal = [ndtri(uniform[:, place[name]]) for name in one.names]
            for name, row in zip(one.names, factor, strict=True):
                total = np.zeros(len(uniform))
                for weight, z in zip(row, normal, strict=True):
                    if weight:
                        total = total + weight * z
                moved[:, place[name]] = uniform_of(total)
        return moved

    def _sobol(self, first: int, last: int) -> Floats:
        """Points of scrambled Sobol sequences, each scramble of its own seed (Owen 1997)."""
        from scipy.stats import qmc

        each = self.count // self.specification.scrambles
        scramble, place = divmod(first, each)
        seed = np.random.default_rng((self.specification.seed, scramble))
        points = qmc.Sobol(len(self.specification.vary), scramble=True, seed=seed)
        if place:
            points.fast_forward(place)
        # A point may be 0: the middle of its cell is not.
        inside: Floats = np.clip(points.random(last - first), LOWEST, HIGHEST)
        return inside

    def _varied(self, name: str, vary: Vary) -> tuple[str, str, list[float]]:
        """A distribution as the core takes it."""
        kind = vary.kind(name)
        numbers = [float(x) for x in getattr(vary, kind)]
        if kind == "grid":
            low, high, _ = numbers
            kind, numbers = "choice", list(np.linspace(low, high, _count(name, vary)))
        if vary.relative:
            base = self._base(name)
            scaled = kind != "log_normal"
            numbers = [
                x * base if scaled or place != 1 else x for place, x in enumerate(numbers)
            ]  # the deviation of a logarithm has no unit
        return name, kind, numbers

    def _base(self, name: str) -> float:
        """What `relative` counts from."""
        known = self.truck.core.names
        if name in known:
            return float(self.truck.core.values[known.index(name)])
        given = self.specification.conditions.get(name)
        if given is not None:
            return float(given)
        own = name.removeprefix("controller.")
        if self.controller and own != name and own in names():
            return value(self.controller, own)
        if name in conditions():
            return float(conditions()[name]["default"])
        raise ForkliftError(
            "value-invalid", f"vary.{name} is relative, but the truck has no such value", name=f"vary.{name}"
        )


def uniform_of(normal: Floats) -> Floats:
    """Uniform numbers of standard normal ones."""
    from scipy.special import ndtr

    inside: Floats = np.clip(ndtr(normal), LOWEST, HIGHEST)
    return inside


def _count(name: str, vary: Vary) -> int:
    if vary.grid is not None:
        if vary.grid[2] < 1:
            raise ForkliftError(
                "value-invalid", f"vary.{name} has a grid of {vary.grid[2]} values", name=name
            )
        return int(vary.grid[2])
    if vary.choice is not None:
        return len(vary.choice)
    raise ForkliftError(
        "value-invalid",
        f'vary.{name} has no number of values; a sweep with sampling = "grid" needs grid or choice',
        name=f"vary.{name}",
    )
