"""How a recording's lifts moved, and how their pressures answered: what every check of it asks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from forklift import _core
from forklift.base.arrays import Floats
from forklift.base.derivative import derivative
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.plant.forklift.phases import shut_current
from forklift.recordings.channels import LIFTS, Lift, commanded
from forklift.recordings.noise import white_noise

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

Mask = NDArray[np.bool_]

LOOKED_AT = tuple(
    f"{what}_{lift}_{unit}" for what, unit in (("position", "m"), ("pressure", "pa")) for lift in LIFTS
)
LOOKED_AT += ("fork_height_m",)
"""The channels that the checks look at together."""
SPAN_S = 0.1
"""Half the time over which a lift's motion is told: ten encoder counts at 0.1 m/s, and short beside the
0.4 s of its oscillation."""
MOVING_M_S = 0.02
"""Speed on the lift's own sensor from which it moves: two counts of the thesis's encoder in 2 `SPAN_S`."""
LEAST_TRAVEL_M = 10 * _core.ENCODER_COUNT_M
"""What a lift must have moved to have moved at all: ten counts of the thesis's encoder."""
REST_SAMPLES = 5
"""Fewest samples at rest that tell a static pressure."""


def other(lift: Lift) -> Lift:
    """The other lift."""
    return LIFTS[1 - LIFTS.index(lift)]


def measured(recording: Recording, channel: str) -> Floats | None:
    """The channel's samples; None if it is not there or all are missing."""
    values = recording.channels.get(channel)
    return values if values is not None and bool(np.isfinite(values).any()) else None


def position(recording: Recording, lift: Lift) -> Floats | None:
    """What the lift's encoder read [m]."""
    return measured(recording, f"position_{lift}_m")


def pressure(recording: Recording, lift: Lift) -> Floats | None:
    """The lift's cylinder pressure [Pa]."""
    return measured(recording, f"pressure_{lift}_pa")


def height(recording: Recording) -> Floats | None:
    """The forks' height [m]."""
    return measured(recording, "fork_height_m")


def span(values: Floats | None) -> float:
    """Greatest less least finite sample; 0 where there is none."""
    return 0.0 if values is None else float(np.nanmax(values) - np.nanmin(values))


def travel(recording: Recording, lift: Lift) -> float | None:
    """How far the lift moved [m on its own sensor], by its encoder or, alone, by the height; None:
    unidentifiable."""
    own = position(recording, lift)
    if own is not None:
        return span(own)
    forks = height(recording) if commanded(recording.lift) == (lift,) else None
    return None if forks is None else span(forks) / FORKS_PER_SENSOR[lift]


def is_open(recording: Recording, truck: Truck, lift: Lift) -> Mask:
    """Whether the lift's valve is commanded open, by the truck's area table."""
    return np.asarray(recording[f"current_{lift}_a"] > shut_current(truck, lift))


def moving(recording: Recording, lift: Lift) -> Mask:
    """Whether the lift moves at each sample, by its encoder and, if it alone is commanded, by the height."""
    found = _moves(recording, position(recording, lift), MOVING_M_S)
    if commanded(recording.lift) == (lift,):
        found |= _moves(recording, height(recording), FORKS_PER_SENSOR[lift] * MOVING_M_S)
    return found


def speed(recording: Recording, lift: Lift) -> Floats | None:
    """Lowering speed on the lift's own sensor [m/s]; of a lift alone without an encoder, from the height."""
    own = position(recording, lift)
    if own is not None:
        return -derivative(recording.time_s, own)
    forks = height(recording) if commanded(recording.lift) == (lift,) else None
    return None if forks is None else -derivative(recording.time_s, forks) / FORKS_PER_SENSOR[lift]


def at_rest(recording: Recording, truck: Truck) -> slice:
    """The samples before any valve opens; all, if those are too few to tell a pressure."""
    opened = np.flatnonzero(np.any([is_open(recording, truck, lift) for lift in LIFTS], axis=0))
    first = int(opened[0]) if len(opened) else len(recording)
    return slice(0, first if first >= REST_SAMPLES else len(recording))


def answer(values: Floats | None) -> float:
    """How much a pressure varies, in units of its white noise: 1 at rest, tens in motion."""
    if values is None or span(values) == 0.0:
        return 0.0
    noise = white_noise([values])
    return float(np.nanstd(values)) / noise if noise > 0.0 else 0.0


def runs(values: Floats) -> list[tuple[int, int]]:
    """First and last place of each run of equal samples, two or more; a missing sample ends a run."""
    same = np.r_[False, values[1:] == values[:-1], False]
    edges = np.flatnonzero(np.diff(same.astype(np.int8)))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]


def typical_current(recordings: Sequence[Recording], truck: Truck, lift: Lift) -> float:
    """The median of the currents that open the lift's valve [A]; infinite if none does.

    It is no less than what opens it in any truck of the make, the first knot of its table that has an area:
    between that and the one before a valve may still be shut.
    """
    opened = [found[f"current_{lift}_a"][is_open(found, truck, lift)] for found in recordings]
    pooled = np.concatenate(opened) if opened else np.zeros(0)
    currents, areas = (np.asarray(truck.values[f"{lift}.valve.table_{name}"]) for name in ("current", "area"))
    surely = float(np.min(currents[areas > 0.0], initial=np.inf))
    return max(float(np.median(pooled)), surely) if len(pooled) else float("inf")


def lowest(recordings: Sequence[Recording], truck: Truck, lift: Lift) -> float:
    """Where the lift may stand on its stop [m on its own sensor]: up to a little above the lowest reached."""
    columns = [position(found, lift) for found in recordings]
    seen = [float(np.nanmin(x)) for x in columns if x is not None and span(x) >= LEAST_TRAVEL_M]
    ratio = 2.0 if lift == "free" else 1.0
    stop = ratio * float(truck.values[f"{lift}.cylinder.stroke_lower"])  # type: ignore[arg-type]
    return max(min(seen, default=stop), stop) + LEAST_TRAVEL_M


def _moves(recording: Recording, values: Floats | None, least_m_s: float) -> Mask:
    found = np.zeros(len(recording), np.bool_)
    if values is None or len(recording) < 3:
        return found
    k = min(max(1, round(SPAN_S * recording.sample_rate_hz)), (len(recording) - 1) // 2)
    time = recording.time_s
    rate = np.abs(values[2 * k :] - values[: -2 * k]) / (time[2 * k :] - time[: -2 * k])
    found[k:-k] = rate >= least_m_s
    return found
