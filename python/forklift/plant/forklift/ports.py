"""Where an unknown input may enter a forklift's equations."""

from __future__ import annotations

from collections.abc import Sequence

from forklift.recordings.channels import LIFTS, Lift

EQUATIONS = {
    "opening": "valve-flow",
    "current": "valve-dynamics",
    "viscosity": "viscosity",
    "preset_pressure": "compensator",
    "bulk_modulus": "bulk-modulus",
    "cylinder_flow": "cylinder-pressure",
    "return_pressure": "tank",
    "friction": "friction",
    "viscous_friction": "friction",
    "dry_friction": "friction",
    "force": "force-balance",
}
"""By port of a lift: the equation it stands in. Those not listed act as one of these does. What acts on the
valve's flow in any way is told at its opening, if recordings do not tell which way."""


def ports(lifts: Sequence[Lift]) -> tuple[str, ...]:
    """Every place on both lifts; a lift at rest takes forces and flows only, as its valve is shut."""
    moving = [f"{lift}.{port}" for lift in LIFTS if lift in lifts for port in EQUATIONS]
    resting = [f"{lift}.{port}" for lift in LIFTS if lift not in lifts for port in ("cylinder_flow", "force")]
    return (*moving, *resting)


def equation(port: str) -> str:
    """The equation that a port stands in; of a channel's sensor, the sensor."""
    return EQUATIONS.get(port.partition(".")[2], "sensor")


def lift_of(port: str) -> Lift | None:
    """The lift that a port, or a channel's sensor, belongs to."""
    return next((lift for lift in LIFTS if port.startswith(f"{lift}.") or f"_{lift}_" in port), None)
