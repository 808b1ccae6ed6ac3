"""Channels on clocks of their own: how they stand together in one recording, without being resampled.

A recording's instants are the union of its channels' own time stamps. A measurement has a value at its own
instants only; what drives the machine (a truck's commanded currents, held by the valve's driver) is held from
each of its samples until the next, so that it is known at every instant. Nothing is interpolated, averaged or
filtered.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.recordings.channels import COMMANDS
from forklift.recordings.formats.signals import Place

Rows = NDArray[np.intp]

TIME_SUFFIX = ".time_s"
"""A table's column with a channel's name and this is that channel's own time [s]."""
SAME_INSTANT_S = 1e-6
"""Time stamps this close are one instant: finer than a logger's clock, and a lift moves a micrometre."""
GAP_STEPS = 1.5
"""A step of more than this many usual ones is a gap: one lost sample makes two, jitter less than half."""
EVEN = 0.01
"""A clock is even if no instant is further off an even grid than this share of a step."""
COMMAND_STEP_S = 0.005
"""Step on which uneven or fast commands drive the simulation: the fixed solver's own at 50 Hz."""


@dataclass(frozen=True)
class Sampled:
    """One channel's samples at its own times, both (n,)."""

    time: Floats
    values: Floats

    @property
    def step_s(self) -> float:
        """The usual (median) step from sample to sample [s]; 0 if there is only one sample."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0


def union(
    place: Place,
    series: Mapping[str, Sampled],
    driving: Sequence[str] = COMMANDS,
    slack: float = SAME_INSTANT_S,
) -> tuple[Floats, dict[str, Floats], dict[str, Rows]]:
    """All channels at all their instants, from the first instant at which all that drives is known.

    The instants end with the driving channel that ends first. What was measured before or after is left out,
    and so is a channel that has no sample in between.

    Parameters
    ----------
    place
        The file, for errors.
    series
        Every channel but the time; times increase strictly [s].
    driving
        The channels that are held: a truck's commanded currents. Of none, all instants are kept.
    slack
        Time stamps this close [s] are one instant.

    Returns
    -------
    tuple
        (n,) instants from zero [s], which stands for that first instant; by channel (n,) values, NaN where
        the channel has no sample; by channel the rows of its own samples. Those of a driving channel hold the
        first and the last instant, at which it is known.

    Raises
    ------
    ForkliftError
        ``"time-not-common"`` if the driving channels' times do not overlap.
    """
    begins, ends = ([float(series[name].time[k]) for name in driving or series] for k in (0, -1))
    start, end = (max(begins), min(ends)) if driving else (min(begins), max(ends))
    if end <= start:
        raise place.error(
            "time-not-common",
            f"{' and '.join(driving)} are not known at the same time: the one begins at {start:.6g} s, the "
            f"other ends at {end:.6g} s; map signals of one recording",
            channel=driving[0],
            value=start,
            upper=end,
            unit="s",
        )
    kept = {
        name: np.flatnonzero((found.time >= start - slack) & (found.time <= end + slack))
        for name, found in series.items()
    }
    stamps = np.sort(np.concatenate([series[name].time[rows] for name, rows in kept.items()]))
    instants = stamps[np.r_[True, np.diff(stamps) > slack]]
    channels, own = {}, {}
    for name, found in series.items():
        rows = np.searchsorted(instants, found.time[kept[name]] + 0.5 * slack, side="right") - 1
        rows = np.maximum(rows, 0)
        bounds = [0, len(instants) - 1] if name in driving else []
        values = np.full(len(instants), np.nan)
        values[rows] = found.values[kept[name]]
        if name in driving:
            held = np.searchsorted(found.time, instants + slack, side="right") - 1
            values = found.values[held]
        if len(rows) or name in driving:
            channels[name], own[name] = values, np.unique(np.append(rows, bounds).astype(np.intp))
    return instants - instants[0], channels, own


def is_even(time: Floats) -> bool:
    """Whether the instants are those of an even clock, within `EVEN` of a step."""
    if len(time) < 3:
        return True
    step = (time[-1] - time[0]) / (len(time) - 1)
    return bool(np.max(np.abs(time - time[0] - step * np.arange(len(time)))) <= EVEN * step)


def driving(time: Floats, command: Floats) -> tuple[Floats, Floats]:
    """The commands as the fixed-step solver is driven by them: (m,) [s] and (m, 2) [A], held in between.

    On an even clock not faster than 1 / `COMMAND_STEP_S` they stay as they are. Otherwise they are the means
    of the held commands over steps of at most `COMMAND_STEP_S`, so that no change comes earlier or later on
    average than it did.
    """
    usual = float(np.median(np.diff(time))) if len(time) > 1 else COMMAND_STEP_S
    if len(time) < 2 or (is_even(time) and usual >= COMMAND_STEP_S * (1.0 - EVEN)):
        return time, command
    edges = time[0] + COMMAND_STEP_S * np.arange(int((time[-1] - time[0]) / COMMAND_STEP_S) + 2)
    far = np.append(time, edges[-1] + COMMAND_STEP_S)
    means = [
        np.diff(np.interp(edges, far, np.append(0.0, np.cumsum(column * np.diff(far))))) / COMMAND_STEP_S
        for column in command.T
    ]
    # The means of what is held are rounded: a constant stays the constant it was.
    lows, highs = command.min(axis=0), command.max(axis=0)
    return edges[:-1], np.clip(np.column_stack(means), lows, highs)


def broken_at_gaps(found: Sampled) -> Sampled:
    """The samples with one missing sample (NaN) put into every gap of the clock."""
    steps = np.diff(found.time)
    if not len(steps):
        return found
    gaps = np.flatnonzero(steps > GAP_STEPS * np.median(steps))
    between = 0.5 * (found.time[gaps] + found.time[gaps + 1])
    return Sampled(np.insert(found.time, gaps + 1, between), np.insert(found.values, gaps + 1, np.nan))


def nearest(at: Floats, found: Sampled) -> Floats:
    """At each instant the channel's nearest own sample, NaN where that is more than half a step away.

    No sample is taken twice if the instants are not closer than the channel's steps.
    """
    if not len(found.time):
        return np.full(len(at), np.nan)
    right = np.searchsorted(found.time, at).clip(0, len(found.time) - 1)
    left = (right - 1).clip(0)
    nearer = np.abs(found.time[left] - at) < np.abs(found.time[right] - at)
    place = np.where(nearer, left, right)
    step = max(found.step_s, float(np.median(np.diff(at))) if len(at) > 1 else 0.0)
    near = np.abs(found.time[place] - at) <= 0.5 * step * (1.0 + EVEN)
    return np.where(near, found.values[place], np.nan)
