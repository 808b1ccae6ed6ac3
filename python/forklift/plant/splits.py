"""How a plant's recordings part into two regimes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from forklift.base.typeset import printed
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.plant.subject import Split


def splits(plant: Plant, recordings: Sequence[Recording]) -> tuple[Split, ...]:
    """At the widest gap of every condition, and of every input at the middle of its range."""
    names = sorted({name for one in recordings for name in one.conditions})
    return (
        *(split for name in names for split in _by_condition(recordings, name)),
        *(
            split
            for one in plant.inputs
            if not one.derived
            for split in _by_input(recordings, one.name, one.unit)
        ),
    )


def _by_condition(recordings: Sequence[Recording], name: str) -> Iterator[Split]:
    values = [one.conditions.get(name, np.nan) for one in recordings]
    levels = np.unique(values)
    if not np.isfinite(values).all() or len(levels) < 2:
        return
    widest = int(np.argmax(np.diff(levels)))
    low, high = levels[widest], levels[widest + 1]
    rows = tuple(np.full(len(one), value <= low) for one, value in zip(recordings, values, strict=True))
    yield Split(name, f"recordings up to {low:.3g}", f"recordings from {high:.3g}", rows)


def _by_input(recordings: Sequence[Recording], name: str, unit: str) -> Iterator[Split]:
    columns = [one.u[name] for one in recordings]
    middle = 0.5 * (min(float(u.min()) for u in columns) + max(float(u.max()) for u in columns))
    said = f"{middle:.3g} {printed(unit)}".rstrip()
    rows = tuple(u < middle for u in columns)
    yield Split(
        f"input {name}", f"samples with {name} below {said}", f"samples with {name} from {said} on", rows
    )
