"""A controller for another truck: the same gains, with that truck's own tables."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from forklift.control.controller import Controller, LiftSettings, Number, speed_table
from forklift.plant.forklift.speed_table import speed_to_current, temperature_scaling
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.channels import Lift

TABLE_DEGC = 40.0
"""The middle of the temperatures that a scaling serves."""


def for_truck(
    controller: Controller, truck: Truck | str | Path, *, oil_temperature_degc: float = TABLE_DEGC
) -> Controller:
    """The controller with a truck's own speed tables, and its scaling with temperature where it has one.

    The table is the truck's steady lowering without load turned round (Fri & Fahlén 2017, section 4.3); a, b,
    c and d of (4.8) and (4.9) are those with which that table comes nearest the tables of 20 to 60 °C, where
    the controller scales at all. Gains, feedback and shaper stay; `forklift.control.tune.tune` tunes them on
    the truck.

    Parameters
    ----------
    controller
        Whose other settings are kept.
    truck
        A fitted one, as a rule, or its file's path.
    oil_temperature_degc
        At which the tables hold.

    Raises
    ------
    ForkliftError
        ``"no-steady-state"`` for a truck of which no table can be made; ``"argument-invalid"`` for a
        temperature out of range; those of `Controller` and of `Truck.read`.
    """
    truck = truck_of(truck)
    free = _settings(controller.free, truck, "free", oil_temperature_degc)
    main = _settings(controller.main, truck, "main", oil_temperature_degc)
    name = re.sub(r"[^A-Za-z0-9 _.-]", "_", f"{controller.name} for {truck.name}")
    return replace(controller, name=name[:60], free=free, main=main)


def _settings(before: LiftSettings, truck: Truck, lift: Lift, degc: float) -> LiftSettings:
    numbers = dict(before.numbers)
    if numbers["a"].value or numbers["c"].value:
        scaling = temperature_scaling(speed_to_current(truck, lift, oil_temperature_degc=degc))
        source = f"least squares over truck {truck.name}'s steady states of 20 to 60 degC"
        for name, value in (
            ("a", scaling.a_per_k),
            ("b", scaling.b),
            ("c", 1e3 * scaling.c_a_per_k),
            ("d", 1e3 * scaling.d_a),
        ):
            numbers[name] = Number(value=float(f"{value:.6g}"), source=source)
    table = speed_table(truck, lift, oil_temperature_degc=degc)
    return before.model_copy(update={"numbers": numbers, "table": table})
