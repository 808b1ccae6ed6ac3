"""CSV: a header of names, then one row a sample; comma and decimal point, UTF-8; an empty cell is missing.

Instants (ISO 8601, as data frames write them) are seconds from the column's first.

polars parses the numbers, correctly rounded. Whatever is not plain enough for it, or wrong, is read a
second time with Python's `csv`, cell by cell, so that an error names line and column.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.recordings.formats.instants import instant, seconds
from forklift.recordings.formats.signals import Choose, Everything, Place, Series, Signals, quoted

_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE | re.ASCII)
_BOM = b"\xef\xbb\xbf"


def read(place: Place, choose: Choose) -> Signals:
    """The chosen columns of a CSV file.

    Raises
    ------
    ForkliftError
        ``"text-invalid"``, ``"recording-empty"``, ``"separator-wrong"``, ``"header-missing"``,
        ``"row-ragged"``, ``"cell-not-a-number"``, ``"recording-unreadable"`` and what `choose` raises.
    """
    data = Path(place.path).read_bytes().removeprefix(_BOM)
    text = _decode(data, place)
    names, first = _header(text, place)
    chosen = choose(names)
    columns = [names.index(name) for name in chosen]
    if isinstance(choose, Everything):
        return _all_numbers(text, names, chosen, columns)
    values = quickly(data, len(names), columns)
    if values is None:
        values, lines = carefully(text, names, columns, place)
    else:
        lines = np.arange(values.shape[1], dtype=np.int64) + first + 1
    return Signals({name: Series(row) for name, row in zip(chosen, values, strict=True)}, lines)


def _all_numbers(text: str, names: list[str], chosen: list[str], columns: list[int]) -> Signals:
    """Every column that holds a number; what is none, in it, is missing."""
    rows = [row for row in csv.reader(io.StringIO(text, newline="")) if len(row) == len(names)][1:]
    series, since = {}, dict[str, datetime]()
    for name, k in zip(chosen, columns, strict=True):
        cells = [row[k].strip() for row in rows]
        first = next((found for cell in cells if (found := instant(cell))), None)
        values = np.array([_plain(cell, first) for cell in cells])
        if np.isfinite(values).any():
            series[name] = values
            if first:
                since[name] = first
    return Signals(
        {name: Series(values + _after(since, name)) for name, values in series.items()},
        others=tuple(name for name in names if name not in series),
    )


def _plain(cell: str, since: datetime | None) -> float:
    """A number, or seconds since an instant; missing if it is neither."""
    told = float(cell) if _NUMBER.fullmatch(cell) else seconds(since, cell) if since else None
    return float("nan") if told is None else told


def _decode(data: bytes, place: Place) -> str:
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        start = error.start
    else:
        start = text.find("\0")
        if start < 0:
            return text
        start = len(text[:start].encode())
    line = data.count(b"\n", 0, start) + 1
    raise place.error(
        "text-invalid",
        f"byte {start + 1} of the file is not UTF-8 text; save it as CSV in UTF-8, or give it its format's "
        "suffix",
        line=line,
        value=data[start],
    )


def _header(text: str, place: Place) -> tuple[list[str], int]:
    """The names, and the line on which they end."""
    if not text.strip():
        raise place.error("recording-empty", "the file has no text; record or export it again")
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        names = [name.strip() for name in next(reader)]
    except csv.Error as error:
        raise place.error(
            "recording-unreadable", f"the header is not CSV ({error}); mend its quotes", line=reader.line_num
        ) from error
    if not any(names) or all(_NUMBER.fullmatch(name) for name in names):
        raise place.error(
            "header-missing",
            "the first line must name the columns; add a header such as time_s,current_free_a,current_main_a",
            line=1,
        )
    separator = next((mark for mark in ";\t|" if mark in names[0]), None)
    if len(names) == 1 and separator:
        raise place.error(
            "separator-wrong",
            f"the columns are separated by {separator!r}; save the file with commas and decimal points",
            line=1,
            value=separator,
        )
    return names, reader.line_num


def quickly(data: bytes, width: int, columns: Sequence[int]) -> Floats | None:
    """All chosen columns through polars, (columns, rows), or None if it might differ from `carefully`.

    polars fills a short row up with nulls and passes over empty lines; so all rows must have their commas.
    """
    import polars

    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n")
    _, _, body = data.partition(b"\n")
    if b'"' in data or b"\r" in data:
        return None
    rows = body.count(b"\n") + (not body.endswith(b"\n"))
    if not body or body.count(b",") != (width - 1) * rows:
        return None
    wanted = set(columns)
    schema = {str(k): polars.Float64 if k in wanted else polars.String for k in range(width)}
    try:
        frame = polars.read_csv(body, has_header=False, schema=schema, quote_char=None)
    except polars.exceptions.PolarsError:
        return None
    if frame.height != rows:
        return None
    return np.stack([frame[str(k)].to_numpy() for k in columns])


def carefully(
    text: str, names: Sequence[str], columns: Sequence[int], place: Place
) -> tuple[Floats, NDArray[np.int64]]:
    """All chosen columns cell by cell, (columns, rows), and each row's line; empty last lines are no rows."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    values: list[list[float]] = [[] for _ in columns]
    since: dict[str, datetime] = {}
    lines: list[int] = []
    empty: int | None = None
    try:
        next(reader)
        for row in reader:
            line = reader.line_num
            if not row:
                empty = empty or line
                continue
            if empty or len(row) != len(names):
                line, count = (empty, 0) if empty else (line, len(row))
                raise place.error(
                    "row-ragged",
                    f"the row has {count} cells where the header has {len(names)}; "
                    "give every row a cell for each column, empty where a sample is missing",
                    line=line,
                    value=count,
                    expected=len(names),
                )
            lines.append(line)
            for column, k in zip(values, columns, strict=True):
                first = not column
                column.append(_number(row[k], names[k], line, place, since, first=first))
    except csv.Error as error:
        raise place.error(
            "recording-unreadable", f"the row is not CSV ({error}); mend its quotes", line=reader.line_num
        ) from error
    found = np.array(values, dtype=np.float64).reshape(len(columns), -1)
    for own, k in zip(found, columns, strict=True):
        own += _after(since, names[k])
    return found, np.array(lines, dtype=np.int64)


def _after(since: Mapping[str, datetime], name: str) -> float:
    """By how much a column of instants begins after the first of the file [s]; 0 of any other."""
    return (since[name] - min(since.values())).total_seconds() if name in since else 0.0


def _number(
    cell: str, name: str, line: int, place: Place, since: dict[str, datetime], *, first: bool
) -> float:
    """`since` holds the first instant of each column that has instants, from its `first` cell on."""
    cell = cell.strip()
    if not cell:
        return float("nan")
    if (name in since or first) and (found := instant(cell)) is not None:
        return (found - since.setdefault(name, found)).total_seconds()
    if name in since or not _NUMBER.fullmatch(cell):
        raise place.error(
            "cell-not-a-number",
            f"column {quoted(name)} holds {quoted(cell)}, which is not a number; "
            "write a number, or leave the cell empty if the sample is missing",
            line=line,
            column=name,
            value=cell[:100],
        )
    return float(cell)
