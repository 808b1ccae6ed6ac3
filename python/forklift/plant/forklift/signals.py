"""Measured signals beside their simulation: what a prediction is judged on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

import numpy as np

from forklift.base import derivative
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.plant.forklift.tables import outputs
from forklift.plant.subject import Signal
from forklift.recordings.channels import LIFTS, Lift, commanded

if TYPE_CHECKING:
    from forklift.base.arrays import Floats
    from forklift.recordings.recording import Recording

PREDICTED = (
    "position_free_m",
    "position_main_m",
    "velocity_free_m_s",
    "velocity_main_m_s",
    "pressure_free_pa",
    "pressure_main_pa",
)
"""The columns of a prediction after ``time_s``."""


class Named(Protocol):
    """Outputs by name, each (times,): a simulation's, or what a fitted model says."""

    def __getitem__(self, name: str, /) -> Floats: ...


def signals(recording: Recording, simulation: Named) -> Iterator[Signal]:
    """Velocity of each commanded lift, then positions, pressures and fork height, as far as measured.

    The velocity is the derivative (`forklift.base.derivative.derivative`) of ``fork_height_m`` where that
    exists and a single lift is commanded, else of the lift's own encoder. The same signal of the simulation
    goes through the same filter: the fork height simulated, too, contains what the lift at rest adds by
    bouncing.
    """
    moved = commanded(recording.lift)
    measured, units = recording.channels, outputs()

    def signal(part: str, name: str, driven: bool, source: str, *both: Floats) -> Signal:
        return Signal(part, name, units[name]["unit"], driven, source, *both)

    def has(channel: str) -> bool:
        return channel in measured and bool(np.isfinite(measured[channel]).any())

    for lift in moved:
        for source, ratio in _velocity_sources(lift, len(moved)):
            if has(source):
                velocity = _derivative(recording, source, measured[source]) / ratio
                if np.isfinite(velocity).any():
                    simulated = _derivative(recording, source, simulation[source]) / ratio
                    yield signal(lift, f"velocity_{lift}_m_s", True, source, velocity, simulated)
                    break
    for lift in LIFTS:
        for channel in (f"position_{lift}_m", f"pressure_{lift}_pa"):
            if has(channel):
                yield signal(lift, channel, lift in moved, channel, measured[channel], simulation[channel])
    if has(channel := "fork_height_m"):
        yield signal(recording.lift, channel, True, channel, measured[channel], simulation[channel])


def _derivative(recording: Recording, source: str, values: Floats) -> Floats:
    """The derivative over the source's own samples; missing at all other instants."""
    if source not in recording.rows:
        return derivative.derivative(recording.time_s, values)
    rows = recording.rows[source]
    found = np.full(len(recording), np.nan)
    found[rows] = derivative.derivative(recording.time_s[rows], values[rows])
    return found


def _velocity_sources(lift: Lift, lifts_moved: int) -> list[tuple[str, float]]:
    """The channels a lift's velocity is told from, best first, with how far each moves per sensor metre."""
    own = (f"position_{lift}_m", 1.0)
    return [("fork_height_m", FORKS_PER_SENSOR[lift]), own] if lifts_moved == 1 else [own]
