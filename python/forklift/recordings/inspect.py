"""What a log holds: every signal with its clock, unit, range and course, and which channel it may be.

A proposal is made by name, unit and behaviour together, and says why. It is a proposal: whoever measured
decides. Nothing is read as a channel without being named in ``[channels]``.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base import toml
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.recordings import formats, units
from forklift.recordings.channels import COMMANDS, TIME, Channel, Conversion, looks_like, table
from forklift.recordings.clocks import TIME_SUFFIX
from forklift.recordings.formats.signals import Everything, Place, Series, Signals

SKETCH = "▁▂▃▄▅▆▇█"
WIDTH = 24
"""Columns of a sketch."""
ENOUGH = 3.0
"""Score from which a channel is proposed: the quantity by its name or unit, and the lift or the behaviour."""

# What people call a quantity and a lift; German and English, as in vehicles' signal lists.
_QUANTITIES = {
    "current": ("curr", "current", "valve", "ventil", "strom", "pwm", "cmd", "sol", "amp", "i"),
    "position": ("pos", "position", "enc", "encoder", "stroke", "weg", "x", "travel", "cyl"),
    "pressure": ("p", "pres", "press", "pressure", "druck", "pa"),
    "oil_temperature": ("temp", "temperature", "oil", "oel", "toil", "tank", "t"),
    "fork_height": ("height", "fork", "forks", "hoehe", "gabel", "hubhoehe", "z", "mast"),
    "time": ("time", "t", "zeit", "timestamp", "timestamps", "s", "sec"),
}
_LIFTS = {
    "free": ("free", "fl", "freelift", "freihub", "frei", "inner"),
    "main": ("main", "ml", "mainlift", "haupthub", "haupt", "outer"),
}


@dataclass(frozen=True)
class Proposal:
    """A channel that a signal may be."""

    channel: str
    score: float
    unit: str
    """Of the signal; empty if neither file nor values tell it."""
    why: str


@dataclass(frozen=True)
class LoggedSignal:
    """One signal of a log."""

    name: str
    unit: str
    clock: int
    """Signals with the same number have the same time stamps."""
    samples: int
    missing: int
    rate_hz: float | None
    least: float | None
    greatest: float | None
    sketch: str
    proposal: Proposal | None


@dataclass(frozen=True)
class Log:
    """A file with all its signals."""

    file: str
    format: str
    duration_s: float | None
    signals: tuple[LoggedSignal, ...]
    ignored: tuple[str, ...] = ()
    """Columns of a table that are no channel and none is proposed for: a table's must all be told of."""
    passed: Mapping[str, str] = field(default_factory=dict)
    """Variables of a MAT-file that hold numbers and are no signals, and what they are instead."""

    def mapping(self) -> str:
        """The ``[channels]`` block of the proposals, with the reasons as comments; before it ``ignore``."""
        lines = [f"ignore = {toml.written(list(self.ignored))}", ""] if self.ignored else []
        lines += ["[channels]"]
        found = [one for one in self.signals if one.proposal]
        for one in sorted(
            found, key=lambda one: list(table()).index(one.proposal.channel if one.proposal else "")
        ):
            assert one.proposal is not None
            unit = f", unit = {toml.written(one.proposal.unit)}" if not one.unit and one.proposal.unit else ""
            name = toml.written(one.name)
            lines.append(f'{name} = {{ channel = "{one.proposal.channel}"{unit} }}  # {one.proposal.why}')
        missing = [
            name for name in COMMANDS if name not in {one.proposal.channel for one in found if one.proposal}
        ]
        lines += [f"# nothing looks like {name}, which every recording has" for name in missing]
        return "\n".join(lines) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """The same as plain data, for JSON."""
        return {
            "file": self.file,
            "format": self.format,
            "duration_s": self.duration_s,
            "signals": [
                {**vars(one), "proposal": None if one.proposal is None else vars(one.proposal)}
                for one in self.signals
            ],
            "passed": dict(self.passed),
            "mapping": self.mapping(),
        }


def inspect(path: str | Path, *, dbc: Sequence[str | Path] = ()) -> Log:
    """List the signals of a log of any format.

    Raises
    ------
    ForkliftError
        ``"recording-empty"``, and everything `forklift.recordings.formats.read` raises.
    """
    path = Path(path)
    place = Place(path.name, os.path.abspath(path), dbc=tuple(os.path.abspath(file) for file in dbc))
    found, _ = formats.read(place, Everything())
    if not any(len(one.values) for one in found.series.values()):
        raise _empty(place, found)
    common = _common_time(found.series)
    clocks: dict[bytes, int] = {}
    numbers = {}
    for name, series in found.series.items():
        time = series.time if series.time is not None else common
        key = b"" if time is None else time.tobytes()
        numbers[name] = clocks.setdefault(key, len(clocks) + 1)
    proposals = _proposals(found.series)
    signals = tuple(
        _signal(name, series, common, numbers[name], proposals.get(name))
        for name, series in found.series.items()
    )
    ends = [
        (float(time[0]), float(time[-1]))
        for series in found.series.values()
        if (time := series.time if series.time is not None else common) is not None and len(time)
    ]
    duration = max(b for _, b in ends) - min(a for a, _ in ends) if ends else None
    format = formats.format_of(path.name)
    ignored = () if format.picks else _ignored([*found.series, *found.others], proposals)
    return Log(path.name, format.name, duration, signals, ignored, dict(found.passed))


def _empty(place: Place, found: Signals) -> ForkliftError:
    """What to say of a file without a sample."""
    what = [f"{name} is {said}" for name, said in found.passed.items()]
    if what:
        why = f"it holds no signal: {', '.join(what[:3])}; write every signal as a vector by itself"
    elif found.series:
        why = "its signals have no samples; record or export it again"
    else:
        why = "it holds no signal of numbers; export the recorded signals into it"
    return place.error("recording-empty", why)


def _ignored(names: Sequence[str], proposals: Mapping[str, Proposal]) -> tuple[str, ...]:
    """The columns that are neither proposed nor a channel's own, nor the times of one."""
    known = {*table(), *proposals}
    known |= {name for name in names if name.removesuffix(TIME_SUFFIX) in known}
    return tuple(dict.fromkeys(name for name in names if name not in known))


def _common_time(series: Mapping[str, Series]) -> Floats | None:
    """The vector that is the file's time: by its name, and because it rises."""
    for name, one in series.items():
        named = name == TIME or any(token in _QUANTITIES["time"] for token in _tokens(name, "s"))
        if named and one.time is None and len(one.values) > 1 and np.all(np.diff(one.values) > 0.0):
            scale = units.conversion(units.in_brackets(name, "s") or one.unit or "s", "s")
            return one.values * (scale.scale if scale else 1.0)
    return None


def _signal(
    name: str, series: Series, common: Floats | None, clock: int, proposal: Proposal | None
) -> LoggedSignal:
    time = series.time if series.time is not None else common
    values = series.values
    finite = values[np.isfinite(values)]
    step = float(np.median(np.diff(time))) if time is not None and len(time) > 1 else 0.0
    return LoggedSignal(
        name,
        series.unit or units.in_brackets(name, table()[proposal.channel].unit if proposal else None),
        clock,
        len(values),
        len(values) - len(finite),
        float(f"{1.0 / step:.6g}") if step > 0.0 else None,
        float(finite.min()) if len(finite) else None,
        float(finite.max()) if len(finite) else None,
        sketch(values),
        proposal,
    )


def sketch(values: Floats) -> str:
    """The course of a signal in one line of blocks, from its least value to its greatest."""
    finite = values[np.isfinite(values)]
    if not len(finite):
        return ""
    low, span = float(finite.min()), float(np.ptp(finite))
    marks = []
    for part in np.array_split(values, min(WIDTH, len(values))):
        own = part[np.isfinite(part)]
        if not len(own):
            marks.append(" ")
        else:
            share = (float(np.median(own)) - low) / span if span > 0.0 else 0.0
            marks.append(SKETCH[min(int(share * len(SKETCH)), len(SKETCH) - 1)])
    return "".join(marks)


def _proposals(series: Mapping[str, Series]) -> dict[str, Proposal]:
    """The signals that channels are proposed for: the best of all pairs first, none twice."""
    pairs = [
        (name, found)
        for name, one in series.items()
        for channel in table().values()
        if (found := _proposal(name, one, channel)) is not None and found.score >= ENOUGH
    ]
    pairs.sort(key=lambda pair: -pair[1].score)
    chosen: dict[str, Proposal] = {}
    taken: set[str] = set()
    for name, found in pairs:
        if name not in chosen and found.channel not in taken:
            chosen[name] = found
            taken.add(found.channel)
    return chosen


def _proposal(name: str, series: Series, channel: Channel) -> Proposal | None:
    """How much a signal looks like a channel; None if it cannot be it."""
    if name == channel.name:
        return Proposal(channel.name, 10.0, series.unit, "its own name")
    if channel.name == TIME and series.time is not None:
        return None
    finite = series.values[np.isfinite(series.values)]
    stated = series.unit or units.in_brackets(name, channel.unit)
    if not len(finite):
        return None
    score = 0.0
    why: list[str] = []
    tokens = _tokens(name, channel.unit)
    quantity, lift = _parts(channel.name)
    if any(token in _QUANTITIES[quantity] for token in tokens):
        score, why = score + 2.0, [*why, "its name"]
    if lift is not None:
        other = "main" if lift == "free" else "free"
        if any(token in _LIFTS[lift] for token in tokens):
            score, why = score + 1.5, [*why, f"the {lift} lift in its name"]
        elif any(token in _LIFTS[other] for token in tokens):
            return None
    elif any(token in (*_LIFTS["free"], *_LIFTS["main"]) for token in tokens):
        score -= 1.0
    unit = stated
    if units.known(stated):
        linear = units.conversion(stated, channel.unit)
        if linear is None:
            return None
        values = finite * linear.scale + linear.offset
        if not channel.fits(values):
            return None
        score, why = score + 1.5, [*why, f"its unit {stated}"]
    else:
        likely = [Conversion(channel.unit, 1.0)] if channel.fits(finite) else looks_like(channel, finite)
        if not likely:
            return None
        unit = "" if units.is_share(stated) else likely[0].name
        score, why = score + 0.5, [*why, f"its values look like {likely[0].name}"]
    if quantity == "time":
        if not np.all(np.diff(finite) > 0.0):
            return None
        score += 1.0
    still = np.ptp(finite) < 0.2 * max(np.abs(finite).max(), 1.0)
    if (quantity == "oil_temperature" and still) or (quantity == "current" and finite.min() >= 0.0):
        score += 0.5
    return Proposal(channel.name, score, unit, ", ".join(why))


def _parts(channel: str) -> tuple[str, str | None]:
    """The quantity and the lift of a channel."""
    for quantity in _QUANTITIES:
        if channel.startswith(quantity):
            lift = next((one for one in _LIFTS if f"_{one}_" in channel), None)
            return quantity, lift
    return channel, None


def _tokens(name: str, unit: str) -> list[str]:
    """The words of a signal's name, but for one that converts to `unit`: split at marks, digits and case."""
    plain = re.sub(r"\[.*?\]", " ", units.without_brackets(name, unit))
    spaced = re.sub(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])|(?<=[A-ZÄÖÜ])(?=[A-ZÄÖÜ][a-zäöü])", " ", plain)
    return [word.lower() for word in re.split(r"[^A-Za-zÄÖÜäöüß]+", spaced) if word]
