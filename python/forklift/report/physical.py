"""What a cause comes to in quantities that a reader knows, where its parameter is none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from forklift.report.words import amount, number

if TYPE_CHECKING:
    from forklift.diagnose import Diagnosis


def physical(found: Diagnosis, effect: str, lift: str) -> str:
    """A sentence; empty if there is none for this effect."""
    told = SENTENCES.get(effect)
    return told(found, lift) if told else ""


def _friction(found: Diagnosis, lift: str) -> str:
    """Viscous friction in the coldest and the warmest recording."""
    degc = [one.oil_temperature_degc for one in found.after.predictions]
    cold, warm = (
        _of(found, f"{lift}.friction.sigma_2")
        * np.exp(-_of(found, f"{lift}.friction_temperature.rate") * (one - 20.0))
        for one in (min(degc), max(degc))
    )
    return (
        f"Viscous friction (sigma_2): {amount(cold, 'N s/m')} at {min(degc):.0f} °C, "
        f"{amount(warm, 'N s/m')} at {max(degc):.0f} °C."
    )


def _leak(found: Diagnosis, lift: str) -> str:
    """Flow at the highest mean pressure of a recording."""
    channel = f"pressure_{lift}_pa"
    means = [
        float(np.nanmean(one.recording.channels[channel]))
        for one in found.after.predictions
        if channel in one.recording.channels
    ]
    if not means:
        return ""
    flow = _of(found, f"{lift}.leakage.coefficient") * max(means)
    return f"That is {number(6e4 * flow)} l/min at {number(1e-5 * max(means))} bar."


def _of(found: Diagnosis, name: str) -> float:
    value = found.truck.values[name]
    assert isinstance(value, float)
    return value


SENTENCES: Mapping[str, Callable[[Diagnosis, str], str]] = {
    "friction_temperature": _friction,
    "leakage": _leak,
}
"""By effect."""
