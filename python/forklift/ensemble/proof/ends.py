"""How far recordings go: until shortly before a commanded lift meets the end of its stroke."""

from __future__ import annotations

import numpy as np

from forklift.ensemble.proof.draw import Draw
from forklift.ensemble.proof.truth import run
from forklift.ensemble.proof.truth.truck import LIFTS

END_M = 0.03
CUSHION_END_M = 0.005
SHORTEST_S = 3.0


def end_m(given: Draw) -> float:
    """How near to the end of its stroke a cylinder comes: nearer where what is concealed acts there."""
    return CUSHION_END_M if "end_cushion" in given.concealed else END_M


def lifts_of(commanded: str) -> tuple[str, ...]:
    """Those that ``free``, ``main`` or ``both`` moves."""
    return LIFTS if commanded == "both" else (commanded,)


def ticks_before(one: run.Trajectory, commanded: str, end: float) -> int:
    """Ticks until a commanded lift is within `end` [m] of the end of its stroke."""
    met = np.flatnonzero((one.x[[LIFTS.index(lift) for lift in lifts_of(commanded)]] < end).any(axis=0))
    return int(met[0]) if len(met) else len(one.time_s)


def recorded_ticks(one: run.Trajectory, commanded: str, end: float) -> int:
    """The same, but no recording is shorter than three seconds."""
    return min(max(ticks_before(one, commanded, end), round(SHORTEST_S / run.TICK_S)), len(one.time_s))
