"""The phases of a lowering, told from its command: where in the motion a misfit lies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.plant.forklift.commands import steps_to_current
from forklift.recordings.channels import commanded

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.channels import Lift
    from forklift.recordings.recording import Recording


PHASES = ("start", "step change", "steady", "stop", "hold")

RESTLESS = ("start", "stop", "step change", "steady", "hold")
"""The same, furthest from rest first."""

IN_WORDS = {
    "start": "starts",
    "step change": "step changes",
    "steady": "steady lowering",
    "stop": "stops",
    "hold": "holding still",
}
"""A phase as a sentence says it."""

TRANSIENT_S = 0.6
"""How long a transient is counted after its cause: one and a half of the oscillation's periods, which are
about 0.4 s (Fri & Fahlén 2017, section 4.5.2)."""


def phases(time_s: Floats, current: Floats, shut_below: float) -> NDArray[np.intp]:
    """The phase of each sample, an index into `PHASES`.

    After the valve opened: *start*; after its current moved while open: *step change*; else open: *steady*;
    after it shut: *stop*; else shut: *hold*. "After" is for `TRANSIENT_S`.

    Parameters
    ----------
    time_s, current
        (n,) [s] and (n,) [A] of one valve.
    shut_below
        Current up to which the valve is shut [A], see `shut_current`.
    """
    is_open = current > shut_below
    step = 0.5 * float(steps_to_current(np.array([1]))[0])
    moved = np.abs(np.diff(current, prepend=current[:1])) > step
    opened = is_open & ~np.r_[False, is_open[:-1]]
    shut = ~is_open & np.r_[False, is_open[:-1]]
    after = {
        name: _recently(time_s, event) for name, event in (("open", opened), ("move", moved), ("shut", shut))
    }
    names = np.where(
        is_open,
        np.where(after["open"], "start", np.where(after["move"], "step change", "steady")),
        np.where(after["shut"], "stop", "hold"),
    )
    return np.array([PHASES.index(name) for name in names])


def shut_current(truck: Truck, lift: Lift) -> float:
    """The greatest current of the truck's area table at which the valve is still shut [A]."""
    current = np.asarray(truck.values[f"{lift}.valve.table_current"])
    area = np.asarray(truck.values[f"{lift}.valve.table_area"])
    shut = current[area <= truck.values[f"{lift}.valve.A_min"]]
    return float(shut.max()) if len(shut) else 0.0


def of_recording(recording: Recording, truck: Truck) -> dict[str, NDArray[np.intp]]:
    """The phase of each sample of a recording, by measured channel.

    A lift's channels have the phase of its own command; those of a lift at rest, and the fork height, have
    that of the lift that moves, and where both do, the one that is furthest from rest.
    """
    moving = commanded(recording.lift)
    own = {
        lift: phases(recording.time_s, recording[f"current_{lift}_a"], shut_current(truck, lift))
        for lift in moving
    }
    rank = np.array([RESTLESS.index(phase) for phase in PHASES])
    back = np.argsort(rank)
    shared = back[np.min([rank[found] for found in own.values()], axis=0)]
    return {
        channel: next((own[lift] for lift in moving if f"_{lift}_" in channel), shared)
        for channel in recording.channels
    }


def _recently(time_s: Floats, event: NDArray[np.bool_]) -> NDArray[np.bool_]:
    last = np.maximum.accumulate(np.where(event, time_s, -np.inf))
    return np.asarray(time_s - last <= TRANSIENT_S)
