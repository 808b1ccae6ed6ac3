"""Where a plant's recordings are no measurement: outputs that stand still, samples that are missing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import log, pi, sqrt

import numpy as np

from forklift.plant.findings import Caution, InvalidStretch
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.recordings.clocks import Sampled
from forklift.recordings.noise import Sensor, noise_of

UNLIKELY = 1e-6
"""Probability below which equal samples in a row are no chance: a signal that stands still."""
NOISY = 0.3
"""Least share of the sensor's noise that the samples must show."""


def stuck(
    plant: Plant, recordings: Sequence[Recording], known: Mapping[str, Sensor]
) -> tuple[InvalidStretch, ...]:
    """Every stretch in which an output stands still for longer than its noise can."""
    return tuple(found for one in recordings for found in _of_recording(plant, one, known))


def _of_recording(
    plant: Plant, recording: Recording, known: Mapping[str, Sensor]
) -> Iterator[InvalidStretch]:
    """Equal samples in a row where the sensor's noise σ makes them impossible.

    Two readings of resolution d are equal with a probability of about p = d/(2√π σ); of n samples, k in
    a row are by chance with n pᵏ⁻¹ at most. What lies at an end of the sensor's range, and counts, say
    nothing.
    """
    for one in plant.outputs:
        measured = recording.y.get(one.name)
        sensor = known[one.name]
        if measured is None or sensor.count:
            continue
        there = np.isfinite(measured)
        values, time = measured[there], recording.time_s[there]
        steps = np.diff(np.unique(values))
        if not len(steps) or noise_of([Sampled(time, values)]) < NOISY * sensor.noise:
            continue  # no noise to speak of: what rests stands still
        p = float(steps.min()) / (2.0 * sqrt(pi) * sensor.noise)
        if p >= 0.5:
            continue
        fewest = 2 + int(np.ceil((log(UNLIKELY) - log(len(values))) / log(p)))
        same = np.diff(values) == 0.0
        inside = (values[1:] > one.lower) & (values[1:] < one.upper)
        edges = np.flatnonzero(np.diff(np.r_[False, same & inside, False].astype(int)))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if last - first + 1 >= fewest:
                yield InvalidStretch(recording.file, one.name, float(time[first]), float(time[last]), "stuck")


def stuck_cautions(invalid: Sequence[InvalidStretch]) -> Iterator[Caution]:
    """Which samples count for nothing, since their signal stands still."""
    for one in invalid:
        what = f"{one.channel}: {one.said}, which its noise does not; those samples count for nothing"
        yield Caution("channel-stuck", f"{what}.", {"file": one.file, "channel": one.channel})


def missing(plant: Plant, recordings: Sequence[Recording]) -> Iterator[Caution]:
    """Samples that are not there, and outputs that a recording has not."""
    missing = {
        one.name: sum(_lost(r, one.name) for r in recordings if one.name in r.y) for one in plant.outputs
    }
    lost = [f"{count} of {name}" for name, count in missing.items() if count]
    if lost:
        yield Caution("samples-missing", f"Missing samples, which count for nothing: {', '.join(lost)}.")
    absent = [
        f"{one.name} in {', '.join(without)}"
        for one in plant.outputs
        if (without := [r.file for r in recordings if one.name not in r.y])
    ]
    if absent:
        yield Caution("not-recorded", f"Not recorded: {'; '.join(absent)}.")


def _lost(recording: Recording, output: str) -> int:
    """How many of an output's samples are missing, on its own clock."""
    return int((~np.isfinite(recording.y[output][recording.own(output)])).sum())
