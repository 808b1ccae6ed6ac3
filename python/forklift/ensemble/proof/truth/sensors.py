"""What the truck's sensors, as in `docs/recordings.md`, make of a trajectory, and how they may fail."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forklift.ensemble.proof.truth.run import TICK_S, Trajectory

Floats = NDArray[np.float64]

COUNT_M = np.pi * 0.08 / 128  # of an encoder: a wheel of 80 mm with 128 slits
PRESSURE_NOISE_PA, PRESSURE_STEP_PA = 0.3e5, 0.06e5
TEMPERATURE_NOISE_K, TEMPERATURE_STEP_K = 0.1, 0.5
HEIGHT_NOISE_M = 0.5e-3


@dataclass(frozen=True)
class Sensors:
    """How the sensors of one campaign read.

    Attributes
    ----------
    noise
        Factor on the noise of pressure and height.
    colour_s
        Correlation time [s] of the pressures' noise; none is white.
    temperature_lag_s
        Time constant [s] with which the temperature sensor follows.
    gains, lates_s, offsets
        Of single channels: a factor, by how much a channel is late [s], and what is added in its unit.
    temperature_stuck_degc
        What the temperature channel reads whatever the oil does.
    """

    noise: float = 1.0
    colour_s: float = 0.0
    temperature_lag_s: float = 0.0
    gains: tuple[tuple[str, float], ...] = ()
    lates_s: tuple[tuple[str, float], ...] = ()
    offsets: tuple[tuple[str, float], ...] = ()
    temperature_stuck_degc: float | None = None


def measured(trajectory: Trajectory, sensors: Sensors, random: np.random.Generator) -> dict[str, Floats]:
    """The channels of a recording, but for time and commands."""
    n = len(trajectory.time_s)
    true = read(trajectory, sensors)
    seen = {}
    for channel, signal in true.items():
        if channel.startswith("position"):
            seen[channel] = np.floor(signal / COUNT_M) * COUNT_M
        elif channel.startswith("pressure"):
            noise = PRESSURE_NOISE_PA * sensors.noise * coloured(random, n, sensors.colour_s)
            seen[channel] = stepped(signal + noise, PRESSURE_STEP_PA)
        elif channel == "fork_height_m":
            seen[channel] = signal + HEIGHT_NOISE_M * sensors.noise * random.standard_normal(n)
        else:
            seen[channel] = stepped(
                signal + TEMPERATURE_NOISE_K * random.standard_normal(n), TEMPERATURE_STEP_K
            )
    return seen


def read(trajectory: Trajectory, sensors: Sensors) -> dict[str, Floats]:
    """The channels of a recording, but for time and commands, before noise and counts."""
    n = len(trajectory.time_s)
    encoder = trajectory.encoder
    if encoder is None:  # made by hand: what the cylinders do
        encoder = np.stack([2.0 * trajectory.x[0], trajectory.x[1]])
    true = {
        "position_free_m": encoder[0],
        "position_main_m": encoder[1],
        "pressure_free_pa": trajectory.p_A[0],
        "pressure_main_pa": trajectory.p_A[1],
        "oil_temperature_degc": lagging(trajectory.temperature_degc, sensors.temperature_lag_s),
        "fork_height_m": trajectory.fork_height,
    }
    for channel, late in sensors.lates_s:
        ago = np.arange(n) - late / TICK_S
        true[channel] = np.interp(ago, np.arange(n), true[channel])
    for channel, gain in sensors.gains:
        true[channel] = gain * true[channel]
    for channel, offset in sensors.offsets:
        true[channel] = true[channel] + offset
    if sensors.temperature_stuck_degc is not None:
        true["oil_temperature_degc"] = np.full(n, sensors.temperature_stuck_degc)
    return true


def slipped(channel: Floats, at_s: float, by_m: float) -> Floats:
    """The encoder's channel after its wheel lost `by_m` at `at_s`, in whole counts."""
    out = channel.copy()
    out[_when(channel, at_s) :] += round(by_m / COUNT_M) * COUNT_M
    return out


def _when(channel: Floats, at_s: float) -> int:
    """The sample at a time; the middle one, where the recording has ended by then."""
    at = round(at_s / TICK_S)
    return at if at < len(channel) else len(channel) // 2


def stepped(signal: Floats, step: float) -> Floats:
    return np.round(signal / step) * step


def coloured(random: np.random.Generator, n: int, time_s: float) -> Floats:
    """Noise of variance one, an autoregression of order one with this correlation time."""
    white = random.standard_normal(n)
    if time_s <= 0.0:
        return white
    keep = np.exp(-TICK_S / time_s)
    for k in range(1, n):
        white[k] = keep * white[k - 1] + np.sqrt(1.0 - keep**2) * white[k]
    return white


def lagging(signal: Floats, time_s: float) -> Floats:
    """The signal behind a first-order lag, settled at the start."""
    if time_s <= 0.0:
        return signal
    out, keep = signal.copy(), np.exp(-TICK_S / time_s)
    for k in range(1, len(out)):
        out[k] = keep * out[k - 1] + (1.0 - keep) * signal[k]
    return out


def stuck(channel: Floats, start_s: float, duration_s: float) -> Floats:
    """The channel, held at its value at `start_s` for `duration_s`."""
    first = _when(channel, start_s)
    last = first + round((start_s + duration_s) / TICK_S) - round(start_s / TICK_S)
    held = channel.copy()
    held[first:last] = held[first]
    return held
