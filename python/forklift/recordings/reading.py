"""A recording's file, read, mapped to channels and checked; every channel keeps its clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.recordings import checks, formats
from forklift.recordings.channels import COMMANDS, TIME, Lifts, table
from forklift.recordings.clocks import Rows, Sampled, union
from forklift.recordings.formats.mapping import ChannelMap, Choice
from forklift.recordings.formats.signals import Place, Series
from forklift.recordings.recording import Recording, Role


@dataclass(frozen=True)
class Raw:
    """Channels in SI units on the file's own clocks.

    Attributes
    ----------
    place
        The file, with the names of its columns and its lines.
    series
        Every channel but the time.
    sha256, format
        Of the file.
    """

    place: Place
    series: dict[str, Sampled]
    sha256: str
    format: str

    @property
    def on_one_clock(self) -> bool:
        """Whether all channels have the same times."""
        first, *others = (found.time for found in self.series.values())
        return all(first is time or np.array_equal(first, time) for time in others)

    @property
    def command_rate_hz(self) -> float:
        """The sample rate of the slower commanded current [Hz]."""
        return min(1.0 / self.series[name].step_s for name in COMMANDS)


def load(place: Place, channel_map: ChannelMap) -> Raw:
    """The channels of the file at `place`, each checked by itself.

    Raises
    ------
    ForkliftError
        Everything `forklift.recordings.formats.read`, `Choice` and `forklift.recordings.checks` raise about
        one channel.
    """
    known = table()
    choice = Choice(channel_map, tuple(known), formats.format_of(place.file), place)
    signals, sha256 = formats.read(place, choice)
    place = choice.located(signals)
    found = choice.apply(signals)
    common = found.pop(TIME, None)
    times = {name: _time(choice, series, common, name) for name, series in found.items()}
    if common is not None:
        _check_time(place, common.values, TIME)
    for name, series in found.items():
        checks.lengths(place, name, series.values, times[name])
        checks.samples(place, name, series.values)
        if series.time is not None:
            _check_time(place, series.time, name)
    for name, series in found.items():
        checks.unit(place, known[name], series.values)
    sampled = {name: Sampled(times[name], series.values) for name, series in found.items()}
    return Raw(place, sampled, sha256, choice.format.name)


def build(
    raw: Raw, *, lift: Lifts, load_kg: float, role: Role, sample_rate_hz: float, regrid: bool = False
) -> Recording:
    """The recording at the campaign's sample rate.

    Channels on one clock must go with the rate; on several clocks each keeps its own, see
    `forklift.recordings.clocks`.

    Raises
    ------
    ForkliftError
        Everything `forklift.recordings.checks` and `forklift.recordings.clocks` raise about clock and lift.
    """
    time, channels, rows = _on_their_clocks(raw, sample_rate_hz, regrid)
    checks.length(raw.place, len(time))
    checks.lift(raw.place, lift, channels)
    return Recording(raw.place.file, lift, load_kg, role, time, channels, raw.sha256, raw.format, rows)


def _on_their_clocks(
    raw: Raw, rate_hz: float, regrid: bool
) -> tuple[Floats, dict[str, Floats], dict[str, Rows]]:
    time = raw.series[COMMANDS[0]].time
    if raw.on_one_clock:
        values = {name: found.values for name, found in raw.series.items()}
        clock = table()[TIME]
        if regrid:
            checks.divides(raw.place, clock, float(np.median(np.diff(time))), rate_hz)
            time, values = _at_rate(time, values, rate_hz)
        checks.unit(raw.place, clock, time)
        checks.clock(raw.place, clock, time, rate_hz)
        return time, values, {}
    for name, found in raw.series.items():
        whose = f"the time of {raw.place.label(name)}"
        checks.unit(raw.place, table()[TIME], found.time - found.time[0], whose)
    return union(raw.place, raw.series)


def _at_rate(time: Floats, values: dict[str, Floats], rate_hz: float) -> tuple[Floats, dict[str, Floats]]:
    """The samples at this rate, none of them moved or made up.

    Of a clock that is a whole number of times as fast every so-manieth row is kept. Where rows were lost,
    missing samples stand for them, and the commanded currents are held.
    """
    usual = float(np.median(np.diff(time)))
    every = max(1, round(1.0 / (usual * rate_hz)))
    lost = np.maximum(np.round(np.diff(time) / usual).astype(np.int64) - 1, 0)
    if lost.sum() > len(time):
        return time, values
    place = np.repeat(np.arange(len(time)), np.append(lost, 0) + 1)
    first = np.r_[True, np.diff(place) > 0]
    steps = np.arange(len(place)) - np.flatnonzero(first)[np.cumsum(first) - 1]
    share = steps / (np.append(lost, 0)[place] + 1)
    full = time[place] + share * np.append(np.diff(time), 0.0)[place]
    columns = {
        name: column[place] if name in COMMANDS else np.where(first, column[place], np.nan)
        for name, column in values.items()
    }
    return full[::every], {name: column[::every] for name, column in columns.items()}


def _time(choice: Choice, series: Series, common: Series | None, name: str) -> Floats:
    if series.time is not None:
        return series.time
    if common is None:
        raise choice.missing(TIME, ())
    return common.values


def _check_time(place: Place, time: Floats, channel: str) -> None:
    checks.samples(place, TIME, time)
    checks.length(place, len(time), channel)
    checks.increasing(place, time, channel)
