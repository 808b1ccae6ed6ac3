"""MDF4 through asammdf: every signal on the master (the time, s) of its channel group.

A signal is asked for by its name, or as ``group/name`` with the group's acquisition name or number where
several groups have the name. A sample whose invalidation bit is set is missing. Where the file holds CAN
frames and the campaign names a DBC, the signals of the frames are there too.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from typing import Any

import numpy as np

from forklift.base.errors import ForkliftError
from forklift.recordings.formats.can import Bus
from forklift.recordings.formats.optional import require
from forklift.recordings.formats.signals import Choose, Everything, Place, Series, Signals

_BUS = "CAN_DataFrame"
_FRAMES = f"{_BUS}.DataBytes"
"""ASAM MDF bus logging: the channel that holds the frames' data."""


def read(place: Place, choose: Choose) -> Signals:
    """The chosen signals of an MDF4 file, converted to physical values.

    Raises
    ------
    ForkliftError
        ``"extra-missing"`` if asammdf is not there, ``"column-repeated"`` if several groups have a name,
        ``"cell-not-a-number"`` for a signal of text, and what `choose` raises.
    """
    asammdf = require("asammdf", "mdf", place)
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    with asammdf.MDF(place.path) as mdf:
        found = _found(mdf)
        bus = None
        if place.dbc and _FRAMES in mdf.channels_db:
            bus = Bus.read(place, origin_s=mdf.start_time.timestamp())
        on_bus = [name for name in (bus.names if bus else ()) if name not in found]
        if isinstance(choose, Everything):
            return Signals(_all(mdf, found, place) | (bus.all() if bus else {}))
        chosen = choose([*found, *on_bus])
        series = {name: _series(mdf, name, found[name], place) for name in chosen if name in found}
        if bus:
            series |= bus.series([name for name in chosen if name not in found])
        return Signals({name: series[name] for name in chosen})


def _found(mdf: Any) -> dict[str, list[tuple[int, int]]]:
    """Name to (group, index) of each signal that has it."""
    found: dict[str, list[tuple[int, int]]] = defaultdict(list)
    for g, group in enumerate(mdf.groups):
        master = mdf.masters_db.get(g)
        heads = {str(g), getattr(group.channel_group, "acq_name", None) or str(g)}
        for k, channel in enumerate(group.channels):
            if k != master:
                for name in (channel.name, *(f"{head}/{channel.name}" for head in sorted(heads))):
                    found[name].append((g, k))
    return dict(found)


def _all(mdf: Any, found: dict[str, list[tuple[int, int]]], place: Place) -> dict[str, Series]:
    """Every series of numbers by its name, with its group where several have it."""
    series = {}
    for at in sorted({one for places in found.values() for one in places}):
        names = [name for name, places in found.items() if places == [at]]
        name = min(names, key=len, default="")
        if name and not name.startswith(_BUS) and f"/{_BUS}" not in name:
            try:
                series[name] = _series(mdf, name, [at], place)
            except ForkliftError:  # text
                continue
    return series


def _series(mdf: Any, name: str, places: list[tuple[int, int]], place: Place) -> Series:
    if len(places) > 1:
        groups = [f"{group}/{name}" for group, _ in places]
        raise place.error(
            "column-repeated",
            f"{len(places)} groups have a signal {name!r}; name one of {', '.join(groups[:5])} in [channels]",
            column=name,
            value=groups,
        )
    (group, index) = places[0]
    signal = mdf.get(group=group, index=index, ignore_invalidation_bits=True)
    samples = np.asarray(signal.samples)
    if samples.dtype.kind not in "fiub" or samples.ndim != 1:
        raise place.error(
            "cell-not-a-number", f"signal {name!r} is not a series of numbers; map another one", column=name
        )
    values = samples.astype(np.float64)
    if signal.invalidation_bits is not None:
        values[np.asarray(signal.invalidation_bits, dtype=bool)] = np.nan
    return Series(values, np.asarray(signal.timestamps, dtype=np.float64), str(signal.unit or "").strip())
