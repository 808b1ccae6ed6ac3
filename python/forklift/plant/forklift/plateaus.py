"""Plateaus: stretches of a recording in which a lift was lowered steadily under a constant current.

They are found by what was commanded and measured, in any recording: the current stays, and the velocity
has settled. Which branch of the valve's hysteresis a plateau lies on follows from the commands before it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats
from forklift.plant.forklift.commands import steps_to_current
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.plant.forklift.simulate import predict
from forklift.recordings.channels import LIFTS, Lift, commanded

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording


SHORTEST_S = 0.4
"""Shortest window a velocity is told from [s]: one oscillation of the lift on its oil, section 4.5.2."""
LEAST_SAMPLES = 15
"""Fewest measured samples in it."""
MOST_ERROR = (5e-3, 0.03)
"""A velocity that is not told better than by the sum of these [m/s] and [share of it] had not settled."""
SAME_CURRENT = 0.1
"""By how much a constant current may change from sample to sample, in steps of the ECU."""


@dataclass(frozen=True)
class Plateau:
    """One steady stretch. Velocities are of the forks as this lift moves them, upward positive."""

    file: str
    lift: Lift
    start_s: float
    end_s: float
    """The window that was used [s]."""
    current_a: float
    """Commanded [A]."""
    hysteresis_direction: float
    """Share by which the valve's hysteresis is bent: 1 after the current rose, −1 after it fell, (3.11)."""
    pressure_pa: float
    """Mean p_A [Pa]."""
    pressure_rate_pa_s: float
    """Its slope [Pa/s]: the bristles of the mast's friction bend over a metre of travel."""
    oil_temperature_degc: float
    velocity_m_s: float
    standard_error_m_s: float
    """Of the velocity [m/s], with what it drifted within the window."""


def plateaus(recording: Recording, truck: Truck, lift: Lift) -> tuple[Plateau, ...]:
    """The plateaus of one lift in a recording, in order of time.

    Parameters
    ----------
    truck
        Tells from the commands how far the valve's hysteresis is bent; nothing else is taken from it.
    lift
        A lift that is not commanded, or lacks pressure, temperature or any position, has none.

    Notes
    -----
    The velocity is the slope of a straight line. The encoder rounds down, so the line is laid through the
    instants at which its count changes, where the position is known best; ``fork_height_m`` adds its own
    line where a single lift is commanded. Of all windows that end with the constant current the one
    is taken whose slope is known best: a longer one averages noise, a later one has settled more. What the
    recording holds after the lift came to rest on its stop is left out.
    """
    pressure = recording.channels.get(f"pressure_{lift}_pa")
    temperature = recording.channels.get("oil_temperature_degc")
    if lift not in commanded(recording.lift) or pressure is None or temperature is None:
        return ()
    if not np.isfinite(temperature).any():
        return ()
    recording = recording.thinned((f"position_{lift}_m", "fork_height_m"))
    pressure, temperature = (recording[name] for name in (f"pressure_{lift}_pa", "oil_temperature_degc"))
    sources = _sources(recording, lift)
    last = _before_the_stop(recording, lift, sources)
    constant = [run for run in _constant(recording[f"current_{lift}_a"]) if run[0] < last]
    found = []
    direction: Floats | None = None
    for first, end in constant:
        current = float(recording[f"current_{lift}_a"][first])
        if current <= 0.0:
            continue
        window = _settled(recording.time_s, sources, first, min(end, last))
        if window is None:
            continue
        start, stop, velocity, error = window
        known = np.isfinite(pressure[start:stop])
        if known.sum() < LEAST_SAMPLES or velocity > 3.0 * error:
            continue
        if direction is None:
            direction = _directions(recording, truck, lift)
        time = recording.time_s[start:stop][known]
        rate, mean = np.polyfit(time - time.mean(), pressure[start:stop][known], 1)
        found.append(
            Plateau(
                recording.file,
                lift,
                float(recording.time_s[start]),
                float(recording.time_s[stop - 1]),
                current,
                float(direction[stop - 1]),
                float(mean),
                float(rate),
                float(np.nanmean(temperature)),
                velocity,
                error,
            )
        )
    return tuple(found)


def _sources(recording: Recording, lift: Lift) -> list[tuple[bool, Floats]]:
    """Fork position [m] as this lift moves it, by each sensor, and whether that is an encoder."""
    found = []
    own = recording.channels.get(f"position_{lift}_m")
    if own is not None and np.isfinite(own).any():
        found.append((True, own))
    height = recording.channels.get("fork_height_m")
    if height is not None and recording.lift in LIFTS and np.isfinite(height).any():
        found.append((False, height / FORKS_PER_SENSOR[lift]))
    return [(encoder, FORKS_PER_SENSOR[lift] * position) for encoder, position in found]


def _constant(current: Floats) -> Iterator[tuple[int, int]]:
    """Stretches of constant current, from sample to sample (exclusive)."""
    same = SAME_CURRENT * float(steps_to_current([1])[0])
    edges = np.flatnonzero(np.abs(np.diff(current)) > same) + 1
    yield from zip([0, *edges.tolist()], [*edges.tolist(), len(current)], strict=True)


def _before_the_stop(recording: Recording, lift: Lift, sources: list[tuple[bool, Floats]]) -> int:
    """The sample up to which the lift may still sink: later it rests where it is lowest."""
    if not sources:
        return 0
    encoder, position = sources[0]
    margin = FORKS_PER_SENSOR[lift] * _core.ENCODER_COUNT_M * (1.5 if encoder else 3.0)
    low = np.flatnonzero(position <= np.nanmin(position) + margin)
    ends = low[0] if len(low) else len(position)
    # What only just arrives at the end of the recording was not stopped.
    arrives = recording.time_s[-1] - recording.time_s[ends] < SHORTEST_S / 2
    return len(position) if arrives and ends > 0 else int(ends)


def _directions(recording: Recording, truck: Truck, lift: Lift) -> Floats:
    """(n,) how far the valve's hysteresis is bent, by the truck's own valve under the recorded commands."""
    bristle = predict(truck, recording, solver="fixed")[f"{lift}.valve_bristle"]
    stiffness, width = (truck.values[f"{lift}.valve.{name}"] for name in ("sigma_0", "f_hs"))
    share: Floats = np.clip(bristle * stiffness / width, -1.0, 1.0)
    return share


def _settled(
    time: Floats, sources: list[tuple[bool, Floats]], first: int, end: int
) -> tuple[int, int, float, float] | None:
    """The best window within [first, end): its samples, velocity and standard error; None if none is good."""
    best: tuple[int, int, float, float] | None = None
    stop_time = time[end - 1]
    for start in range(first, end, 3):
        if stop_time - time[start] < SHORTEST_S or end - start < LEAST_SAMPLES:
            break
        told = [line for source in sources if (line := _velocity(time, *source, start, end)) is not None]
        if not told:
            continue
        weights = np.array([1.0 / error**2 for _, error in told])
        velocity = float(np.dot(weights, [value for value, _ in told]) / weights.sum())
        spread = max(abs(value - velocity) for value, _ in told) / 2.0
        error = max(float(weights.sum()) ** -0.5, spread)
        if best is None or error < best[3]:
            best = (start, end, velocity, error)
    if best is None or best[3] > MOST_ERROR[0] + MOST_ERROR[1] * abs(best[2]):
        return None
    return best


def _velocity(
    time: Floats, encoder: bool, position: Floats, start: int, end: int
) -> tuple[float, float] | None:
    """Slope of one sensor's position over a window and its standard error, drift included [m/s]."""
    t, x = time[start:end], position[start:end]
    known = np.isfinite(x)
    if known.sum() < max(LEAST_SAMPLES, 0.6 * len(x)):
        return None
    t, x = t[known], x[known]
    span = float(t[-1] - t[0])
    least = 0.0
    if encoder:
        changes = np.flatnonzero(np.diff(x) != 0.0)
        count = float(np.abs(np.diff(x)[changes]).min()) if len(changes) else _core.ENCODER_COUNT_M
        travel = float(x[-1] - x[0])
        if len(changes) < 4 or abs(travel) < 3.5 * count:
            if np.ptp(x) > 4.0 * count:
                return None  # it bounces
            # One count either way at both ends, each evenly spread.
            return travel / span, count / span / 6.0**0.5
        # Between two samples the position passed all boundaries between the counts: their mean, midway.
        t, x = (t[changes] + t[changes + 1]) / 2.0, (x[changes] + x[changes + 1] + count) / 2.0
        # A change lies anywhere between its samples; few of them can fit a line better than that by chance.
        least = min(abs(travel) / span * float(np.median(np.diff(time[start:end]))), count) / 12.0**0.5
        span = float(t[-1] - t[0])
    centred = t - t.mean()
    spread = float(centred @ centred)
    slope = float(centred @ x) / spread
    off = x - x.mean() - slope * centred
    # How far the velocity drifts from one end of the window to the other, by a parabola.
    bow = centred**2 - spread / len(t)
    bow -= centred * float(centred @ bow) / spread
    curvature = float(bow @ off) / float(bow @ bow)
    drift = abs(2.0 * curvature * span)
    off -= curvature * bow
    error = max(_error_of_slope(centred, off, spread), least / spread**0.5)
    return slope, float(np.hypot(error, drift / 12.0**0.5))


def _error_of_slope(centred: Floats, off: Floats, spread: float) -> float:
    """Standard error of a slope whose residuals oscillate (Newey & West 1987)."""
    influence = centred * off
    n = len(off)
    lags = min(n // 3, 10)
    variance = float(influence @ influence)
    independent = float(off @ off) / max(n - 3, 1) * spread
    for lag in range(1, lags + 1):
        variance += 2.0 * (1.0 - lag / (lags + 1)) * float(influence[lag:] @ influence[:-lag])
    return float(np.sqrt(max(variance, independent))) / spread


def arrays(found: tuple[Plateau, ...], *names: str) -> tuple[Any, ...]:
    """(n,) of each named field."""
    return tuple(np.array([getattr(plateau, name) for plateau in found], np.float64) for name in names)
