"""What a cause comes to in quantities that a reader knows, where its parameter is none."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from forklift.base.typeset import amount, number
from forklift.plant.forklift.free_curve import COEFFICIENTS, FreeCurve, splines
from forklift.plant.forklift.geometry import FORKS_PER_CYLINDER
from forklift.plant.forklift.truck import Truck
from forklift.recordings.recording import Recording

Case = tuple[Recording, float]
"""A recording with its mean oil temperature [°C]."""


def physical(truck: Truck, cases: Sequence[Case], effect: str, lift: str) -> str:
    """A sentence; empty if there is none for this effect.

    Parameters
    ----------
    truck
        With what was found.
    """
    told = SENTENCES.get(effect)
    return told(truck, cases, lift) if told else ""


def _friction(truck: Truck, cases: Sequence[Case], lift: str) -> str:
    """Viscous friction in the coldest and the warmest recording."""
    degc = [one for _, one in cases]
    cold, warm = (
        _of(truck, f"{lift}.friction.sigma_2")
        * np.exp(-_of(truck, f"{lift}.friction_temperature.rate") * (one - 20.0))
        for one in (min(degc), max(degc))
    )
    return (
        f"Viscous friction (sigma_2): {amount(cold, 'N s/m')} at {min(degc):.0f} °C, "
        f"{amount(warm, 'N s/m')} at {max(degc):.0f} °C."
    )


def _leak(truck: Truck, cases: Sequence[Case], lift: str) -> str:
    """Flow at the highest mean pressure of a recording, and how fast forks that should be held sink by it."""
    channel = f"pressure_{lift}_pa"
    measured = [one for one, _ in cases if np.isfinite(one.channels.get(channel, ())).any()]
    means = {float(np.nanmean(one.channels[channel])): one.load_kg for one in measured}
    if not means:
        return ""
    most = max(means)
    flow = _of(truck, f"{lift}.leakage.coefficient") * most
    sinks = 6e4 * FORKS_PER_CYLINDER * flow / _of(truck, f"{lift}.cylinder.area")
    return (
        f"That is {number(6e4 * flow)} l/min at {number(1e-5 * most)} bar: with {means[most]:.0f} kg, forks "
        f"that should be held sink by {number(sinks)} mm/min."
    )


def _answer(truck: Truck, cases: Sequence[Case], lift: str) -> str:
    """The valve's time constant at quarters of the widest step."""
    head = f"{lift}.free_response"
    shares = np.arange(1, 5) / 4
    steps = _of(truck, f"{head}.range") * shares
    times = splines(shares) @ [_of(truck, f"{head}.time_{k}") for k in range(COEFFICIENTS)]
    told = [
        f"{amount(1e3 * time, 'ms')} with {amount(step, 'A')} to go"
        for time, step in zip(times, steps, strict=True)
    ]
    return f"The command's time constant on its way to the valve: {', '.join(told)}."


def _shape(truck: Truck, cases: Sequence[Case], lift: str) -> str:
    """A free curve's least and greatest, and where they are."""
    curve = FreeCurve.of(truck, "main" if lift == "main" else "free")
    return f"{curve.sentence} The curve is drawn below." if curve else ""


def _rings(truck: Truck, cases: Sequence[Case], lift: str) -> str:
    """The mass on a spring that something of unknown kind behaves like."""
    mass, frequency, ratio = (
        _of(truck, f"{lift}.hidden_resonance.{name}") for name in ("mass", "frequency", "damping_ratio")
    )
    return (
        f"It behaves like {amount(mass, 'kg')} on a spring, with {amount(frequency, 'Hz')} and "
        f"{number(ratio)} of the critical damping."
    )


def _of(truck: Truck, name: str) -> float:
    value = truck.values[name]
    assert isinstance(value, float)
    return value


SENTENCES: Mapping[str, Callable[[Truck, Sequence[Case], str], str]] = {
    "friction_temperature": _friction,
    "leakage": _leak,
    "free_response": _answer,
    "free_shape": _shape,
    "fine_shape": _shape,
    "hidden_resonance": _rings,
}
"""By effect."""
