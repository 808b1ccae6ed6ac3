"""An unknown number of a machine: its scale, prior and bounds.

Every unknown is carried as a coordinate θ that is 0 at the value the fit starts from and 1 one standard
deviation of the prior away, so that all are alike to the search:

    f(value) = f(value₀) + s θ      f the identity, ln, ln ln (what stands in a logarithm) or ln cos (angles)

The prior is Student's t with `DEGREES` degrees of freedom: it holds what recordings cannot tell, and its
heavy tails let go of what they contradict.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, inf, log
from typing import NamedTuple

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError

DEGREES = 4.0
"""Degrees of freedom of the priors' Student t."""


class Scale(NamedTuple):
    """A scale on which a parameter is carried: to it, back, and the derivative of the way back."""

    forth: Callable[[float], float]
    back: Callable[[Floats], Floats]
    slope: Callable[[Floats], Floats]
    """Of the parameter along the scale, as a function of the parameter."""


SCALES = {
    "linear": Scale(lambda x: x, lambda s: s, np.ones_like),
    "log": Scale(log, np.exp, lambda x: x),
    "loglog": Scale(lambda x: log(log(x)), lambda s: np.exp(np.exp(s)), lambda x: x * np.log(x)),
    "logcos": Scale(
        lambda x: log(cos(x)), lambda s: np.arccos(np.exp(np.minimum(s, 0.0))), lambda x: -1.0 / np.tan(x)
    ),
}
"""By the parameter table's word."""


@dataclass(frozen=True)
class Unknown:
    """One number to estimate, which may stand for several parameters of the truck that move together."""

    names: tuple[str, ...]
    """Full names as the core has them: ``"free.bulk.a_1"``, ``"free.valve.table_area.3"``."""
    unit: str
    scale: str
    """A key of `SCALES`."""
    start: tuple[float, ...]
    """Values at θ = 0, one per name."""
    width: float
    """s: one standard deviation of the prior, on the scale."""
    lower: float
    """Least θ, from the parameter table's bounds."""
    upper: float
    least: tuple[float, ...] = field(default=(-inf,), kw_only=True)
    """These bounds themselves, one per name or one for all: no value at a bound is rounded beyond it."""
    most: tuple[float, ...] = field(default=(inf,), kw_only=True)

    @property
    def name(self) -> str:
        return self.names[0]

    @cached_property
    def _origin(self) -> Floats:
        return np.array([SCALES[self.scale].forth(value) for value in self.start])

    def values(self, theta: float) -> Floats:
        """(names,) what the parameters are at θ."""
        return np.clip(SCALES[self.scale].back(self._origin + self.width * theta), self.least, self.most)

    def slopes(self, theta: float) -> Floats:
        """(names,) derivatives of `values` along θ."""
        return self.width * SCALES[self.scale].slope(self.values(theta))


class Together:
    """Several unknowns at once: the parameters of all, one after the other."""

    def __init__(self, unknowns: Sequence[Unknown]) -> None:
        self.names = tuple(name for one in unknowns for name in one.names)
        self.of = [k for k, one in enumerate(unknowns) for _ in one.names]
        """(names,) whose parameter each is."""
        self._origin = np.concatenate([np.zeros(0), *(one._origin for one in unknowns)])
        self._width = np.array([unknowns[k].width for k in self.of])
        self._least, self._most = np.array(_each(unknowns, "least")), np.array(_each(unknowns, "most"))
        scales = [unknowns[k].scale for k in self.of]
        self._places = [
            (SCALES[scale], np.array([k for k, one in enumerate(scales) if one == scale]))
            for scale in dict.fromkeys(scales)
        ]

    def values(self, theta: Floats) -> Floats:
        """(names,) see `Unknown.values`; θ of each unknown."""
        along = self._origin + self._width * theta[self.of]
        for scale, places in self._places:
            along[places] = scale.back(along[places])
        return np.clip(along, self._least, self._most)

    def slopes(self, theta: Floats) -> Floats:
        """(names,) see `Unknown.slopes`."""
        found = self.values(theta)
        for scale, places in self._places:
            found[places] = scale.slope(found[places])
        return self._width * found


def moved_together(group: Sequence[Unknown]) -> Unknown:
    """One unknown of several: all move by the same factor, or by the same amount.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` if their scales differ.
    """
    first, *others = group
    if not others:
        return first
    names = tuple(name for one in group for name in one.names)
    if len({one.scale for one in group}) > 1:
        raise ForkliftError(
            "argument-invalid",
            f"{' and '.join(names)} cannot move together: their scales differ; group like with like",
            name=first.name,
        )
    width = max(one.width for one in group)
    return Unknown(
        names,
        first.unit,
        first.scale,
        tuple(value for one in group for value in one.start),
        width,
        max(one.lower * one.width for one in group) / width,
        min(one.upper * one.width for one in group) / width,
        least=_each(group, "least"),
        most=_each(group, "most"),
    )


def _each(group: Sequence[Unknown], end: str) -> tuple[float, ...]:
    """That bound of every name."""
    found: list[float] = []
    for of in group:
        own = getattr(of, end)
        found += own * (len(of.names) // len(own))
    return tuple(found)
