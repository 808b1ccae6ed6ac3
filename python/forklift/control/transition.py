"""From the main lift to the free lift: how the total speed dips and jumps while one takes over from the
other.

Source: Fri & Fahlén (2017), sections 4.6.1 and 5.6.3, (4.10), (4.11); Figure 5.18 and Appendix D.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.control.closed_loop import DELAY_TICKS, LOADS_KG, TICK_S, Integers, Lowered, Lowering, lower
from forklift.control.controller import Controller
from forklift.plant.forklift.truck import Truck

TEMPERATURES_DEGC = (20.0, 60.0)
LEVELS_MM_S = (300, 500)
"""Speeds asked for."""
START_M = (0.98, 1.0)
"""Cylinder positions at the start, free and main [m]: the free lift up, the main lift half way."""
BEFORE_S, AFTER_S = 1.0, 1.0
"""How long the speeds before and after are averaged."""
REST_M_S = 2e-3
"""A lift slower than this stands."""
SETTLED_S = 1.0
"""From the main lift's standstill until the speed after counts."""


@dataclass(frozen=True)
class Transition:
    """One controller's transition at an operating point; NaN where it does not come to its end.

    Attributes
    ----------
    level_m_s
        Asked for.
    before_m_s, after_m_s
        Mean total speed in the second before the references change, and after the main lift stands.
    dip_m_s, spike_m_s
        How far the total speed falls below the lesser of the two in between, and how far it rises above the
        greater. So a controller that is slow throughout is not blamed for that.
    duration_s
        From the references' change to the main lift's standstill.
    """

    controller: str
    oil_temperature_degc: float
    load_kg: float
    level_m_s: float
    before_m_s: float
    after_m_s: float
    dip_m_s: float
    spike_m_s: float
    duration_s: float


def request(level_mm_s: int) -> Integers:
    """Half a second of rest, then one speed until both lifts are down by some 2.5 m."""
    ticks = round((2.2e3 / level_mm_s + 4.0) / TICK_S)
    return np.concatenate([np.zeros(25, np.int32), np.full(ticks, level_mm_s, np.int32)])


def transitions(
    controllers: Sequence[Controller],
    truck: Truck,
    *,
    later_ticks: int = 0,
    seed: int = 0,
) -> list[Transition]:
    """Each controller at each speed, temperature and load, both lifts simulated.

    Parameters
    ----------
    later_ticks
        By how much the delay is longer than the free lift's.

    Raises
    ------
    ForkliftError
        As `forklift.control.closed_loop.lower`.
    """
    return [measured(*each) for each in crossings(controllers, truck, later_ticks=later_ticks, seed=seed)]


def crossings(
    controllers: Sequence[Controller], truck: Truck, *, later_ticks: int = 0, seed: int = 0
) -> Iterator[tuple[Lowering, Lowered, int, int]]:
    """The lowerings of `transitions` themselves, as `measured` takes them, controller by controller."""
    delay = DELAY_TICKS["free"] + later_ticks
    for level in LEVELS_MM_S:
        asked = request(level)
        points = [(t, load) for t in TEMPERATURES_DEGC for load in LOADS_KG]
        lowerings = [
            Lowering(truck, one, load, t, asked, start_m=START_M, delay_ticks=delay, stream=k)
            for one in controllers
            for k, (t, load) in enumerate(points)
        ]
        run = lower(lowerings, seed=seed)
        yield from ((one, run, place, level) for place, one in enumerate(lowerings))


def span(run: Lowered, place: int, level_mm_s: int) -> tuple[int, int]:
    """The ticks at which the references begin to change, and at which the main lift stands.

    -1 of what never comes: a level that is not reached, a lift that does not stand.
    """
    level = 1e-3 * level_mm_s
    main, free = run.reference_m_s["main"][place], run.reference_m_s["free"][place]
    reached = _first(main >= level - 1.5e-3)
    changed = _first((free[reached:] > 0.0) | (main[reached:] < level - 3e-3)) if reached >= 0 else -1
    if changed < 0:
        return -1, -1
    first = reached + changed
    stands = _first(run.speed_m_s["main"][place][first:] < REST_M_S)
    return first, first + stands if stands >= 0 else -1


def _first(true: NDArray[np.bool_]) -> int:
    """The first place that is true; -1 if none is."""
    return int(np.argmax(true)) if true.any() else -1


def measured(one: Lowering, run: Lowered, place: int, level_mm_s: int) -> Transition:
    """Dip and spike of one of the lowerings."""
    total: Floats = run.speed_m_s["free"][place] + run.speed_m_s["main"][place]
    first, last = span(run, place, level_mm_s)
    settled = last + round(SETTLED_S / TICK_S)
    if last < 0 or settled >= len(total):
        return Transition(
            one.controller.name,
            one.oil_temperature_degc,
            one.load_kg,
            1e-3 * level_mm_s,
            *[float("nan")] * 5,
        )
    before = float(total[first - round(BEFORE_S / TICK_S) : first].mean())
    after = float(total[settled : settled + round(AFTER_S / TICK_S)].mean())
    between = total[first : settled + round(AFTER_S / TICK_S) // 2]
    return Transition(
        one.controller.name,
        one.oil_temperature_degc,
        one.load_kg,
        1e-3 * level_mm_s,
        before,
        after,
        max(0.0, min(before, after) - float(between.min())),
        max(0.0, float(between.max()) - max(before, after)),
        (last - first) * TICK_S,
    )


def transition_table(rows: Sequence[Transition]) -> str:
    """Dip and spike, the controllers of an operating point one under the other."""
    wide = max(12, 2 + max((len(row.controller) for row in rows), default=0))
    lines = [
        f"{'m/s':<5}{'degC':>5}{'kg':>6}  {'controller':<{wide}}{'before':>8}{'after':>8}"
        f"{'dip':>8}{'spike':>8}  [m/s]{'lasts [s]':>11}"
    ]
    for row in sorted(rows, key=lambda r: (r.level_m_s, r.oil_temperature_degc, r.load_kg)):
        place = f"{row.level_m_s:<5.1f}{row.oil_temperature_degc:>5.0f}{row.load_kg:>6.0f}"
        numbers = (
            f"{row.before_m_s:>8.3f}{row.after_m_s:>8.3f}{row.dip_m_s:>8.3f}{row.spike_m_s:>8.3f}"
            f"       {row.duration_s:>11.2f}"
        )
        lines.append(f"{place}  {row.controller:<{wide}}{numbers.replace('nan', '  —')}")
    return "\n".join(lines)
