"""Parquet: one column a signal, numbers of any kind; a null is a missing sample.

Columns of instants, as pandas writes its ``Datetime``, are in seconds from the first of all of them; so are
durations, and times of the day.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.recordings.formats.signals import Choose, Everything, Place, Series, Signals


def read(place: Place, choose: Choose) -> Signals:
    """The chosen columns of a Parquet file.

    Raises
    ------
    ForkliftError
        ``"cell-not-a-number"`` for a column of another kind, and what `choose` raises.
    """
    import polars

    source = Path(place.path)
    schema = polars.read_parquet_schema(source)
    chosen = choose(list(schema))
    if isinstance(choose, Everything):
        chosen = [name for name in chosen if schema[name].is_numeric() or schema[name].is_temporal()]
    for name in chosen:
        if not schema[name].is_numeric() and not schema[name].is_temporal():
            raise place.error(
                "cell-not-a-number",
                f"column {name!r} holds {schema[name]}, not numbers; export it as numbers, a time as seconds",
                column=name,
                value=str(schema[name]),
            )
    frame = polars.read_parquet(source, columns=chosen)
    columns = {
        name: frame[name].cast(polars.Float64).to_numpy() for name in chosen if schema[name].is_numeric()
    }
    whole = {name: _whole(frame[name]) for name in chosen if name not in columns}
    for name, (kind, first_ns, seconds) in whole.items():
        firsts = [first for other, first, _ in whole.values() if other == kind and first is not None]
        columns[name] = seconds if first_ns is None else seconds + (first_ns - min(firsts)) * 1e-9
    series = {name: Series(np.array(columns[name], dtype=np.float64)) for name in chosen}
    return Signals(series, others=tuple(name for name in schema if name not in series))


def _whole(column: Any) -> tuple[str, int | None, Floats]:
    """Of instants, durations or times of the day: which of these, the first [ns], how much later all are [s].

    A date is counted in days and others in their own ticks, so that none is too early or too late.
    """
    import polars

    ticks_ns = {"ns": 1, "us": 1_000, "ms": 1_000_000}
    kind, tick = "instant", ticks_ns.get(getattr(column.dtype, "time_unit", None) or "ns", 1)
    if column.dtype == polars.Date:
        tick = 86_400_000_000_000
    elif column.dtype in (polars.Duration, polars.Time):
        kind = str(column.dtype.base_type())
    counted = column.to_physical().cast(polars.Int64)
    first = counted.min()
    later = ((counted - (first or 0)).cast(polars.Float64) * (tick * 1e-9)).to_numpy()
    return kind, None if first is None else first * tick, later
