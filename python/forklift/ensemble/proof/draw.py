"""What a campaign will be: its truck, its recordings, its nuisances and what it conceals, from (seed,
number)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forklift.ensemble.proof import kinds
from forklift.ensemble.proof.random import Purpose, stream
from forklift.ensemble.proof.truth import drive

RECORDINGS = (6, 30)
"""Fewest and most recordings of a campaign."""
LIFTS = ("free", "main")
SIZES = (0.7, 12.0)
"""Range of the size of what is concealed: the root mean square change that it makes to velocity and pressure,
in units of what the sensors' noise makes of them. Drawn evenly in the logarithm."""


@dataclass(frozen=True)
class Plan:
    """One recording to be made."""

    file: str
    lift: str
    role: str
    entered_kg: float
    load_kg: float
    temperature_degc: float
    warming_k: float
    ticks: int
    kind: str
    has_temperature: bool = True


@dataclass(frozen=True)
class Nuisances:
    """What is always on, and no fault.

    Attributes
    ----------
    tick
        True sample period over the recorded one.
    dither_a
        Amplitude of the dither, which is not recorded, at half the sample rate. What the spool's hysteresis
        feels is how far it travels, amplitude over frequency behind the valve's second order: 1 to 4 mA here
        are 4 to 16 mA at 100 Hz.
    noise, colour_s, temperature_lag_s
        See `forklift.ensemble.proof.truth.sensors.Sensors`.
    height
        Whether the height of the forks is recorded.
    spoilt
        Recording that is spoilt, how, and from when [s]; none: "".
    """

    tick: float
    dither_a: float
    noise: float
    colour_s: float
    temperature_lag_s: float
    height: bool
    spoilt_in: int = 0
    spoilt: str = ""
    spoilt_s: float = 0.0


@dataclass(frozen=True)
class Draw:
    """A campaign before anything was simulated."""

    seed: int
    number: int
    kind: str
    concealed: tuple[str, ...]
    lift: str
    sizes: tuple[float, ...]
    plans: tuple[Plan, ...]
    nuisances: Nuisances
    entered_degc: float | None = None
    """What is entered for recordings without an oil temperature."""


def kind_of(seed: int, number: int) -> str:
    """The kind of a campaign: a card of the deck to which it belongs."""
    deck, card = divmod(number, len(kinds.DECK))
    order = stream(seed, deck, Purpose.KIND).permutation(len(kinds.DECK))
    return kinds.DECK[order[card]]


def draw(seed: int, number: int) -> Draw:
    """The campaign `number` of `seed`; nothing else enters."""
    random = stream(seed, number, Purpose.CONCEALED)
    kind = kind_of(seed, number)
    concealed = _concealed(kind, random)
    if any(kinds.both_lifts(name) for name in concealed):
        lift = "both"
    elif "end_cushion" in concealed:
        lift = "free"
    else:
        lift = str(random.choice(["free", "main", "both"], p=[0.46, 0.46, 0.08]))
    sizes = tuple(float(np.exp(random.uniform(*np.log(SIZES)))) for _ in concealed)
    random = stream(seed, number, Purpose.RECORDINGS)
    plans, entered = _plans(lift, random)
    return Draw(seed, number, kind, concealed, lift, sizes, plans, _nuisances(len(plans), random), entered)


def _concealed(kind: str, random: np.random.Generator) -> tuple[str, ...]:
    names = kinds.of_kind(kind)
    if not names:
        return ()
    if kind != "two":
        return (str(random.choice(names)),)
    while True:
        first, second = (str(one) for one in random.choice(names, 2, replace=False))
        # Two in one equation are one law of two parts; the proof asks for two places.
        if not set(kinds.EQUATIONS[first]) & set(kinds.EQUATIONS[second]):
            return first, second


def _plans(lift: str, random: np.random.Generator) -> tuple[tuple[Plan, ...], float | None]:
    """The recordings: uneven in load and temperature, a third or so held out."""
    loads = _levels(random, int(random.integers(2, 5)), 0.0, 1600.0, 600.0, 10.0)
    if random.random() < 0.7:
        loads[0] = 0.0
    one = random.random() < 0.08
    temperatures = _levels(random, 1 if one else int(random.integers(2, 5)), -5.0, 62.0, 25.0, 1.0)
    count = int(np.clip(np.round(random.gamma(7.0, 2.0)), *RECORDINGS))
    cells = [(load, degc) for load in loads for degc in temperatures]
    cells = [cells[n] for n in random.permutation(len(cells))]
    most = len(cells) if count >= len(cells) else count
    weights = random.dirichlet(np.full(most, 3.0))
    chosen = [*range(min(most, count)), *random.choice(most, max(count - most, 0), p=weights)]
    without = random.random() < 0.1
    entered = float(random.choice(temperatures)) if without else None
    warming = random.uniform(0.0, 2.5)
    plans: list[Plan] = []
    for n, cell in enumerate(chosen):
        load, degc = cells[int(cell)]
        moved = lift if lift in LIFTS else ("both", *LIFTS)[n % 3]
        kind = str(random.choice(drive.KINDS, p=[0.55, 0.25, 0.2]))
        role = "validate" if n % 5 in (1, 3) or (n >= 4 and random.random() < 0.05) else "estimate"
        plans.append(
            Plan(
                f"{moved}_{n + 1:02d}_{kind}_{load:g}kg_{degc:g}c.csv",
                moved,
                role,
                float(load),
                float(load * (1.0 + 0.01 * random.uniform(-1.0, 1.0))),
                float(degc + random.standard_normal()),
                float(warming * random.uniform(0.5, 1.0)),
                int(random.integers(420, 681)),
                kind,
                entered is None or degc != entered,
            )
        )
    return tuple(plans), entered


def _levels(
    random: np.random.Generator, count: int, low: float, high: float, apart: float, step: float
) -> list[float]:
    """Levels, rising, the outermost at least so far apart."""
    while True:
        found = np.sort(np.round(random.uniform(low, high, count) / step) * step)
        if count == 1 or (found[-1] - found[0] >= apart and (np.diff(found) > 0.0).all()):
            return [float(one) for one in found]


def _nuisances(count: int, random: np.random.Generator) -> Nuisances:
    spoilt = str(random.choice(["", "gap", "short", "stuck"], p=[0.7, 0.15, 0.1, 0.05]))
    return Nuisances(
        tick=1.0 + random.uniform(-1e-3, 1e-3),
        dither_a=random.uniform(0.001, 0.004),
        noise=float(np.exp(0.15 * random.standard_normal())),
        colour_s=random.uniform(0.0, 0.05),
        temperature_lag_s=random.uniform(10.0, 60.0),
        height=random.random() < 0.7,
        spoilt_in=int(random.integers(count)),
        spoilt=spoilt,
        spoilt_s=random.uniform(2.0, 5.0),
    )
