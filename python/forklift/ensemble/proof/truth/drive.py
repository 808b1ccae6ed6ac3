"""Commands: what an engineer records on purpose, and what a driver does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STEP_A = 1.75 / 255  # of the control unit, section 3.5
LOW_PASS_S = 0.053  # first order, 3 Hz
REST_TICKS = 50  # at first the valves are shut for a second
KINDS = ("prms", "stairs", "driver")


def command(kind: str, random: np.random.Generator, ticks: int, tick_s: float) -> Floats:
    """The current of one valve [A], (ticks,), after the control unit's low-pass and steps."""
    wish = {"prms": _prms, "stairs": _stairs, "driver": _driver}[kind](random, ticks - REST_TICKS)
    wish = np.concatenate([np.zeros(REST_TICKS), wish])
    keep, now, out = np.exp(-tick_s / LOW_PASS_S), 0.0, np.empty(ticks)
    for n, one in enumerate(wish):
        now = keep * now + (1.0 - keep) * one
        out[n] = now
    return np.round(out / STEP_A) * STEP_A


def _prms(random: np.random.Generator, ticks: int) -> Floats:
    """Levels drawn anew at random times; one in eight shuts the valve."""
    wish, n = np.zeros(ticks), 0
    while n < ticks:
        held = int(random.integers(12, 70))
        wish[n : n + held] = 0.0 if random.random() < 0.125 else random.uniform(0.38, 1.18)
        n += held
    return wish


def _stairs(random: np.random.Generator, ticks: int) -> Floats:
    """Levels in a drawn order, each held for 1.6 s, shut after every third."""
    held = 80
    count = -(-ticks // held)
    levels = random.permutation(np.linspace(0.42, 1.15, max(count, 2)))[:count]
    levels[2::3] = 0.0
    return np.repeat(levels, held)[:ticks]


def _driver(random: np.random.Generator, ticks: int) -> Floats:
    """Ramps up, a speed that is held with a trembling hand, ramps down, a pause, and creeping at last."""
    wish, n, now = np.zeros(ticks), 0, 0.0
    while n < ticks:
        target = random.choice(
            [random.uniform(0.75, 1.15), random.uniform(0.42, 0.6), 0.0], p=[0.5, 0.3, 0.2]
        )
        ramp, held = int(random.integers(10, 60)), int(random.integers(25, 120))
        way = np.concatenate([np.linspace(now, target, ramp), np.full(held, target)])
        if target > 0.0:
            way += 0.02 * np.sin(2 * np.pi * np.arange(len(way)) / random.uniform(20, 50))
        wish[n : n + len(way)] = way[: ticks - n]
        n, now = n + len(way), target
    return np.maximum(wish, 0.0)
