"""CAN bus logs through python-can, decoded with a DBC by cantools; every message keeps its own time stamps.

A signal is asked for by its name, as ``Message.Signal`` where several messages have the name, and with
``@CHANNEL`` behind it where several buses carry the message. Times count from the log's first frame. Error
frames and remote frames hold no signals; of frames of one message with the same stamp the last counts; a
multiplexed signal has a sample wherever its multiplexer selects it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from forklift.recordings.formats.optional import require
from forklift.recordings.formats.signals import Choose, Everything, Place, Series, Signals, quoted

EXTRA = "can"


class _Frame(NamedTuple):
    """What tells one message on one bus from all others."""

    identifier: int
    extended: bool
    channel: str


Frames = dict[_Frame, list[tuple[float, bytes]]]


class _Source(NamedTuple):
    frame: _Frame
    message: Any
    signal: Any


def read(place: Place, choose: Choose) -> Signals:
    """The chosen signals of a CAN log, in physical values.

    Raises
    ------
    ForkliftError
        Those of `Bus.read` and `Bus.series`, and what `choose` raises.
    """
    bus = Bus.read(place)
    if isinstance(choose, Everything):
        return Signals(bus.all())
    return Signals(bus.series(choose(bus.names)))


@dataclass(frozen=True)
class Bus:
    """The frames of a log, and where in them each signal is."""

    place: Place
    frames: Frames
    sources: dict[str, list[_Source]]

    @classmethod
    def read(cls, place: Place, origin_s: float | None = None) -> Bus:
        """The log at `place`; its times count from `origin_s`, else from its first frame [s].

        Raises
        ------
        ForkliftError
            ``"extra-missing"``, ``"dbc-missing"``, ``"dbc-unreadable"``, ``"dbc-of-another-bus"``.
        """
        database = _database(place)
        frames = _frames(place, origin_s)
        sources = _sources(database, frames)
        if not sources:
            raise place.error(
                "dbc-of-another-bus",
                f"none of the {len(frames)} messages in the log is in the DBC; name the DBC of this bus",
                value=len(frames),
            )
        return cls(place, frames, sources)

    @property
    def names(self) -> list[str]:
        """Every name a signal may be asked for by."""
        return list(self.sources)

    def all(self) -> dict[str, Series]:
        """Every signal by its shortest name of its own."""
        shortest: dict[tuple[_Frame, str], str] = {}
        for name, sources in self.sources.items():
            if len(sources) == 1:
                shortest.setdefault((sources[0].frame, sources[0].signal.name), name)
        return self.series(shortest.values())

    def series(self, names: Iterable[str]) -> dict[str, Series]:
        """The signals of these names.

        Raises
        ------
        ForkliftError
            ``"column-repeated"`` if several messages have a name.
        """
        return _decoded({name: _only(name, self.sources[name], self.place) for name in names}, self.frames)


def _database(place: Place) -> Any:
    cantools = require("cantools", EXTRA, place)
    if not place.dbc:
        raise place.error(
            "dbc-missing",
            'a CAN log needs the DBC that says what its frames hold; write dbc = "NAME.dbc" into '
            "campaign.toml, or give --dbc",
        )
    database = cantools.database.Database(strict=False)
    for file in place.dbc:
        try:
            database.add_dbc_file(file, encoding=_encoding(file))
        except FileNotFoundError:
            raise place.error(
                "dbc-missing", f"there is no DBC {file}; put it there or correct its name", value=file
            ) from None
        except Exception as error:  # whatever its parser raises
            raise place.error(
                "dbc-unreadable",
                f"{file} is damaged or is no DBC ({quoted(error, 80)}); export it again",
                value=file,
            ) from error
    return database


def _encoding(file: str) -> str:
    """Of a DBC: UTF-8, else cp1252, in which most tools write it; a °C of the one is no text of the other."""
    try:
        Path(file).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _frames(place: Place, first: float | None) -> Frames:
    """The time [s] and the data of every data frame, by message."""
    can = require("can", EXTRA, place)
    found: Frames = defaultdict(list)
    with can.LogReader(place.path) as log:
        for frame in log:
            first = frame.timestamp if first is None else first
            if frame.is_error_frame or frame.is_remote_frame:
                continue
            key = _Frame(frame.arbitration_id, bool(frame.is_extended_id), str(frame.channel))
            found[key].append((frame.timestamp - first, bytes(frame.data)))
    return dict(found)


def _sources(database: Any, frames: Iterable[_Frame]) -> dict[str, list[_Source]]:
    """Every name of a signal to where it is found."""
    messages = {(one.frame_id, bool(one.is_extended_frame)): one for one in database.messages}
    found: dict[str, list[_Source]] = defaultdict(list)
    for frame in sorted(frames):
        message = messages.get((frame.identifier, frame.extended))
        if message is None:
            continue
        for signal in message.signals:
            source = _Source(frame, message, signal)
            long = f"{message.name}.{signal.name}"
            for name in (signal.name, long, f"{long}@{frame.channel}"):
                found[name].append(source)
    return dict(found)


def _only(name: str, sources: list[_Source], place: Place) -> _Source:
    if len(sources) == 1:
        return sources[0]
    messages = sorted({one.message.name for one in sources})
    long = [f"{one.message.name}.{one.signal.name}" for one in sources]
    if len(messages) < len(sources):
        long = [f"{one}@{source.frame.channel}" for one, source in zip(long, sources, strict=True)]
    raise place.error(
        "column-repeated",
        f"{len(sources)} messages have a signal {name!r}; name one of {', '.join(long[:5])} in [channels]",
        column=name,
        value=long,
    )


def _decoded(chosen: dict[str, _Source], frames: Frames) -> dict[str, Series]:
    """The chosen signals, each message decoded once."""
    from cantools.database import DecodeError

    wanted: dict[_Frame, list[str]] = defaultdict(list)
    for name, source in chosen.items():
        wanted[source.frame].append(name)
    samples: dict[str, dict[float, float]] = {name: {} for name in chosen}
    for frame, names in wanted.items():
        message = chosen[names[0]].message
        for time, data in frames[frame]:
            try:
                values = message.decode(data, decode_choices=False, allow_truncated=True)
            except DecodeError:
                continue  # a multiplexer's value that the DBC does not know: no sample of any signal
            for name in names:
                value = values.get(chosen[name].signal.name)
                if value is not None:
                    samples[name][time] = float(value)
    return {
        name: Series(
            np.array(list(found.values()), dtype=np.float64),
            np.array(list(found), dtype=np.float64),
            str(chosen[name].signal.unit or ""),
        )
        for name, found in samples.items()
    }
