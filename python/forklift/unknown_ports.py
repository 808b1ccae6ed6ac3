"""Where an unknown input may enter a forklift's equations, and what an operator knows of a moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forklift.diagnosis.inputs import WIDTH_S
from forklift.estimation.problem import Problem, Sample
from forklift.names import LIFTS, Lift

Floats = NDArray[np.float64]

EQUATIONS = {
    "current": "valve-dynamics",
    "opening": "valve-flow",
    "viscosity": "viscosity",
    "preset_pressure": "compensator",
    "bulk_modulus": "bulk-modulus",
    "cylinder_flow": "cylinder-pressure",
    "return_pressure": "tank",
    "friction": "friction",
    "viscous_friction": "friction",
    "force": "force-balance",
}
"""By port of a lift: the equation it stands in. Those not listed act as one of these does."""


def ports(lifts: Sequence[Lift]) -> tuple[str, ...]:
    """Every place on both lifts; a lift at rest takes forces and flows only, as its valve is shut."""
    moving = [f"{lift}.{port}" for lift in LIFTS if lift in lifts for port in EQUATIONS]
    resting = [f"{lift}.{port}" for lift in LIFTS if lift not in lifts for port in ("cylinder_flow", "force")]
    return (*moving, *resting)


def equation(port: str) -> tuple[str, str | None]:
    """The equation a port, or a channel's sensor, stands in, and its lift."""
    lift, _, name = port.partition(".")
    if name in EQUATIONS:
        return EQUATIONS[name], lift
    return "sensor", next((lift for lift in LIFTS if f"_{lift}_" in port), None)


def respond(problem: Problem, x: Floats, k: int, port: str, centres: Floats) -> Floats:
    """(times, outputs, hats): how recording k answers hats over time at one port."""
    truck = problem.truck_at(x)
    sample = problem.samples[k]
    own = sample.conditions(problem.own(x, k))
    answers = truck.core.responses(sample.case, own, [port], centres, WIDTH_S, substeps=problem.substeps)
    return answers[:, :, 0, :]


def variables(sample: Sample, model: dict[str, Floats], lift: Lift, centres: Floats) -> dict[str, Floats]:
    """What an operator knows at these times of a recording, for what happens on one lift."""
    recording = sample.recording
    time = recording.time_s
    other: Lift = "main" if lift == "free" else "free"

    def at(values: Floats) -> Floats:
        return np.interp(centres, time, values)

    known = {
        "load [kg]": np.full(len(centres), recording.load_kg),
        f"command of the {lift} lift [A]": at(recording[f"current_{lift}_a"]),
        "time since the command moved [s]": at(_since(time, recording[f"current_{lift}_a"])),
    }
    temperature = recording.channels.get("oil_temperature_degc")
    if temperature is not None and np.isfinite(temperature).any():
        known["oil temperature [degC]"] = np.full(len(centres), np.nanmean(temperature))
    for name, words, unit in (("position", "position", "m"), ("pressure", "pressure", "pa")):
        if f"{name}_{lift}_{unit}" in model:
            known[f"{words} of the {lift} lift [{'Pa' if unit == 'pa' else unit}]"] = at(
                model[f"{name}_{lift}_{unit}"]
            )
    for one in (lift, other):
        if f"position_{one}_m" in model:
            speed = np.gradient(model[f"position_{one}_m"], time)
            known[f"speed of the {one} lift [m/s]"] = at(speed)
            known[f"acceleration of the {one} lift [m/s2]"] = at(np.gradient(speed, time))
    return known


def _since(time: Floats, current: Floats) -> Floats:
    """Seconds since the current last moved by a hundredth of an ampere."""
    moved = np.abs(np.diff(current, prepend=current[:1])) > 0.01
    return np.asarray(time - np.maximum.accumulate(np.where(moved, time, time[0])))
