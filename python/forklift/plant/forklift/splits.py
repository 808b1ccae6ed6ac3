"""In which regimes a forklift is recorded: light and heavy, cold and warm, holding and moving."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from forklift.plant.forklift.checks.suitability import SAME_LOAD_KG, SAME_TEMPERATURE_K
from forklift.plant.forklift.phases import PHASES, of_recording
from forklift.plant.forklift.truck import Truck
from forklift.plant.subject import Split
from forklift.recordings.recording import Recording


def splits(recordings: Sequence[Recording], truck: Truck) -> tuple[Split, ...]:
    """Every way to part these recordings, in their order.

    By load and by oil temperature where there are two at least, at the widest gap between them; and by
    motion: samples while all commanded valves have been shut for a while, and all others.
    """
    return (
        *_by(recordings, "load", "kg", [found.load_kg for found in recordings], SAME_LOAD_KG),
        *_by(recordings, "oil temperature", "degC", _temperatures(recordings), SAME_TEMPERATURE_K),
        *_motion(recordings, truck),
    )


def _by(
    recordings: Sequence[Recording], name: str, unit: str, values: Sequence[float], same: float
) -> Iterator[Split]:
    levels = np.unique([value for value in values if np.isfinite(value)])
    gaps = np.diff(levels)
    if not len(gaps) or gaps.max() < same or not np.all(np.isfinite(values)):
        return
    widest = int(np.argmax(gaps))
    low, high = levels[widest], levels[widest + 1]
    rows = tuple(np.full(len(found), value <= low) for found, value in zip(recordings, values, strict=True))
    yield Split(name, f"recordings up to {low:.3g} {unit}", f"recordings from {high:.3g} {unit}", rows)


def _temperatures(recordings: Sequence[Recording]) -> list[float]:
    means = []
    for found in recordings:
        measured = found.channels.get("oil_temperature_degc")
        told = measured is not None and np.isfinite(measured).any()
        means.append(float(np.nanmean(measured)) if told else float("nan"))  # type: ignore[arg-type]
    return means


def _motion(recordings: Sequence[Recording], truck: Truck) -> Iterator[Split]:
    hold = PHASES.index("hold")
    rows = tuple(
        np.all([phase == hold for phase in of_recording(found, truck).values()], axis=0)
        for found in recordings
    )
    yield Split("motion", "samples at rest", "samples in motion", rows)
