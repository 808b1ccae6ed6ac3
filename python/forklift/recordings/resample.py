"""Channels on clocks of their own, brought onto one: the campaign's sample rate from zero.

The grid begins with the later commanded current's first sample and ends with the earlier one's last. A
commanded current is held until its next sample, as the valve's driver holds it. A measurement is
interpolated linearly between two of its samples, but not across a gap: where they are further apart than
one and a half of the channel's usual steps (or of the grid's, if those are longer), it is missing, as it is
before its first sample and after its last. Nothing is filtered: a channel sampled faster is not averaged.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from forklift.base.arrays import Floats
from forklift.recordings.channels import COMMANDS, TIME
from forklift.recordings.checks import Sampled
from forklift.recordings.formats.signals import Place

_GAP_STEPS = 1.5  # one sample lost makes two steps, and jitter is below half a step
_SAME_INSTANT = 1e-6  # of a period: rounding of the time stamps, below any clock's resolution
_FINEST = 2  # grid points per sample of the longest series: a finer grid would hold no more than it


def onto_grid(
    place: Place, series: Mapping[str, Sampled], rate_hz: float
) -> tuple[Floats, dict[str, Floats]]:
    """All channels at ``k / rate_hz``, k = 0, 1, …

    Parameters
    ----------
    place
        The file, for errors.
    series
        Every channel but the time; times increase strictly [s].
    rate_hz
        The grid's.

    Raises
    ------
    ForkliftError
        ``"time-not-common"`` if the currents' times do not overlap; ``"sample-rate-mismatch"`` if the grid
        would be much finer than any channel.
    """
    starts = [float(series[name].time[0]) for name in COMMANDS]
    ends = [float(series[name].time[-1]) for name in COMMANDS]
    start, end = max(starts), min(ends)
    if end <= start:
        raise place.error(
            "time-not-common",
            f"the commanded currents are not known at the same time: the one begins at {start:.6g} s, the "
            f"other ends at {end:.6g} s; map signals of one recording",
            channel=COMMANDS[0],
            value=start,
            upper=end,
            unit="s",
        )
    points = (end - start) * rate_hz + 1.0
    longest = max(len(found.time) for found in series.values())
    if not points <= _FINEST * longest + 1:
        raise place.error(
            "sample-rate-mismatch",
            f"at sample_rate_hz = {rate_hz:g} there would be {points:.3g} samples, where the longest "
            f"channel has {longest}; state the rate at which it was recorded",
            channel=TIME,
            value=rate_hz,
            upper=rate_hz * _FINEST * longest / points,
            unit="Hz",
        )
    time = np.arange(int(points + _SAME_INSTANT)) / rate_hz
    at = start + time
    return time, {
        name: _held(found, at, rate_hz) if name in COMMANDS else _interpolated(found, at, rate_hz)
        for name, found in series.items()
    }


def _snapped(at: Floats, time: Floats, rate_hz: float) -> Floats:
    """`at`, where a sample's instant is the same but for rounding: that instant."""
    right = np.searchsorted(time, at).clip(0, len(time) - 1)
    left = (right - 1).clip(0)
    near = np.where(np.abs(time[left] - at) < np.abs(time[right] - at), time[left], time[right])
    return np.where(np.abs(near - at) * rate_hz < _SAME_INSTANT, near, at)


def _held(found: Sampled, at: Floats, rate_hz: float) -> Floats:
    held = np.searchsorted(found.time, _snapped(at, found.time, rate_hz), side="right") - 1
    values: Floats = found.values[held.clip(0)]
    return values


def _interpolated(found: Sampled, at: Floats, rate_hz: float) -> Floats:
    there = np.isfinite(found.values)
    time, values = found.time[there], found.values[there]
    if len(time) == 0:
        return np.full(len(at), np.nan)
    usual = float(np.median(np.diff(found.time))) if len(found.time) > 1 else 0.0
    longest = _GAP_STEPS * max(usual, 1.0 / rate_hz)
    at = _snapped(at, time, rate_hz)
    right = np.searchsorted(time, at).clip(0, len(time) - 1)
    left = (right - 1).clip(0)
    exact = time[right] == at
    between = (time[left] < at) & (at < time[right]) & (time[right] - time[left] <= longest)
    return np.where(exact, values[right], np.where(between, np.interp(at, time, values), np.nan))
