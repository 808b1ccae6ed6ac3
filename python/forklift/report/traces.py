"""Recordings signal by signal, measured beside what models say, thinned to what a page can carry."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.fitting.intervals import QUANTILE
from forklift.report.blocks import Drive, Replay, Signal
from forklift.report.words import Quantity, capital, number, printed

if TYPE_CHECKING:
    from forklift.fitting.agreement import Agreement, Prediction
    from forklift.plant.subject import Subject
    from forklift.recordings.noise import Sensor


MOST_POINTS = 1000
"""Of a curve: about as many as a figure has pixels."""
BUDGET = 320_000
"""Numbers of all curves of a page together: with 30 recordings it stays below 8 MB, plotly's script too."""
ELSEWHERE = 0.02
"""Share of a condition by which it must differ from the file's to be told beside that."""
DIGITS = 5
"""Of a point: finer than a pixel."""

HOW_TO_READ = (
    "Above: simulated less measured, which is zero of a perfect model; in the middle: both as they are; "
    "below: what drove it. Drag over a stretch to zoom, double-click to see all again, or use the buttons."
)

BAND = (
    "Grey band: what the sensor's noise alone would leave, 95 times in 100. Of an encoder, which reads "
    "the count below, it lies on one side of zero; a signal that no sensor reads has none."
)
Note = Callable[[str, str], str]
"""What is said of a file's channel."""


def replays(
    machine: Subject, sides: Mapping[str, Agreement], note: Note, sensors: Mapping[str, Sensor]
) -> list[Replay]:
    """Every recording of any machine by every model, those held out first; `note` by file and channel."""
    together = sorted(
        zip(*(one.predictions for one in sides.values()), strict=True),
        key=lambda told: told[0].recording.role != "validate",
    )
    columns = sum(
        len(told[0].signals) * (2 + len(sides)) + len(machine.drives(told[0].recording)) for told in together
    )
    return [_recorded(machine, list(sides), told, note, points(columns), sensors) for told in together]


def _recorded(
    machine: Subject,
    sides: Sequence[str],
    told: Sequence[Prediction],
    note: Note,
    most: int,
    sensors: Mapping[str, Sensor],
) -> Replay:
    first, words = told[0], machine.words
    recording, time = first.recording, first.time_s
    signals = []
    for k, one in enumerate(first.signals):
        simulated = {side: told_by.signals[k].simulated for side, told_by in zip(sides, told, strict=True)}
        what = words.drawn(one.channel, one.unit)
        title = Quantity(what.name if what.name == one.channel else capital(what.name), what.unit, what.scale)
        ends = band(sensors[one.channel]) if one.channel in sensors else None
        text = note(recording.file, one.channel)
        signals.append(drawn(title, time, one.measured, simulated, text, most, ends))
    drives = []
    for unit, held in dict.fromkeys((one.unit, one.held) for one in machine.drives(recording)):
        own = [one for one in machine.drives(recording) if (one.unit, one.held) == (unit, held)]
        thin, *kept = decimate(most, time, *(one.values for one in own))
        columns = {"x": instants(thin)} | {
            one.name: numbers(values) for one, values in zip(own, kept, strict=True)
        }
        drives.append(Drive(", ".join(one.name for one in own), printed(unit), columns, held))
    group = "Held out" if recording.role == "validate" else "Fitted on"
    entered = machine.conditions(recording, {})
    lines = [
        f"{c.name} {number(value)} {c.unit}".rstrip() + _other(value, entered.get(name, value), c.unit)
        for name, value in told[-1].conditions.items()
        for c in [words.condition(name)]
    ]
    part = machine.part_where(getattr(recording, "lift", ""))
    said = [*([words.part(part)] if words.part(part) else []), *lines]
    if first.adjusted:
        said.append(f"adjusted to it: {', '.join(words.condition(name).name for name in first.adjusted)}")
    return Replay(recording.file, group, ", ".join(said), signals, drives)


def _other(found: float, entered: float, unit: str) -> str:
    """What the file has, where that is another value."""
    if abs(found - entered) <= ELSEWHERE * max(abs(found), abs(entered)):
        return ""
    return f" (in the file: {number(entered)} {unit})"


def points(curves: int) -> int:
    """How many samples each of so many curves of a page may have."""
    return int(np.clip(BUDGET / max(curves, 1), 100, MOST_POINTS))


def place(recordings: Sequence[Replay], file: str, signal: str) -> tuple[int, int]:
    """Where a file's signal, in words, is among them; the first if it is not."""
    for k, one in enumerate(recordings):
        if one.title == file:
            names = [shown.title.lower() for shown in one.signals]
            return k, names.index(signal.lower()) if signal.lower() in names else 0
    return 0, 0


def band(sensor: Sensor) -> tuple[float, float]:
    """Of simulated less measured: an encoder reads the count below."""
    half = 0.475 * sensor.count if sensor.count else QUANTILE * sensor.noise
    return 0.5 * sensor.count - half, 0.5 * sensor.count + half


def drawn(
    what: Quantity,
    time: Floats,
    measured: Floats,
    simulated: Mapping[str, Floats],
    note: str,
    most: int,
    ends: tuple[float, float] | None,
) -> Signal:
    """One signal, thinned; `ends` as `band` has them, in the signal's own unit."""
    scale = what.scale
    curves = {"measured": measured, **simulated}
    off = [values - measured for values in simulated.values()]  # their peaks are drawn, too
    thin, *kept = decimate(most, time, *curves.values(), *off)
    lines = {name: numbers(values * scale) for name, values in zip(curves, kept[: len(curves)], strict=True)}
    ends = ends and (scale * ends[0], scale * ends[1])
    return Signal(what.name, what.unit, note, {"x": instants(thin)} | lines, ends)


def decimate(most: int, time: Floats, *curves: Floats) -> tuple[Floats, ...]:
    """`time` and `curves`, thinned to about `most` samples that keep each stretch's extremes.

    Curves share the kept samples, so that they can be read against each other.
    """
    if len(time) <= most:
        return (time, *curves)
    stretches = max(1, most // (2 * len(curves)))
    width = -(-len(time) // stretches)
    keep = {0, len(time) - 1}
    for curve in curves:
        padded = np.full(-(-len(curve) // width) * width, np.nan)
        padded[: len(curve)] = curve
        rows = padded.reshape(-1, width)
        some = np.isfinite(rows).any(axis=1)
        begin, known = width * np.flatnonzero(some), rows[some]
        keep |= set((width * np.flatnonzero(~some)).tolist())
        keep |= {
            *(begin + np.nanargmin(known, axis=1)).tolist(),
            *(begin + np.nanargmax(known, axis=1)).tolist(),
        }
    at = np.array(sorted(keep))
    return (time[at], *(curve[at] for curve in curves))


def recording_of(piece: str) -> str:
    """The recording's file of what is judged: itself, or its stretch from one restart to the next."""
    return _STRETCH.sub("", piece)


_STRETCH = re.compile(r" from [0-9.e+-]+ s$")
_WRITTEN = f"%.{DIGITS}g"


def instants(time_s: Floats) -> list[float | None]:
    """Times for the page's data [s], to the microsecond: however far off the first one is."""
    return [round(value, 6) if isfinite(value) else None for value in time_s.tolist()]


def numbers(values: Floats) -> list[float | None]:
    """For the page's data: rounded, and None for what is not finite."""
    return [float(_WRITTEN % value) if isfinite(value) else None for value in values.tolist()]
