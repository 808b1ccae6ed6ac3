"""From the names and units of a file to channels: the ``[channels]`` table of a campaign."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

import numpy as np

from forklift.recordings.channels import REQUIRED, TIME
from forklift.recordings.formats import Format
from forklift.recordings.formats.signals import Place, Series, Signals, quoted


@dataclass(frozen=True)
class Source:
    """Where a channel comes from: ``value in SI = raw * scale + offset``."""

    channel: str
    scale: float = 1.0
    offset: float = 0.0

    def apply(self, series: Series) -> Series:
        """The series in the channel's unit; a time of its own is in seconds already."""
        if self.scale == 1.0 and self.offset == 0.0:
            return series
        with np.errstate(over="ignore"):  # what becomes infinite is found among the samples
            return replace(series, values=series.values * self.scale + self.offset)


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
        wanted = [name for name in present if self._wanted(name)]
        found: dict[str, str] = {}
        for name in wanted:
            if present[name] > 1:
                raise self.place.error(
                    "column-repeated",
                    f"{present[name]} columns are called {quoted(name)}; rename or remove all but one",
                    line=self._header,
                    column=name,
                    value=present[name],
                )
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
        for channel in REQUIRED:
            if channel not in found and not (self.format.timed and channel == TIME):
                raise self.missing(channel, names)
        return wanted

    def source(self, name: str) -> Source:
        """What a wanted name stands for."""
        return self.map.sources.get(name) or Source(name)

    def apply(self, signals: Signals) -> dict[str, Series]:
        """Channel to series in SI units, in the table's order."""
        found = {
            self.source(name).channel: self.source(name).apply(own) for name, own in signals.series.items()
        }
        return {channel: found[channel] for channel in self.known if channel in found}

    def located(self, signals: Signals) -> Place:
        """The place, with the names of columns and the lines of rows."""
        columns = {self.source(name).channel: name for name in signals.series}
        return replace(self.place, columns=columns, lines=signals.lines)

    def missing(self, channel: str, names: Sequence[str]) -> Exception:
        """The error that nothing in the file is `channel`."""
        return self.place.error(
            "column-missing",
            f"there is no column {channel}{_near(channel, names)}; add it, or name the column that is "
            f"{channel} in [channels] of campaign.toml",
            line=self._header,
            channel=channel,
        )

    def _wanted(self, name: str) -> bool:
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
        near = _near(name, [known for known in self.known if known not in self._taken()])
        raise self.place.error(
            "column-unknown",
            f"{what}{near}; rename it, map it in [channels] of campaign.toml, or list it in ignore",
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
            f"{_near(name, names)}; correct the name, or take it out of [channels]",
            line=self._header,
            channel=source.channel,
            column=name,
            value=name,
        )

    @property
    def _header(self) -> int | None:
        return 1 if self.format.name == "csv" else None


def _near(name: str, names: Sequence[str]) -> str:
    near = get_close_matches(name, names, n=1)
    return f" (did you mean {quoted(near[0])}?)" if near and near[0] != name else ""
