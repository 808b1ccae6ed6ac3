"""Parquet: one column a signal, numbers of any kind; a null is a missing sample.

Columns of instants, as pandas writes its ``Datetime``, are in seconds from the first of all of them; so are
durations.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

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
    whole = {name: _nanoseconds(frame[name]) for name in chosen if schema[name].is_temporal()}
    kinds = {name: schema[name] == polars.Duration for name in whole}
    begins = {name: column.min() for name, column in whole.items()}
    columns = {name: frame[name].cast(polars.Float64).to_numpy() for name in chosen if name not in whole}
    for name, column in whole.items():
        alike = [begins[one] for one in whole if kinds[one] == kinds[name] and begins[one] is not None]
        columns[name] = ((column - min(alike, default=0)).cast(polars.Float64) * 1e-9).to_numpy()
    series = {name: Series(np.array(columns[name], dtype=np.float64)) for name in chosen}
    return Signals(series, others=tuple(name for name in schema if name not in series))


def _nanoseconds(column: Any) -> Any:
    """Instants or durations as whole nanoseconds."""
    import polars

    nanoseconds = column.cast(
        polars.Duration("ns") if column.dtype == polars.Duration else polars.Datetime("ns")
    )
    return nanoseconds.cast(polars.Int64)
