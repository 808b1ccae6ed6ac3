"""What an operator knows of a moment of a recording: the variables on which something unknown may depend."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.forklift.curve_tables import per_output
from forklift.plant.forklift.curve_tables import variables as shape_variables
from forklift.recordings.channels import LIFTS, Lift
from forklift.recordings.recording import Recording

LONGEST_S = 10.0
"""Times since something are told up to this, as the core's free shapes have them."""
MOVED_M, MOVED_A = 0.005, 0.01
"""By how much a cylinder, or a command, must have moved to have moved at all; likewise."""


def variables(
    recording: Recording, model: Mapping[str, Floats], lift: Lift, oil_temperature_degc: float
) -> dict[str, Floats]:
    """Each variable at every time of a recording, for what happens on one lift; by the names of `words`.

    Those of `forklift.plant.forklift.free_curve.variables`, as far as they are known, and the accelerations.

    Parameters
    ----------
    model
        (times,) by channel, as the model has them: of channels that were measured.
    oil_temperature_degc
        The recording's mean, or what was entered.
    """
    time, current = recording.time_s, recording[f"current_{lift}_a"]
    other = next(one for one in LIFTS if one != lift)
    known = {
        "load": np.full(len(time), recording.load_kg),
        "command": current,
        "other_command": recording[f"current_{other}_a"],
    }
    known["oil_temperature"] = np.full(len(time), oil_temperature_degc)
    known["time_since_command"] = _since(time, current, MOVED_A)
    positions = {
        one: model[f"position_{one}_m"] * per_output("position", one)
        for one in LIFTS
        if f"position_{one}_m" in model
    }
    if f"pressure_{lift}_pa" in model:
        known["pressure"] = model[f"pressure_{lift}_pa"]
    for one, position in positions.items():
        velocity = np.gradient(position, time)
        if one == lift:
            known |= {"position": position, "velocity": velocity, "speed": np.abs(velocity)}
            known["acceleration"] = np.gradient(velocity, time)
            known["time_at_rest"] = _since(time, position, MOVED_M)
        else:
            known |= {"other_velocity": velocity, "other_acceleration": np.gradient(velocity, time)}
    return known


def words(name: str, lift: Lift) -> tuple[str, str]:
    """What a variable is, in words, and its unit."""
    accelerations = {
        "acceleration": f"acceleration of the {lift} lift's cylinder",
        "other_acceleration": "acceleration of the other lift's cylinder",
    }
    if name in accelerations:
        return accelerations[name], "m/s2"
    known = shape_variables()[name]
    return known["meaning"].partition(",")[0], known["unit"]


def _since(time: Floats, values: Floats, moved: float) -> Floats:
    """Seconds since `values` last moved away by `moved` from where they then were; at most `LONGEST_S`."""
    since = np.empty(len(time))
    began, reference = float(time[0]) - LONGEST_S, float(values[0])
    for k, value in enumerate(values):
        if abs(value - reference) >= moved:
            began, reference = float(time[k]), float(value)
        since[k] = time[k] - began
    return np.minimum(since, LONGEST_S)
