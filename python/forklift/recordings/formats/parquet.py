"""Parquet: one column a signal, numbers of any kind; a null is a missing sample.

A column of instants or durations, as pandas writes its ``Datetime``, is in seconds from its first.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from forklift.recordings.formats.signals import Choose, Everything, Floats, Place, Series, Signals


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
        name: _seconds(frame[name])
        if schema[name].is_temporal()
        else frame[name].cast(polars.Float64).to_numpy()
        for name in chosen
    }
    return Signals({name: Series(np.array(values, dtype=np.float64)) for name, values in columns.items()})


def _seconds(column: Any) -> Floats:
    """Instants or durations as seconds from the first [s]."""
    import polars

    nanoseconds = column.cast(
        polars.Duration("ns") if column.dtype == polars.Duration else polars.Datetime("ns")
    )
    whole = nanoseconds.cast(polars.Int64)
    values: Floats = ((whole - whole.drop_nulls().first()).cast(polars.Float64) * 1e-9).to_numpy()
    return values
