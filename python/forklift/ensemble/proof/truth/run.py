"""Trucks under commands: conditions in, trajectories out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.ensemble.proof.truth import model
from forklift.ensemble.proof.truth.truck import Lift

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TICK_S = 0.02
TOLERANCE = 1e-6  # of a step, in typical sizes
SHORTEST_S = 1e-9
MOST_STEPS = 300
"""Steps a tick, on average over a run: a truck that takes more chatters, and would be at it for an hour."""
FASTEST_M_S = 10.0
"""Of a cylinder: what falls freely from the mast's height is slower. A truck that gets there has a law that
no machine has."""
START_M = (0.98, 1.96)
ZERO_DEGC_K = 273.0  # as the thesis has it


@dataclass
class Condition:
    """One recording: the command [A] of both lifts at each tick, (2, n), held until the next."""

    command: Floats
    load_kg: float
    temperature_degc: float
    warming_k: float = 0.0  # by how much the oil warms up until the end
    start_m: tuple[float, float] = START_M
    trucks: tuple[Lift, Lift] | None = None  # other lifts than the rest's
    values: dict[str, Any] = field(default_factory=dict)  # other values of laws than the rest's


@dataclass
class Trajectory:
    """What a truck did at each tick: (2, n) for both lifts, (n,) for the truck."""

    time_s: NDArray[Any]
    x: Floats
    v: Floats
    p_A: Floats
    fork_height: Floats
    temperature_degc: Floats
    encoder: Floats | None = None  # (2, n) [m], what an encoder sees before its counts

    def until(self, ticks: int) -> Trajectory:
        """The first so many ticks of it."""
        signals = {field.name: getattr(self, field.name) for field in fields(self)}
        kept = {name: signal[..., :ticks] for name, signal in signals.items() if signal is not None}
        return replace(self, **kept)


def simulate(
    trucks: tuple[Lift, Lift],
    laws: Sequence[model.Law],
    conditions: Sequence[Condition],
    tolerance: float = TOLERANCE,
    tick_s: float = TICK_S,
) -> list[Trajectory]:
    """The trajectory under each of the conditions, which need not be equally long; `tick_s` is a tick's
    length. `FloatingPointError` where a truck chatters (steps get too short, or too many) or runs away."""
    from forklift.ensemble.proof.truth.solver import Solver  # its libraries are an extra's

    k = parameters(trucks, laws, conditions)
    last = np.array([one.command.shape[1] for one in conditions]) - 1
    command = np.stack([_longer(one.command, last.max() + 1) for one in conditions], axis=-1)
    late = np.broadcast_to(dead_times(k, laws), (2, len(conditions)))
    warm = np.array([one.temperature_degc for one in conditions]) + ZERO_DEGC_K
    rise = np.array([one.warming_k for one in conditions]) / np.maximum(last, 1)
    start = np.array([one.start_m for one in conditions]).T[:, None]
    y = np.ascontiguousarray(model.at_rest(laws, k, start)[:, 0].T)
    kept = np.empty((last.max() + 1, y.shape[1], len(conditions)))
    kept[0] = y.T
    plant = Solver(laws, k)
    speed = slice(2 * model.STATES.index("v"), 2 * model.STATES.index("v") + 2)
    column, h = np.arange(len(conditions)), np.full(len(conditions), tick_s)
    spent = np.zeros(len(conditions), int)
    for tick in range(int(last.max())):
        running = tick < last[column]
        if not running.all():
            column, y, h, spent = column[running], y[running], h[running], spent[running]
        T = warm[column] + rise[column] * tick
        since = np.zeros(len(column))
        while (since < tick_s * (1.0 - 1e-9)).any():
            # Not beyond the next change of the command, where that is late; of no length where all is done.
            u, until = held(command, tick, since, late[:, column], column, tick_s)
            span = np.minimum(tick_s - since, until)
            plant.advance(
                column, y, np.ascontiguousarray(u.T), T, span, h, spent,
                tolerance=tolerance, shortest=SHORTEST_S, most=int(MOST_STEPS * max(last.max(), 1)),
            )  # fmt: skip
            since = np.where(tick_s - since <= until, tick_s, since + span)
        if not (np.abs(y[:, speed]) < FASTEST_M_S).all():
            raise FloatingPointError(f"a lift moves at {FASTEST_M_S} m/s and more")
        kept[tick + 1][:, column] = y.T
    return [
        _trajectory(kept[: one.command.shape[1], :, n], laws, one, tick_s) for n, one in enumerate(conditions)
    ]


def dead_times(k: dict[str, Floats], laws: Sequence[model.Law]) -> Floats:
    """By how much each lift's command is late [s], (2, recordings) or what broadcasts to that."""
    late = np.zeros((2, 1))
    for law in laws:
        if law.dead_time:
            late = late + k[f"{law.name}.{law.dead_time}"][:, 0]
    return late


def held(
    command: Floats, tick: int, since: Floats, late: Floats, column: Ints, tick_s: float = TICK_S
) -> tuple[Floats, Floats]:
    """The command that was held `late` [s] ago, (2, columns), and for how long it will still be [s].

    Now is `since` [s] after a tick; before its first sample a command is that.
    """
    # Ticks back to the last change that has arrived.
    ago = np.ceil((late - since) / tick_s - 1e-9).astype(int)
    at = np.maximum(tick - np.maximum(ago, 0), 0)
    until = late - (ago - 1) * tick_s - since
    return np.take_along_axis(command[:, :, column], at[:, None], axis=1)[:, 0], until.min(axis=0)


def parameters(
    trucks: tuple[Lift, Lift], laws: Sequence[model.Law], conditions: Sequence[Condition]
) -> dict[str, Floats]:
    """All parameters as arrays over (lift, 1, recording), or what broadcasts to that."""
    each = [one.trucks or trucks for one in conditions]
    k: dict[str, Floats] = {}
    for name in trucks[0]:
        values = np.array([[lifts[n][name] for lifts in each] for n in range(2)])
        k[name] = np.moveaxis(values, 2, 0)[:, :, None] if values.ndim == 3 else values[:, None]
    load = np.array([one.load_kg for one in conditions])
    k["load"], k["m"] = load[None, None], k["m"] + load
    current, area = k.pop("current"), k.pop("area")
    k["knot"], k["knot_width"], k["first_area"] = current[:-1], np.diff(current, axis=0), area[0]
    k["knot_slope"] = np.diff(area, axis=0) / k["knot_width"]
    for law in laws:
        for name in law.values:
            key = f"{law.name}.{name}"
            k[key] = np.stack([_pair(one.values.get(key, law.values[name])) for one in conditions], axis=-1)
            k[key] = k[key][:, None]
    return k


def _pair(value: Any) -> Floats:
    """A value of both lifts; of one, it is (value, 0) or (0, value)."""
    return np.broadcast_to(np.asarray(value, float), 2)


def _longer(command: Floats, ticks: int) -> Floats:
    return np.pad(command, ((0, 0), (0, ticks - command.shape[1])), mode="edge")


def _trajectory(y: Floats, laws: Sequence[model.Law], condition: Condition, tick_s: float) -> Trajectory:
    s = model.split(np.moveaxis(y, 1, 0), laws)
    n = len(y)
    height = 2.0 * s.x[0] + 2.0 * s.x[1]
    encoder = np.stack([2.0 * s.x[0], s.x[1]])
    for law in laws:
        height = height + sum(factor * getattr(s, state) for state, factor in law.shown)
        for state, lift, factor in law.seen:
            encoder[lift] = encoder[lift] + factor * getattr(s, state)
    warm = condition.temperature_degc + condition.warming_k * np.arange(n) / max(1, n - 1)
    return Trajectory(np.arange(n) * tick_s, s.x, s.v, s.p_A, height, warm, encoder)


def on(lift: str, value: float) -> tuple[float, float]:
    """The value at one lift, nothing at the other."""
    return (value if lift == "free" else 0.0, value if lift == "main" else 0.0)
