"""One long log cut into its lowerings: from rest before a valve is commanded to rest after it is shut."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePosixPath

import numpy as np

from forklift.base.errors import ForkliftError
from forklift.recordings.channels import COMMANDS, LIFTS, Lifts
from forklift.recordings.checks import AT_REST_A
from forklift.recordings.clocks import Rows
from forklift.recordings.recording import Recording

BEFORE_S, AFTER_S = 1.0, 1.5
"""Rest that a lowering is given on either side: the mast's oscillation dies out within about a second."""
APART_S = 3.0
"""Commands further apart than this are two lowerings: both rests fit between them."""
SHORTEST_S = 1.0
"""A shorter command is none that a fit learns from."""


def lowerings(recording: Recording) -> tuple[Recording, ...]:
    """Each lowering as a recording of its own, ``NAME_1``, ``NAME_2``, …, of the lift that is commanded.

    A channel that has no sample in a lowering is left out of it.

    Raises
    ------
    ForkliftError
        ``"nothing-lowered"`` if no valve is commanded for long enough.
    """
    time, command = recording.commanded
    active = np.flatnonzero((command > AT_REST_A).any(axis=1))
    parts = np.split(active, np.flatnonzero(np.diff(time[active]) > APART_S) + 1) if len(active) else []
    spans = [(float(time[part[0]]), float(time[part[-1]])) for part in parts]
    spans = [span for span in spans if span[1] - span[0] >= SHORTEST_S]
    if not spans:
        raise ForkliftError(
            "nothing-lowered",
            f"{recording.file}: no valve is commanded above {AT_REST_A:g} A for {SHORTEST_S:g} s: there is "
            "no lowering to cut out; correct the currents' unit, or leave out --cut",
            file=recording.file,
            value=float(command.max()),
            lower=AT_REST_A,
            unit="A",
        )
    return tuple(_part(recording, span, k) for k, span in enumerate(spans, start=1))


def _part(recording: Recording, span: tuple[float, float], number: int) -> Recording:
    rows = np.flatnonzero((recording.time_s >= span[0] - BEFORE_S) & (recording.time_s <= span[1] + AFTER_S))
    own: dict[str, Rows] = {}
    for name, at in recording.rows.items():
        ends = rows[[0, -1]] if name in COMMANDS else rows[:0]  # at which a held current is known
        own[name] = np.searchsorted(rows, np.union1d(at[np.isin(at, rows)], ends))
    channels = {
        name: values[rows] for name, values in recording.channels.items() if name not in own or len(own[name])
    }
    moved = [lift for lift, name in zip(LIFTS, COMMANDS, strict=True) if channels[name].max() > AT_REST_A]
    lift: Lifts = moved[0] if len(moved) == 1 else "both"
    path = PurePosixPath(recording.file)
    return replace(
        recording,
        file=str(path.with_name(f"{path.stem}_{number}{path.suffix}")),
        lift=lift,
        time_s=recording.time_s[rows] - recording.time_s[rows[0]],
        channels=channels,
        rows={name: at for name, at in own.items() if name in channels},
        sha256="",
    )
