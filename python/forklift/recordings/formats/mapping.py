"""From the names and units of a file to channels: the ``[channels]`` table of a campaign.

A unit that the file or the table states converts the values. A scale and an offset do so where there is no
unit, and must not contradict one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Any

import numpy as np

from forklift.recordings import units
from forklift.recordings.channels import REQUIRED, TIME, names_other_lift, table
from forklift.recordings.clocks import TIME_SUFFIX
from forklift.recordings.formats import Format
from forklift.recordings.formats.signals import Place, Series, Signals, quoted


@dataclass(frozen=True)
class Source:
    """Where a channel comes from.

    Attributes
    ----------
    channel
        What it is.
    scale, offset
        ``value in the channel's unit = raw * scale + offset``; None: as the unit has it.
    unit
        Of the raw values; empty: as the file states it, if it does; ``"raw"``: none, whatever it states.
    time
        The column with its own time, in the unit that the file states, else [s]; empty: the file's time.
    """

    channel: str
    scale: float | None = None
    offset: float | None = None
    unit: str = ""
    time: str = ""

    @property
    def given(self) -> units.Linear | None:
        """What scale and offset say; None if neither is given."""
        if self.scale is None and self.offset is None:
            return None
        return units.Linear(1.0 if self.scale is None else self.scale, self.offset or 0.0)


@dataclass(frozen=True)
class ChannelMap:
    """The ``[channels]`` table and ``ignore`` of a campaign.

    Attributes
    ----------
    sources
        Name in the file to channel; a name that is a channel's own stands for itself.
    ignore
        Names to pass over.
    """

    sources: Mapping[str, Source] = field(default_factory=dict)
    ignore: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Choice:
    """Which names of one file are which channel; sent to the process that reads the file.

    Attributes
    ----------
    map
        The campaign's.
    known
        All channels there are, in order.
    format
        The file's.
    place
        The file, for errors.
    """

    map: ChannelMap
    known: tuple[str, ...]
    format: Format
    place: Place

    def __call__(self, names: Sequence[str]) -> list[str]:
        """The names that are channels.

        Raises
        ------
        ForkliftError
            ``"source-missing"``, ``"column-unknown"``, ``"column-repeated"``, ``"column-missing"`` or
            ``"channel-repeated"``.
        """
        present = Counter(names)
        for name, source in self.map.sources.items():
            if name not in present and not (self.format.timed and source.channel == TIME):
                raise self._missing_source(name, source, names)
        self._check_times(present, names)
        wanted = [name for name in present if self._wanted(name, present)]
        found: dict[str, str] = {}
        clocks = set(self._times(present).values())
        for name in wanted:
            if present[name] > 1:
                raise self.place.error(
                    "column-repeated",
                    f"{present[name]} columns are called {quoted(name)}; rename or remove all but one",
                    line=self._header,
                    column=name,
                    value=present[name],
                )
            if name in clocks:
                continue
            channel = self.source(name).channel
            if channel in found:
                raise self.place.error(
                    "channel-repeated",
                    f"both {quoted(found[channel])} and {quoted(name)} are {channel}; put one into ignore",
                    line=self._header,
                    channel=channel,
                    column=name,
                    value=[found[channel], name],
                )
            found[channel] = name
        own = self._times(present)
        all_timed = bool(found) and all(name in own for name in found.values())
        for channel in REQUIRED:
            if channel not in found and not (channel == TIME and (self.format.timed or all_timed)):
                raise self.missing(channel, names)
        return wanted

    def source(self, name: str) -> Source:
        """What a wanted name stands for."""
        return self.map.sources.get(name) or Source(name)

    def apply(self, signals: Signals) -> dict[str, Series]:
        """Channel to series in the channels' units, in the table's order.

        Raises
        ------
        ForkliftError
            ``"unit-unknown"``, ``"unit-of-another-kind"``, ``"unit-contradicts-unit"``,
            ``"unit-contradicts-scale"``, ``"unit-needs-scale"``, ``"time-missing"``.
        """
        clocks = self._times(signals.series)
        found = {}
        for name, own in signals.series.items():
            if name in clocks.values():
                continue
            if name in clocks:
                own = self._timed(name, own, self._in_seconds(clocks[name], signals.series[clocks[name]]))
            found[self.source(name).channel] = self._converted(name, own)
        if clocks and TIME in found:  # columns of several lengths end in empty cells
            common = found[TIME]
            for channel, own in found.items():
                if own.time is None and channel != TIME:
                    found[channel] = replace(self._timed(self._name(channel), own, common), time=None)
            found[TIME] = self._timed(self._name(TIME), common, common)
            found[TIME] = replace(found[TIME], time=None)
        return {channel: found[channel] for channel in self.known if channel in found}

    def _name(self, channel: str) -> str:
        """The name in the file that stands for a channel."""
        return next((name for name, source in self.map.sources.items() if source.channel == channel), channel)

    def located(self, signals: Signals) -> Place:
        """The place, with the names of columns and the lines of rows."""
        clocks = set(self._times(signals.series).values())
        columns = {self.source(name).channel: name for name in signals.series if name not in clocks}
        return replace(self.place, columns=columns, lines=None if clocks else signals.lines)

    def missing(self, channel: str, names: Sequence[str]) -> Exception:
        """The error that nothing in the file is `channel`."""
        return self.place.error(
            "column-missing",
            f"there is no column {channel}{_near(channel, names, channel)}; add it, or name the column that "
            f"is {channel} in [channels] of campaign.toml, or with convert --channel",
            line=self._header,
            channel=channel,
        )

    def _times(self, present: Collection[str]) -> dict[str, str]:
        """By name of a channel's column that of its own time."""
        own = {name: source.time for name, source in self.map.sources.items() if source.time}
        if not self.format.picks:
            for name in present:
                if name.endswith(TIME_SUFFIX) and name.removesuffix(TIME_SUFFIX) in present:
                    own.setdefault(name.removesuffix(TIME_SUFFIX), name)
        return {name: time for name, time in own.items() if name in present and time in present}

    def _check_times(self, present: Collection[str], names: Sequence[str]) -> None:
        for name, source in self.map.sources.items():
            if source.time and source.time not in present:
                raise self.place.error(
                    "source-missing",
                    f"[channels] takes the time of {quoted(name)} from {quoted(source.time)}, which the file "
                    f"does not have{_near(source.time, names, source.channel)}; correct the name",
                    line=self._header,
                    channel=source.channel,
                    column=source.time,
                    value=source.time,
                )

    def _in_seconds(self, name: str, clock: Series) -> Series:
        """A column of times in seconds, from the unit that the file or the column's brackets state."""
        stated = clock.unit.strip() or units.in_brackets(name, table()[TIME].unit)
        linear = units.conversion(stated, table()[TIME].unit)
        if linear is None and units.known(stated):
            raise self.place.error(
                "unit-of-another-kind",
                f"{quoted(name)} is to hold times, but is in {quoted(stated)}, which is no unit of time; "
                "name another column",
                line=self._header,
                column=name,
                value=stated,
                unit=table()[TIME].unit,
            )
        return clock if linear is None else replace(clock, values=clock.values * linear.scale)

    def _timed(self, name: str, own: Series, clock: Series) -> Series:
        """The series on its own time; rows in which both are empty are no samples."""
        if clock.values.shape != own.values.shape:
            return replace(own, time=clock.values)  # told as lengths that differ
        there = np.isfinite(clock.values)
        lost = np.flatnonzero(~there & np.isfinite(own.values))
        if len(lost):
            raise self.place.error(
                "time-missing",
                f"{quoted(name)} has a sample where its time has none; give the sample its time, or empty it",
                row=int(lost[0]),
                channel=self.source(name).channel,
                column=name,
            )
        return replace(own, values=own.values[there], time=clock.values[there])

    def _converted(self, name: str, own: Series) -> Series:
        """The series in the channel's unit."""
        found = self.linear(name, own.unit)
        if found.scale == 1.0 and found.offset == 0.0:
            return own
        with np.errstate(over="ignore"):  # what becomes infinite is found among the samples
            return replace(own, values=own.values * found.scale + found.offset)

    def linear(self, name: str, unit: str) -> units.Linear:
        """How the values of a source, whose file states `unit`, come to the channel's unit."""
        source = self.source(name)
        channel = table()[source.channel]
        stated = unit.strip() or (units.in_brackets(name, channel.unit) if name != source.channel else "")
        asked = source.unit or stated
        facts: dict[str, Any] = {
            "channel": source.channel,
            "column": name,
            "value": asked,
            "unit": channel.unit,
        }
        given = source.given
        if source.unit and stated and not units.says_nothing(source.unit):
            self._check_units(name, source.unit, stated, facts)
        if units.says_nothing(asked) or not asked:
            return given or units.Linear(1.0, 0.0)
        if units.is_share(asked):
            if given is None:
                raise self.place.error(
                    "unit-needs-scale",
                    f"{quoted(name)} is in {quoted(asked)}, of which only you know what 100 % is in "
                    f"{channel.unit}; give scale in [channels], the {channel.unit} of one of them",
                    **facts,
                )
            return given
        if source.unit and not units.known(asked):
            raise self.place.error(
                "unit-unknown",
                f"{quoted(name)} is mapped with the unit {quoted(asked)}, which is not known; write one such "
                f"as {channel.unit}, or scale and offset",
                **facts,
            )
        meant = units.conversion(asked, channel.unit)
        if meant is None and units.known(asked):
            raise self.place.error(
                "unit-of-another-kind",
                f"{quoted(name)} is in {quoted(asked)}, which is no unit of {source.channel} "
                f'({channel.unit}); map another signal, or write unit = "raw" and scale if the unit is wrong',
                **facts,
            )
        if meant is None:
            return given or units.Linear(1.0, 0.0)
        if given is not None and given != meant:
            where = "[channels] says" if source.unit else "the file states"
            raise self.place.error(
                "unit-contradicts-scale",
                f"{quoted(name)} is mapped with scale = {given.scale:g} and offset = {given.offset:g}, but "
                f"{where} {quoted(asked)}, which is scale = {meant.scale:g} and offset = {meant.offset:g}; "
                'take one of them out, or write unit = "raw" if the unit is wrong',
                scale=meant.scale,
                offset=meant.offset,
                **facts,
            )
        return meant

    def _check_units(self, name: str, asked: str, stated: str, facts: dict[str, Any]) -> None:
        channel = table()[self.source(name).channel]
        if units.says_nothing(stated) or not units.known(stated) or units.is_share(asked):
            return
        if units.conversion(asked, channel.unit) != units.conversion(stated, channel.unit):
            raise self.place.error(
                "unit-contradicts-unit",
                f"{quoted(name)} is mapped with the unit {quoted(asked)}, but the file states "
                f'{quoted(stated)}; take the unit out of [channels], or write unit = "raw" and scale if the '
                "file is wrong",
                stated=stated,
                **facts,
            )

    def _wanted(self, name: str, present: Collection[str]) -> bool:
        if name in self._times(present).values():
            return True
        if name in self.map.sources:
            return not (
                self.format.timed and self.map.sources[name].channel == TIME and self.format.name == "mdf4"
            )
        if name in self.map.ignore:
            return False
        if name in self.known:
            return True
        if self.format.picks:
            return False
        what = f"column {quoted(name)} is no channel" if name else "a column has no name"
        near = _near(name, [known for known in self.known if known not in self._taken()], name)
        raise self.place.error(
            "column-unknown",
            f"{what}{near}; rename it, map it (in [channels] of campaign.toml, or with convert "
            "--channel), or list it in ignore",
            line=self._header,
            column=name,
            value=name,
            known=list(self.known),
        )

    def _taken(self) -> set[str]:
        return {source.channel for source in self.map.sources.values()}

    def _missing_source(self, name: str, source: Source, names: Sequence[str]) -> Exception:
        return self.place.error(
            "source-missing",
            f"[channels] takes {source.channel} from {quoted(name)}, which the file does not have"
            f"{_near(name, names, source.channel)}; correct the name, or take it out of [channels]",
            line=self._header,
            channel=source.channel,
            column=name,
            value=name,
        )

    @property
    def _header(self) -> int | None:
        return 1 if self.format.name == "csv" else None


def _near(name: str, names: Sequence[str], channel: str) -> str:
    """The name nearest to one that is missing for `channel`; none of the other lift's."""
    near = get_close_matches(name, [one for one in names if not names_other_lift(one, channel)], n=1)
    return f" (did you mean {quoted(near[0])}?)" if near and near[0] != name else ""
