"""How well a speed follows its reference: the measures of Tables 5.6 and 5.7 and of sections 5.4 and 5.6.

Speeds are the forks', downward positive [m/s].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats

TOTAL_DELAY_S = 0.16
"""From current to speed, section 4.5.2."""
WINDOW_S = 0.8
"""The end of a plateau, in which the speed counts as steady: at least one period of the slowest swing, 1.3
Hz."""
LIMIT_M_S = 0.6
"""The speed never to be exceeded in steady state, section 1.1."""


def nrmse_percent(reference: Floats, speed: Floats) -> float:
    """(3.40): 100 (1 − ‖r − v‖ / ‖r − mean(r)‖), of the reference's own spread; 100 is a perfect answer.

    Parameters
    ----------
    reference, speed
        (ticks,) r and v [m/s].
    """
    return float(
        100.0 * (1.0 - np.linalg.norm(reference - speed) / np.linalg.norm(reference - reference.mean()))
    )


def delayed(reference: Floats, tick_s: float) -> Floats:
    """The reference (ticks,) later by `TOTAL_DELAY_S`, in whole ticks of `tick_s`: what a perfect answer can
    be that does not know it ahead."""
    ticks = round(TOTAL_DELAY_S / tick_s)
    return np.concatenate([np.full(ticks, reference[0]), reference[: len(reference) - ticks]])


@dataclass(frozen=True)
class Plateau:
    """The steady end of a plateau of the request.

    Attributes
    ----------
    start, stop
        Ticks.
    wanted_m_s, mean_m_s
        Speed asked for, and its mean.
    oscillation_m_s
        Half of what lies between the least and the greatest speed, counted from the straight line through
        them (least squares): a speed that drifts does not swing.
    """

    start: int
    stop: int
    wanted_m_s: float
    mean_m_s: float
    oscillation_m_s: float

    @property
    def error_percent(self) -> float:
        """Of the mean, of the speed asked for."""
        return 100.0 * (self.mean_m_s - self.wanted_m_s) / self.wanted_m_s


def swing(speed: Floats) -> float:
    """Half of what lies between the least and the greatest speed (ticks,) [m/s], counted from their straight
    line."""
    time = np.arange(len(speed)) - (len(speed) - 1) / 2.0
    slope = float(time @ speed) / float(time @ time)
    return float(np.ptp(speed - slope * time)) / 2.0


def plateaus(request_mm_s: NDArray[np.int32], speed: Floats, tick_s: float) -> list[Plateau]:
    """The steady end of each plateau of a request above zero that lasts two windows or more.

    The ramp takes the first of the two. The windows are of `WINDOW_S`.

    Parameters
    ----------
    request_mm_s
        (ticks,) Lowering speed of the forks asked for.
    speed
        (ticks,) Theirs [m/s].
    tick_s
        Of the control loop.
    """
    window, late = round(WINDOW_S / tick_s), round(TOTAL_DELAY_S / tick_s)
    jumps = np.flatnonzero(np.diff(request_mm_s)) + 1
    found = []
    for start, stop in zip([0, *jumps], [*jumps, len(request_mm_s)], strict=True):
        if request_mm_s[start] <= 0 or stop - start < 2 * window:
            continue
        last = min(stop + late // 2, len(speed))
        part = speed[last - window : last]
        found.append(
            Plateau(
                last - window,
                last,
                float(request_mm_s[start]) * 1e-3,
                float(part.mean()),
                swing(part),
            )
        )
    return found


@dataclass(frozen=True)
class Breach:
    """A steady speed above the limit: when, and how much."""

    time_s: float
    speed_m_s: float


def breaches(plateau_list: list[Plateau], tick_s: float) -> list[Breach]:
    """Every plateau of which the mean speed is above the limit."""
    return [Breach(p.start * tick_s, p.mean_m_s) for p in plateau_list if p.mean_m_s > LIMIT_M_S]
