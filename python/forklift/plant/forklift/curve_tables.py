"""Where a free curve may act, and over what, by the names of the core's tables."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from forklift import _core
from forklift.recordings.channels import Lift

if TYPE_CHECKING:
    from forklift._core import PortSpec, ShapeVariable

COEFFICIENTS = 7
"""Cubic B-splines on four equal intervals."""
FINE = 40
"""Cubic B-splines on 37 equal intervals: what repeats along the stroke has several of them in each period."""
IDS = {COEFFICIENTS: "free_shape", FINE: "fine_shape"}
"""By the number of coefficients: the effect of the catalogue that has them."""


@cache
def ports() -> dict[str, PortSpec]:
    """Where a shape may act, in the order in which its parameter ``port`` counts them."""
    return {spec["name"]: spec for spec in _core.port_table()}


@cache
def variables() -> dict[str, ShapeVariable]:
    """What a shape may be a function of, in the order in which its parameter ``variable`` counts them.

    Positions and velocities are the cylinder's. A variable's ``outputs`` say, by the lift that has the shape,
    which output shows it, and how much of it one unit of that output is.
    """
    return {spec["name"]: spec for spec in _core.shape_variables()}


def per_output(name: str, lift: Lift) -> float:
    """How much of a variable one unit of the output that shows it is."""
    return float(variables()[name]["outputs"][lift][1])
