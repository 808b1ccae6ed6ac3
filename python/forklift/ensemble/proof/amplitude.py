"""How large a concealed law is made.

The size of a law is the root mean square change that it makes to the commanded lifts, over the probes (a few
of the campaign's own recordings): half from the velocity, in units of the slope noise of a height sensor
behind the filter that judges it, half from the pressure, in units of its sensor's noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from forklift import _core
from forklift.ensemble.proof import kinds
from forklift.ensemble.proof.draw import Draw
from forklift.ensemble.proof.ends import END_M, lifts_of, ticks_before
from forklift.ensemble.proof.truth import effects, others, run, sensors, strangers
from forklift.ensemble.proof.truth.model import Law
from forklift.ensemble.proof.truth.truck import LIFTS, Lift

Trucks = tuple[Lift, Lift]

ROUGH = 1e-5
"""Tolerance of runs that only tell a size."""
GRID = np.geomspace(0.01, 1.0, 5)
"""Shares of the largest amplitude at which the size is found."""
PROBES = 3
PROBE_TICKS = 300
VELOCITY_NOISE_M_S = sensors.HEIGHT_NOISE_M / run.TICK_S / np.sqrt(110.0)
"""Slope noise of a second-order filter over 11 samples: variance over the sum of k², k = -5 ... 5."""


def plausible(effect: str) -> dict[str, tuple[float, float, str]]:
    """The catalogue's plausible range of each parameter of an effect, and its scale."""
    spec = next(one for one in _core.effect_table() if one["id"] == effect)
    return {p["name"]: (p["plausible_lower"], p["plausible_upper"], p["scale"]) for p in spec["parameters"]}


def most(name: str) -> float:
    """The end of what is plausible of a law's amplitude."""
    if name in strangers.SPECS:
        return strangers.SPECS[name].most
    return others.MOST[name] if "__" in name else next(iter(plausible(name).values()))[1]


def law_of(name: str, where: str, amplitude: float, random: np.random.Generator) -> Law:
    """The law at a lift, ``free``, ``main`` or ``both``; what it has besides its amplitude is drawn."""
    value = amplitude if where == "both" else run.on(where, amplitude)
    own: dict[str, float] = {}
    if name in strangers.SPECS:
        for key, low, high in strangers.SPECS[name].others:
            own[key] = float(np.exp(random.uniform(np.log(low), np.log(high))))
        return strangers.law(name, value, **own)
    if "__" in name:
        for key, low, high in others.DRAWN.get(name, ()):
            own[key] = float(random.uniform(low, high))
        if "centre" in others.QUIET[name]:
            own["centre"] = float(random.uniform(*CENTRES[where]))
        return others.law(name, value, **own)
    for key, (low, high, scale) in list(plausible(name).items())[1:]:
        share = random.uniform(0.2, 0.8)
        own[key] = low * (high / low) ** share if scale == "log" else low + share * (high - low)
    if name == "friction_position":
        own["centre"] = float(random.uniform(*CENTRES[where]))
    if name == "end_cushion":
        own["length"] = float(random.uniform(0.08, 0.2))
    if name == "valve_current_limit":
        own["limit"] = float(random.uniform(0.5, 0.75))
    return effects.law(name, value, **own)


CENTRES = {"free": (0.45, 0.8), "main": (1.4, 1.8), "both": (0.5, 0.75)}
"""Places that a lift comes by [m]."""


def probes(given: Draw) -> list[int]:
    """A few recordings that differ most in load and temperature, the commanded lifts all among them."""
    plans, chosen = given.plans, [0]
    where = np.array([[one.load_kg / 500.0, one.temperature_degc / 15.0] for one in plans])
    lift = np.array([LIFTS_PLACE[one.lift] for one in plans])
    where = np.column_stack([where, 4.0 * lift])
    while len(chosen) < min(PROBES, len(plans)):
        away = np.min([np.linalg.norm(where - where[n], axis=1) for n in chosen], axis=0)
        chosen.append(int(np.argmax(away)))
    return chosen


LIFTS_PLACE = {"free": (1.0, 0.0), "main": (0.0, 1.0), "both": (1.0, 1.0)}


def probe_ticks(name: str, one: run.Condition) -> int:
    """The beginning of a recording; all of it where the law only acts at the end of the way."""
    whole = int(one.command.shape[1])
    return whole if kinds.nearest(name) == "end_cushion" else min(whole, PROBE_TICKS)


def beginning(one: run.Condition, ticks: int) -> run.Condition:
    """So many ticks of a recording, whose oil warms up as fast."""
    last = max(one.command.shape[1] - 1, 1)
    return replace(one, command=one.command[:, :ticks], warming_k=one.warming_k * (ticks - 1) / last)


def size(found: Sequence[run.Trajectory], without: Sequence[run.Trajectory], moved: Sequence[str]) -> float:
    """The root mean square change, see above; `moved` says which lift each recording commands."""
    squares = []
    for one, other, lift in zip(found, without, moved, strict=True):
        rows = [LIFTS.index(name) for name in lifts_of(lift)]
        n = min(ticks_before(each, lift, END_M) for each in (one, other))
        dv = (one.v[rows, :n] - other.v[rows, :n]) * _SENSED[rows] / VELOCITY_NOISE_M_S
        dp = (one.p_A[rows, :n] - other.p_A[rows, :n]) / sensors.PRESSURE_NOISE_PA
        squares.append(0.5 * np.mean(dv**2) + 0.5 * np.mean(dp**2))
    return float(np.sqrt(np.mean(squares)))


_SENSED = np.array([[2.0], [2.0]])
"""The forks move twice as far as a cylinder."""


def found_for(
    given: Draw,
    name: str,
    where: str,
    wanted: float,
    trucks: Trucks,
    conditions: Sequence[run.Condition],
    random: np.random.Generator,
    tick_s: float,
    beside: Sequence[Law] = (),
) -> tuple[Law, float, float]:
    """The law whose size is `wanted`, its amplitude, and the size it has; capped at what is plausible, and at
    what makes no truck chatter or run away in any recording, with the laws `beside` it."""
    chosen = probes(given)
    plain = [beginning(conditions[n], probe_ticks(name, conditions[n])) for n in chosen]
    moved = [given.plans[n].lift for n in chosen]
    top = most(name)
    law = law_of(name, where, top, random)
    key, full = next(iter(law.values.items()))
    shares = GRID
    while True:
        amplified = [
            replace(one, values={f"{law.name}.{key}": np.multiply(full, share)})
            for share in (0.0, *shares)
            for one in plain
        ]
        try:
            ran = run.simulate(trucks, (law,), amplified, ROUGH, tick_s)
            break
        except FloatingPointError:
            if len(shares) == 1:
                raise
            shares = shares[:-1]
    each = [ran[n * len(plain) : (n + 1) * len(plain)] for n in range(len(shares) + 1)]
    sizes = np.maximum.accumulate([max(size(one, each[0], moved), 1e-9) for one in each[1:]])
    if wanted >= sizes[-1]:
        share, has = float(shares[-1]), float(sizes[-1])
    elif wanted <= sizes[0]:
        share, has = float(shares[0] * wanted / sizes[0]), wanted
    else:
        share, has = float(np.exp(np.interp(np.log(wanted), np.log(sizes), np.log(shares)))), wanted
    while True:
        law.values[key] = np.multiply(full, share)
        try:
            run.simulate(trucks, (*beside, law), conditions, ROUGH, tick_s)
            return law, top * share, has
        except FloatingPointError:
            smaller = int(np.searchsorted(shares, share * (1.0 - 1e-9))) - 1
            if smaller < 0:
                raise
            share, has = float(shares[smaller]), float(sizes[smaller])
