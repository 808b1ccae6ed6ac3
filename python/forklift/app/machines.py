"""What a command is asked to work on: a truck or a machine of one's own, and its recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from forklift.app.options import THESIS, not_beside


def asked_for(
    folder: Path, truck: str | None, machine: Path | None, temperature: float | None = None
) -> tuple[Any, Any, dict[str, Any]]:
    """The machine, the recordings of a folder, and the conditions that these do not tell: a verb's arguments.

    Raises
    ------
    ForkliftError
        ``"option-not-wanted"`` for a truck beside a machine; those of `Truck.read` and `Campaign.read`, or
        of `forklift.plant.campaign`.
    """
    from forklift.plant import campaign as own
    from forklift.plant.forklift.truck import Truck
    from forklift.plant.subjects import subject
    from forklift.recordings.campaign import Campaign

    conditions = {} if temperature is None else {"oil_temperature_degc": temperature}
    if machine is not None:
        not_beside(machine, truck=truck)
        plant = own.machine(machine)
        return subject(plant, origin=str(machine)), own.read(folder, plant), conditions
    return Truck.read(truck or THESIS), Campaign.read(folder), conditions
