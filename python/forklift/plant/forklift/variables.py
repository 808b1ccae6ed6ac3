"""What an operator knows of a moment of a recording: the variables on which something unknown may depend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import solve_banded

from forklift.base.arrays import Floats
from forklift.plant.forklift.curve_tables import per_output
from forklift.plant.forklift.curve_tables import variables as shape_variables
from forklift.recordings.channels import LIFTS, Lift
from forklift.recordings.clocks import is_even
from forklift.recordings.recording import Recording

LONGEST_S = 10.0
"""Times since something are told up to this, as the core's free shapes have them."""
MOVED_M, MOVED_A = 0.005, 0.01
"""By how much a cylinder, or a command, must have moved to have moved at all; likewise."""


LAGS_S = (0.1, 0.4, 1.6, 6.4)
"""Of the past [s]: from a hat of the located input to a lowering, each four times the one before. A step that
is forgotten with a time constant up to twice or half as long is nearly as well followed: e^(-t/T) and
e^(-t/2T) have a correlation of √8/3."""
REMEMBERED = ("pressure", "command", "position", "speed")
"""The variables whose past may act: hoses and profiles give way late; coils, grease and oil warm."""


@dataclass(frozen=True)
class Past:
    """A variable as it was: after a lag of order one; or, of one that `fades`, what it has changed since."""

    variable: str
    lag_s: float
    fades: bool

    @property
    def name(self) -> str:
        return (
            f"{self.variable}_{'change_' if self.fades else ''}{self.lag_s:g}_s{'' if self.fades else '_ago'}"
        )

    def of(self, values: Floats, behind: Floats) -> Floats:
        """(times,) of it, from the variable's values and how far its lag is behind them."""
        return behind if self.fades else values - behind


def lagging(time: Floats, values: Floats, lag_s: float) -> Floats:
    """(times,) how far a lag of order one is behind values that were at rest before: exactly for straight
    lines from sample to sample."""
    tick = (time[-1] - time[0]) / max(len(time) - 1, 1)
    ticks = tick if is_even(time) else np.diff(time, prepend=time[0] - tick)
    kept = np.exp(-ticks / lag_s)
    steps = np.diff(values, prepend=values[0]) * lag_s * (1.0 - kept) / ticks
    # each is `kept` of the one before, and its step; the last row stands a column before its own
    bands = np.array([np.ones(len(steps)), -np.roll(np.broadcast_to(kept, len(steps)), -1)])
    behind: Floats = solve_banded((1, 0), bands, steps, check_finite=False)
    return behind


PAST: Mapping[str, Past] = {
    one.name: one for one in (Past(*each) for each in product(REMEMBERED, LAGS_S, (False, True)))
}
"""By name: what a free curve may be a function of besides the variables of the moment."""


def variables(
    recording: Recording, model: Mapping[str, Floats], lift: Lift, oil_temperature_degc: float
) -> dict[str, Floats]:
    """Each variable at every time of a recording, for what happens on one lift; by the names of `words`.

    Those of `forklift.plant.forklift.free_curve.variables`, as far as they are known, the accelerations, and
    what is of the `PAST`.

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
    behind = {
        (name, lag_s): lagging(time, known[name], lag_s)
        for name, lag_s in product(REMEMBERED, LAGS_S)
        if name in known
    }
    past = {
        name: one.of(known[one.variable], behind[one.variable, one.lag_s])
        for name, one in PAST.items()
        if one.variable in known
    }
    return known | past


def words(name: str, lift: Lift) -> tuple[str, str]:
    """What a variable is, in words, and its unit."""
    accelerations = {
        "acceleration": f"acceleration of the {lift} lift's cylinder",
        "other_acceleration": "acceleration of the other lift's cylinder",
    }
    if name in accelerations:
        return accelerations[name], "m/s2"
    if past := PAST.get(name):
        of, unit = words(past.variable, lift)
        return (
            f"change of the {of} in {past.lag_s:g} s" if past.fades else f"{of} {past.lag_s:g} s ago"
        ), unit
    known = shape_variables()[name]
    return known["meaning"].partition(",")[0], known["unit"]


def _since(time: Floats, values: Floats, moved: float) -> Floats:
    """Seconds since `values` last moved away by `moved` from where they then were; at most `LONGEST_S`."""
    since = np.empty(len(time))
    began, reference = float(time[0]) - LONGEST_S, float(values[0])
    for k, (value, at) in enumerate(zip(values.tolist(), time.tolist(), strict=True)):
        if abs(value - reference) >= moved:
            began, reference = at, value
        since[k] = at - began
    return np.minimum(since, LONGEST_S)
