"""Parquet: one column a signal, numbers of any kind; a null is a missing sample."""

from __future__ import annotations

from pathlib import Path

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
        chosen = [name for name in chosen if schema[name].is_numeric()]
    for name in chosen:
        if not schema[name].is_numeric():
            raise place.error(
                "cell-not-a-number",
                f"column {name!r} holds {schema[name]}, not numbers; export it as numbers, a time as seconds",
                column=name,
                value=str(schema[name]),
            )
    frame = polars.read_parquet(source, columns=chosen)
    columns = {name: frame[name].cast(polars.Float64).to_numpy() for name in chosen}
    return Signals({name: Series(np.array(values, dtype=np.float64)) for name, values in columns.items()})
