"""What a fit may move: parameters and knots of the truck, with their scales, priors and bounds.

Every unknown is carried as a coordinate θ that is 0 at the truck the fit starts from and 1 one standard
deviation of the prior away, so that all are alike to the search:

    log scale     value = value₀ · exp(s θ)        linear scale     value = value₀ + s θ

The prior is Student's t with `DEGREES` degrees of freedom: it holds what recordings cannot tell, and its
heavy tails let go of what they contradict.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift.errors import ForkliftError
from forklift.names import Lift, parameters

if TYPE_CHECKING:
    from forklift.truck import Truck

Floats = NDArray[np.float64]

DEGREES = 4.0
"""Degrees of freedom of the priors' Student t."""

LOG_WIDTH = 0.5
"""Prior width of a parameter on a log scale: another truck's is within a factor of 1.6 with two in three."""

LINEAR_WIDTH = 0.01
"""Prior width of a parameter on a linear scale, of the range between its bounds; half its value if that is
more."""

ESTIMATED = ("prms", "steady")
"""Origins of the parameters that the thesis estimated, and a fit does; the others were given or chosen."""

CURRENTS, AREAS = "valve.table_current", "valve.table_area"


@dataclass(frozen=True)
class Unknown:
    """One number to estimate, which may stand for several parameters of the truck that move together."""

    names: tuple[str, ...]
    """Full names as the core has them: ``"free.bulk.a_1"``, ``"free.valve.table_area.3"``."""
    unit: str
    log: bool
    start: tuple[float, ...]
    """Values at θ = 0, one per name."""
    width: float
    """s: one standard deviation of the prior, as a logarithm or in `unit`."""
    lower: float
    """Least θ, from the parameter table's bounds."""
    upper: float

    @property
    def name(self) -> str:
        return self.names[0]

    def values(self, theta: float) -> Floats:
        """(names,) what the parameters are at θ."""
        start = np.array(self.start)
        return start * np.exp(self.width * theta) if self.log else start + self.width * theta

    def slopes(self, theta: float) -> Floats:
        """(names,) derivatives of `values` along θ."""
        return self.width * self.values(theta) if self.log else np.full(len(self.names), self.width)


def unknowns(
    truck: Truck,
    lifts: Collection[Lift],
    *,
    hold: Collection[str] = (),
    also: Collection[str] = (),
    together: Sequence[Sequence[str]] = (),
) -> tuple[Unknown, ...]:
    """Everything that the thesis estimated on these lifts, and what effects the truck has.

    Of the area table: all openings above zero, and the currents of the knots between the first and the last.

    Parameters
    ----------
    truck
        Where the fit starts.
    hold
        Full names of parameters (or of a whole table) to leave as they are.
    also
        Full names of further parameters to estimate.
    together
        Groups of full names that move together, by the same factor (log scale) or the same amount.

    Raises
    ------
    ForkliftError
        ``"parameter-unknown"`` for a name the truck does not have, ``"argument-invalid"`` for a group that
        mixes scales.
    """
    known = [*truck.core.names]
    for name in [*hold, *also, *(name for group in together for name in group)]:
        if name not in known and name not in truck.values:
            raise ForkliftError(
                "parameter-unknown",
                f"there is no parameter {name} in truck {truck.name!r}; `forklift info` lists them",
                name=name,
            )
    wanted = [
        name
        for name in known
        if (name in also or (_lift_of(name) in (*lifts, None) and _estimated(truck, name)))
        and name not in hold
        and _table_of(name) not in hold
    ]
    groups = [tuple(name for name in group if name in wanted) for group in together]
    grouped = {name for group in groups for name in group}
    singles = [(name,) for name in wanted if name not in grouped]
    first = {name: place for place, name in enumerate(known)}
    return tuple(
        _unknown(truck, group)
        for group in sorted([*singles, *filter(None, groups)], key=lambda group: first[group[0]])
    )


def move(truck: Truck, unknowns: Sequence[Unknown], theta: Floats, source: str) -> Truck:
    """The truck at θ; its moved values carry `source`.

    Raises
    ------
    ForkliftError
        As `Truck`, if the values are impossible: knots of a table out of order, say.
    """
    scalars: dict[str, float] = {}
    tables: dict[str, list[float]] = {}
    for unknown, at in zip(unknowns, theta, strict=True):
        for name, value in zip(unknown.names, unknown.values(float(at)), strict=True):
            table = _table_of(name)
            if table is None:
                scalars[name] = float(value)
            else:
                knots = tables.setdefault(table, list(truck.values[table]))  # type: ignore[arg-type]
                knots[int(name.rpartition(".")[2])] = float(value)
    moved: Mapping[str, float | Sequence[float]] = {**scalars, **tables}
    return truck.with_values(moved, source=source)


def _estimated(truck: Truck, name: str) -> bool:
    table = _table_of(name)
    if table is None:
        return parameters()[name]["origin"] in ESTIMATED
    knots, at = np.array(truck.values[table]), int(name.rpartition(".")[2])
    return bool(knots[at] > 0.0) if table.endswith(AREAS) else 0 < at < len(knots) - 1


def _table_of(name: str) -> str | None:
    """The table whose knot `name` is."""
    head = name.rpartition(".")[0]
    return head if head.endswith((CURRENTS, AREAS)) else None


def _lift_of(name: str) -> str | None:
    head = name.partition(".")[0]
    return head if head in ("free", "main") else None


def _unknown(truck: Truck, names: tuple[str, ...]) -> Unknown:
    values = dict(zip(truck.core.names, truck.core.values, strict=True))
    start = tuple(float(values[name]) for name in names)
    shapes = {_shape(name, value) for name, value in zip(names, start, strict=True)}
    if len({shape[0] for shape in shapes}) > 1:
        raise ForkliftError(
            "argument-invalid",
            f"{' and '.join(names)} cannot move together: their scales differ; group like with like",
            name=names[0],
        )
    log_scale, width = max(shapes)
    ends = [[*_ends(name, value, log_scale, width)] for name, value in zip(names, start, strict=True)]
    unit = parameters()[_table_of(names[0]) or names[0]]["unit"]
    return Unknown(
        names, unit, log_scale, start, width, max(end[0] for end in ends), min(end[1] for end in ends)
    )


def _shape(name: str, value: float) -> tuple[bool, float]:
    """Whether the parameter is carried on a log scale, and its prior's width."""
    spec = parameters()[_table_of(name) or name]
    range_share = LINEAR_WIDTH * (spec["upper"] - spec["lower"])
    if (_table_of(name) or "").endswith(CURRENTS):
        return False, range_share
    if spec["scale"] == "log" or (_table_of(name) or "").endswith(AREAS):
        return True, LOG_WIDTH
    return False, max(range_share, LOG_WIDTH * abs(value))


def _ends(name: str, value: float, log_scale: bool, width: float) -> Iterator[float]:
    spec = parameters()[_table_of(name) or name]
    for end in (spec["lower"], spec["upper"]):
        if not log_scale:
            yield (end - value) / width
        else:
            yield log(end / value) / width if end > 0.0 else -np.inf
