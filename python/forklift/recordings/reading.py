"""A recording's file, read, mapped to channels, checked and brought onto one clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.recordings import checks, formats
from forklift.recordings.channels import COMMANDS, TIME, Lifts, table
from forklift.recordings.checks import Sampled
from forklift.recordings.formats.mapping import ChannelMap, Choice
from forklift.recordings.formats.signals import Place, Series
from forklift.recordings.recording import Recording, Role
from forklift.recordings.resample import onto_grid


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
        return min(1.0 / float(np.median(np.diff(self.series[name].time))) for name in COMMANDS)


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
        _check_length(place, name, series.values, times[name])
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

    Channels on one clock stay as they are if that goes with the rate. On several clocks, or with `regrid`,
    they are brought onto one, see `forklift.recordings.resample`.

    Raises
    ------
    ForkliftError
        Everything `forklift.recordings.checks` and `forklift.recordings.resample` raise about the clock and
        the lift.
    """
    time, channels = _on_the_clock(raw, sample_rate_hz, regrid)
    checks.length(raw.place, len(time))
    checks.lift(raw.place, lift, channels)
    return Recording(raw.place.file, lift, load_kg, role, time, channels, raw.sha256, raw.format)


def _on_the_clock(raw: Raw, rate_hz: float, regrid: bool) -> tuple[Floats, dict[str, Floats]]:
    time = raw.series[COMMANDS[0]].time
    if raw.on_one_clock and not (regrid and _uneven(raw, time, rate_hz)):
        clock = table()[TIME]
        checks.unit(raw.place, clock, time)
        checks.clock(raw.place, clock, time, rate_hz)
        return time, {name: found.values for name, found in raw.series.items()}
    return onto_grid(raw.place, raw.series, rate_hz)


def _uneven(raw: Raw, time: Floats, rate_hz: float) -> bool:
    try:
        checks.clock(raw.place, table()[TIME], time, rate_hz)
    except ForkliftError:
        return True
    return False


def _time(choice: Choice, series: Series, common: Series | None, name: str) -> Floats:
    if series.time is not None:
        return series.time
    if common is None:
        raise choice.missing(TIME, ())
    return common.values


def _check_time(place: Place, time: Floats, channel: str) -> None:
    checks.samples(place, TIME, time)
    checks.length(place, len(time))
    checks.increasing(place, time, channel)


def _check_length(place: Place, name: str, values: Floats, time: Floats) -> None:
    if values.shape != time.shape:
        raise place.error(
            "lengths-differ",
            f"{place.label(name)} has {len(values)} samples and its time has {len(time)}; map signals of "
            "one length",
            channel=name,
            value=len(values),
            expected=len(time),
        )
