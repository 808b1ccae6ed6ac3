"""A truck of one's own: what its owner knows, with sources, over another truck's values for the rest.

What a data sheet or a drawing tells (areas, masses, strokes, settings of the compensator) is given here. What
no sheet tells (friction, the oil's stiffness, the valve's hysteresis) is estimated from recordings; until
then it stands at the values of the truck that is started from, and says so.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from math import pi

from forklift.base.errors import ForkliftError
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck import Truck
from forklift.recordings import units
from forklift.recordings.channels import LIFTS

ASKED = (
    "cylinder.area",
    "cylinder.mass",
    "cylinder.stroke_lower",
    "cylinder.stroke_upper",
    "mass.moving",
    "compensator.p_set",
    "compensator.p_reg",
)
"""What an owner is asked for, of each lift."""

_TOLD = re.compile(r"\s*([-+0-9.eE]+)\s*([^#]*?)\s*(?:#\s*(.*))?")
_POINTS = ("valve.table_current", "valve.table_area")


def new_truck(name: str, told: Mapping[str, str], base: Truck) -> Truck:
    """The truck `base` with what is told of another one.

    Parameters
    ----------
    name
        Of the new truck.
    told
        By parameter its value with its unit and, behind ``#``, its source:
        ``{"free.cylinder.area": "23.8 cm^2 # data sheet"}``. ``LIFT.bore`` with ``LIFT.cylinders`` (1 unless
        told) stands for the area, n·π·d²/4; ``LIFT.valve.points``, ``"0.36:0, 0.5:2.1e-6"``, for the knots of
        the area table [A: m²].
    base
        Where everything else comes from.

    Raises
    ------
    ForkliftError
        ``"truck-malformed"``, ``"parameter-unknown"``, ``"parameter-not-a-number"``, ``"parameter-unit"``,
        and those of `Truck`.
    """
    check_name(name)
    values: dict[str, float | tuple[float, ...]] = {}
    sources: dict[str, str] = {}
    left = dict(told)
    for lift in LIFTS:
        for key, area, source in _area(lift, left):
            values[key], sources[key] = area, source
        for key, knots, source in _points(lift, left):
            values[key], sources[key] = knots, source
    for key, text in left.items():
        side, _, part = key.partition(".")
        if key in base.values and part in _POINTS:
            raise ForkliftError(
                "parameter-unknown",
                f"{key} is no number of its own; write the knots of the area table as {side}.valve.points, "
                'such as "0.36:0, 0.5:2.1e-6"',
                name=key,
            )
        if key not in base.values:
            spoken = [f"{lift}.{one}" for lift in LIFTS for one in ("bore", "cylinders", "valve.points")]
            near = get_close_matches(key, [*spoken, *base.values], n=1)
            raise ForkliftError(
                "parameter-unknown",
                f"there is no parameter {key!r}"
                + (f" (did you mean {near[0]!r}?)" if near else "")
                + "; forklift info lists them",
                name=key,
            )
        values[key], sources[key] = _value(key, text, parameters()[key]["unit"])
    kept = {
        key: source if source.startswith(f"as {base.name}: ") else f"as {base.name}: {source}"
        for key, source in base.sources.items()
    }
    return Truck(name, {**base.values, **values}, {**kept, **sources})


def check_name(name: str) -> None:
    """The truck has a name.

    Raises
    ------
    ForkliftError
        ``"truck-malformed"``.
    """
    if not name.strip():
        raise ForkliftError(
            "truck-malformed",
            f"the truck's name is {name!r}; give it one, such as mine",
            name="name",
            value=name,
        )


def still_of(truck: Truck, base: Truck) -> list[str]:
    """The parameters that a data sheet would give, but that stand at the values of `base`."""
    return [
        key
        for key in truck.values
        if key.split(".", 1)[1] in ASKED and truck.sources[key].startswith(f"as {base.name}: ")
    ]


def _value(key: str, text: str, unit: str) -> tuple[float, str]:
    """The value in the parameter's unit, and its source."""
    found = _TOLD.fullmatch(text)
    try:
        number = float(found[1]) if found else float("nan")
    except ValueError:
        number = float("nan")
    if found is None or number != number:
        raise ForkliftError(
            "parameter-not-a-number",
            f"{key} is told as {text!r}; write a number, its unit, and behind # its source",
            name=key,
            value=text,
        )
    stated = found[2].strip()
    source = (found[3] or "").strip() or "told by its owner"
    if not stated or stated == unit:
        return number, source
    linear = units.conversion(stated, unit if unit != "1" else "dimensionless")
    if linear is None:
        raise ForkliftError(
            "parameter-unit",
            f"{key} is told in {stated!r}, which is no unit of {unit}; write it in {unit}",
            name=key,
            value=stated,
            unit=unit,
        )
    return number * linear.scale + linear.offset, f"{source} ({found[1]} {stated})"


def _area(lift: str, left: dict[str, str]) -> list[tuple[str, float, str]]:
    bore, count = left.pop(f"{lift}.bore", None), left.pop(f"{lift}.cylinders", None)
    area = f"{lift}.cylinder.area"
    if bore is None and count is None:
        return []
    if bore is None:
        raise _malformed(f"{lift}.cylinders", f"without {lift}.bore, which it multiplies; tell the bore too")
    if area in left:
        raise _malformed(f"{lift}.bore", f"beside {area}, which it stands for; tell one of the two")
    (diameter, source), (cylinders, _) = (
        _value(f"{lift}.bore", bore, "m"),
        _value(f"{lift}.cylinders", "1" if count is None else count, "1"),
    )
    return [
        (
            area,
            cylinders * pi * diameter**2 / 4.0,
            f"{source}: the bore of {cylinders:g} cylinder{'' if cylinders == 1.0 else 's'}",
        )
    ]


def _malformed(name: str, how: str) -> ForkliftError:
    return ForkliftError("parameter-malformed", f"{name} is told {how}", name=name)


def _points(lift: str, left: dict[str, str]) -> list[tuple[str, tuple[float, ...], str]]:
    text = left.pop(f"{lift}.valve.points", None)
    if text is None:
        return []
    plain, _, source = text.partition("#")
    try:
        pairs = [tuple(map(float, point.split(":"))) for point in plain.split(",")]
        currents, areas = zip(*pairs, strict=True)
    except ValueError:
        raise ForkliftError(
            "parameter-not-a-number",
            f"{lift}.valve.points is told as {text!r}; write pairs current:area in A and m2, with commas",
            name=f"{lift}.valve.points",
            value=text,
        ) from None
    said = source.strip() or "told by its owner"
    return [
        (f"{lift}.{name}", tuple(column), said)
        for name, column in zip(_POINTS, (currents, areas), strict=True)
    ]
