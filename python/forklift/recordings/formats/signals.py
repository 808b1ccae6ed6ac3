"""What every format gives: named series as the file has them, and the place they stand at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError


@dataclass(frozen=True)
class Series:
    """Values as the file has them, NaN for a missing sample.

    Attributes
    ----------
    values
        (n,), in the file's unit.
    time
        (n,), s; None: on the file's time column.
    unit
        As the file states it; empty if it does not.
    """

    values: Floats
    time: Floats | None = None
    unit: str = ""


@dataclass(frozen=True)
class Signals:
    """The chosen series of one file by their names there.

    Attributes
    ----------
    series
        Name to series.
    lines
        (n,), the line on which each row ends, counted from 1; None for a binary file.
    others
        Of a table of which everything was asked for: the columns that hold no numbers.
    passed
        Of a file of variables: those that hold numbers and are no signals, and what they are instead.
    """

    series: Mapping[str, Series]
    lines: NDArray[np.int64] | None = None
    others: tuple[str, ...] = ()
    passed: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Place:
    """A file, for errors that say where.

    Attributes
    ----------
    file
        Its name as the campaign has it.
    path
        Where it stands.
    columns
        Channel to the name of its column or signal in the file, where these differ.
    lines
        See `Signals`.
    dbc
        Where the DBCs of a CAN log stand.
    """

    file: str
    path: str
    columns: Mapping[str, str] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    dbc: tuple[str, ...] = ()

    def label(self, channel: str) -> str:
        """The channel, and its column's name where that differs."""
        column = self.columns.get(channel, channel)
        return channel if column == channel else f"{channel} (column {column!r})"

    def error(self, code: str, sentence: str, *, row: int | None = None, **facts: Any) -> ForkliftError:
        """`sentence` after the file and the line of `row`, or its number in a binary file; both as facts."""
        head, at = self.file, dict[str, Any](file=self.file, path=self.path)
        if row is not None and self.lines is not None:
            facts = {"line": int(self.lines[row]), **facts}
        elif row is not None:
            at["sample"] = int(row) + 1
            head += f", sample {at['sample']}"
        if facts.get("line") is not None:
            head += f", line {facts['line']}"
        channel = facts.get("channel")
        if channel is not None:
            facts.setdefault("column", self.columns.get(channel, channel))
        at |= {name: fact for name, fact in facts.items() if fact is not None}
        return ForkliftError(code, f"{head}: {sentence}", **at)


class Choose(Protocol):
    """Which of a file's names to load; raises if what it needs is not there."""

    def __call__(self, names: Sequence[str]) -> list[str]: ...


@dataclass(frozen=True)
class Everything:
    """All signals that are numbers, each by its shortest name of its own; what is none is passed over."""

    def __call__(self, names: Sequence[str]) -> list[str]:
        """All names, each once."""
        return list(dict.fromkeys(name for name in names if name))


def quoted(value: object, longest: int = 40) -> str:
    """A value from a file as a message may show it: one line of printable characters, not too long."""
    text = ascii(value) if not str(value).isprintable() else repr(value)
    return text if len(text) <= longest else text[: longest - 1] + "…"


def unreadable(place: Place, name: str, cause: object) -> ForkliftError:
    """What to say of a file that its format's library could not read."""
    return place.error(
        "recording-unreadable",
        f"the file is damaged or is not {name}; record or export it again",
        format=name,
        cause=quoted(cause, 200),
    )
