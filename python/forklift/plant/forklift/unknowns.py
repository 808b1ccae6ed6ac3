"""What a fit may move: parameters and knots of the truck, with their scales, priors and bounds.

Every unknown is carried as a coordinate θ that is 0 at the truck the fit starts from and 1 one standard
deviation of the prior away, so that all are alike to the search:

    f(value) = f(value₀) + s θ      f the identity, ln, ln ln (what stands in a logarithm) or ln cos (angles)

The prior is Student's t with `DEGREES` degrees of freedom: it holds what recordings cannot tell, and its
heavy tails let go of what they contradict.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import log, pi
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.forklift.tables import parameters
from forklift.plant.parameter import SCALES, Unknown, moved_together
from forklift.recordings.channels import Lift

if TYPE_CHECKING:
    from forklift._core import ParameterSpec
    from forklift.plant.forklift.truck import Truck


LOG_WIDTH = 0.5
"""Prior width of a parameter on a log scale: another truck's is within a factor of 1.6 with two in three."""

LINEAR_WIDTH = 0.01
"""Prior width of a parameter on a linear scale, of the range between its bounds; half its value if that is
more."""

FAR_FROM_ZERO = 1e-3
"""A parameter that may be zero, but starts above this share of its upper bound, is carried on a log scale
all the same: what is known only as a product is then a straight line, which a search follows easily."""

LEAST_ANGLE = 0.02
"""Angles that count by their cosine stay above this [rad]: nearer to 0 their cosine no longer tells them.
A start is kept as far from a right angle, where the cosine's logarithm ends."""

LEAST_GAP = 0.01
"""Share of the gap between two knots of a table, as it is where the fit starts, that stays open."""

ESTIMATED = ("prms", "steady")
"""Origins of the parameters that the thesis estimated, and a fit does; the others were given or chosen."""

CURRENTS, AREAS = "valve.table_current", "valve.table_area"


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
        moved_together([unknown(truck, name) for name in group])
        for group in sorted([*singles, *filter(None, groups)], key=lambda group: first[group[0]])
    )


def grouped(truck: Truck, values: Mapping[str, float]) -> dict[str, float | Sequence[float]]:
    """Values by full name as a truck takes them: knots by number joined to whole tables."""
    found: dict[str, float | Sequence[float]] = {}
    tables: dict[str, list[float]] = {}
    for name, value in values.items():
        table = _table_of(name)
        if table is None:
            found[name] = value
        else:
            knots = tables.setdefault(table, list(truck.values[table]))  # type: ignore[arg-type]
            knots[int(name.rpartition(".")[2])] = value
    return {**found, **tables}


def move(truck: Truck, unknowns: Sequence[Unknown], theta: Floats, source: str) -> Truck:
    """The truck at θ; its moved values carry `source`.

    Raises
    ------
    ForkliftError
        As `Truck`, if the values are impossible: knots of a table out of order, say.
    """
    values = {
        name: float(value)
        for unknown, at in zip(unknowns, theta, strict=True)
        for name, value in zip(unknown.names, unknown.values(float(at)), strict=True)
    }
    return truck.with_values(grouped(truck, values), source=source)


def rising(truck: Truck, unknowns: Sequence[Unknown]) -> tuple[Floats, Floats]:
    """(orders, unknowns) rows and (orders,) what their product with θ must reach: knots stay in order."""
    at = {name: k for k, unknown in enumerate(unknowns) for name in unknown.names}
    rows, least = [], []
    for table in dict.fromkeys(filter(None, map(_table_of, at))):
        knots = np.array(truck.values[table], float)
        for n, gap in enumerate(np.diff(knots)):
            row = np.zeros(len(unknowns))
            for name, sign in ((f"{table}.{n}", -1.0), (f"{table}.{n + 1}", 1.0)):
                if name in at:
                    row[at[name]] += sign * unknowns[at[name]].width
            if row.any():
                rows.append(row)
                least.append((LEAST_GAP - 1.0) * gap)
    return np.array(rows).reshape(len(rows), len(unknowns)), np.array(least)


def _estimated(truck: Truck, name: str) -> bool:
    table = _table_of(name)
    if table is None:
        origin = parameters()[name]["origin"]
        of_effect = name.rpartition(".")[0] in truck.effects
        return (of_effect and origin != "given") or origin in ESTIMATED
    knots, at = np.array(truck.values[table]), int(name.rpartition(".")[2])
    return bool(knots[at] > 0.0) if table.endswith(AREAS) else 0 < at < len(knots) - 1


def _table_of(name: str) -> str | None:
    """The table whose knot `name` is."""
    head = name.rpartition(".")[0]
    return head if head.endswith((CURRENTS, AREAS)) else None


def _lift_of(name: str) -> str | None:
    head = name.partition(".")[0]
    return head if head in ("free", "main") else None


def unknown(truck: Truck, name: str) -> Unknown:
    """One parameter of the truck."""
    value = float(dict(zip(truck.core.names, truck.core.values, strict=True))[name])
    scale, width = _shape(name, value)
    if scale == "logcos":
        value = min(max(value, LEAST_ANGLE), 0.5 * pi - LEAST_ANGLE)
    spec, ends = _spec(name), _ends(name, value, scale, width)
    least, most = (spec["lower"],), (spec["upper"],)
    return Unknown((name,), spec["unit"], scale, (value,), width, *ends, least=least, most=most)


def _spec(name: str) -> ParameterSpec:
    return parameters()[_table_of(name) or name]


def _shape(name: str, value: float) -> tuple[str, float]:
    """The scale on which the parameter is carried, and its prior's width on it.

    Of an effect's, two thirds of the prior lie in the inner half of what is plausible.
    """
    spec, table = _spec(name), _table_of(name) or ""
    range_share = LINEAR_WIDTH * (spec["upper"] - spec["lower"])
    if "plausible_lower" in spec:
        lower, upper = spec["plausible_lower"], spec["plausible_upper"]  # type: ignore[typeddict-item]
        return (
            ("log", 0.25 * log(upper / lower))
            if spec["scale"] == "log"
            else ("linear", 0.25 * (upper - lower))
        )
    if table.endswith(CURRENTS):
        return "linear", range_share
    if table.endswith(AREAS):
        return "linear", LOG_WIDTH * value
    if spec["scale"] == "loglog":
        return "loglog", LOG_WIDTH / log(value)
    if spec["scale"] == "logcos":
        return "logcos", LOG_WIDTH
    if spec["scale"] == "log" or value > FAR_FROM_ZERO * spec["upper"]:
        return "log", LOG_WIDTH
    return "linear", max(range_share, LOG_WIDTH * abs(value))


def _ends(name: str, value: float, scale: str, width: float) -> tuple[float, float]:
    """Bounds of θ; where the scale does not reach the parameter's bound, none."""
    spec, forth = _spec(name), SCALES[scale].forth

    def theta(end: float) -> float:
        try:
            return (forth(end) - forth(value)) / width
        except ValueError:
            return -np.inf

    lower = max(spec["lower"], LEAST_ANGLE) if scale == "logcos" else spec["lower"]
    ends = sorted([theta(lower), theta(spec["upper"])])
    return ends[0], ends[1]
