"""Whatever can be diagnosed, as the protocol has it: a truck, a plant of one's own, or any machine."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from pathlib import Path
from typing import Any

from forklift.base import arguments
from forklift.base.errors import ForkliftError
from forklift.plant.forklift.model import LOAD_ACCURACY
from forklift.plant.forklift.simulate import check_temperature
from forklift.plant.forklift.subject import ForkliftSubject
from forklift.plant.forklift.truck import Truck
from forklift.plant.own import PlantSubject
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.plant.subject import Subject

CONDITIONS = ("oil_temperature_degc", "load_width_kg")
"""What `subject` may be told of recordings of a truck that do not tell it."""


def named(name: str | Path) -> Truck:
    """The truck of a name or a file.

    Raises
    ------
    ForkliftError
        As `Truck.read`.
    """
    return Truck.read(name)


def is_machine(given: Any) -> bool:
    """Whether it can be diagnosed."""
    return isinstance(given, Truck | Plant) or hasattr(given, "examined")


def subject(
    machine: Any,
    *,
    candidates: Sequence[Recording] = (),
    origin: str = "",
    doubts: bool = True,
    oil_temperature_degc: float | None = None,
    load_width_kg: float = 0.0,
) -> Subject:
    """The machine behind the protocol.

    Parameters
    ----------
    machine
        A `Truck`, a `Plant`, or what has the protocol already.
    candidates
        Of a plant: recordings that could be made.
    origin
        Of a plant: the file it came from.
    doubts
        Of a truck: whether loads that were entered are as good as a scale only, and the dither that no
        recording shows is unknown; else loads are exact, and there is no dither.
    oil_temperature_degc
        Of a truck: for recordings without an oil temperature [°C].
    load_width_kg
        Of a truck: standard deviation of each entered load [kg], if it is more.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``.
    """
    if isinstance(machine, Truck):
        check_temperature(oil_temperature_degc)
        given = None if oil_temperature_degc is None else float(oil_temperature_degc)
        if not 0.0 <= arguments.number("load_width_kg", load_width_kg) < inf:
            raise ForkliftError(
                "argument-invalid",
                f"the loads' standard deviation is {load_width_kg:g} kg; give zero or more",
                name="load_width_kg",
                value=load_width_kg,
                lower=0.0,
                unit="kg",
            )
        return ForkliftSubject(
            machine,
            oil_temperature_degc=given,
            load_width_kg=float(load_width_kg),
            load_accuracy=LOAD_ACCURACY if doubts else 0.0,
            doubts=doubts,
        )
    if oil_temperature_degc is not None or load_width_kg:
        name = "load_width_kg" if load_width_kg else "oil_temperature_degc"
        raise ForkliftError(
            "argument-invalid", f"{name} is a truck's; a machine of your own has no such condition", name=name
        )
    if isinstance(machine, Plant):
        return PlantSubject(machine, tuple(candidates), origin)
    if is_machine(machine):
        return machine  # type: ignore[no-any-return]
    raise ForkliftError(
        "argument-invalid",
        f"{type(machine).__name__} is no machine; give a Truck, a Plant, or a machine with the protocol of "
        "forklift.plant.subject",
        name="machine",
    )
