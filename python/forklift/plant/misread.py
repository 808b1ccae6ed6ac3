"""How a sensor, or an entered condition, is off: a clause with direction and size, for any machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any, NamedTuple

from forklift.base.typeset import capital, number, printed, size

Rows = Sequence[Mapping[str, Any]]
"""Parameters as `forklift.diagnosis.numbers.Number` has them: name, unit, value, lower, upper."""
OF = " in "
"""Between what a condition's number is called and the recording that it is of."""
HARDLY = 0.02
"""A recording that is off by less than this share of the one that is furthest off is not said to be off."""
ALIKE = 0.05
"""Recordings whose numbers differ by less than this share of them are off by the same."""
APART = " less their mean"
"""After the name of a condition's number: by how much one recording's differs from the mean of all."""


class Found(NamedTuple):
    """What was found, as a clause, and its interval as a sentence; empty where nothing can be said."""

    clause: str = ""
    interval: str = ""


def misread(sensor: str, rows: Rows, shown: tuple[str, float] | None = None) -> Found:
    """A gain, an offset or a lag of a sensor that reads gain times the truth, plus an offset, late.

    `shown`: the unit that an offset is told in, and how many of that one of its own is.
    """
    if len(rows) != 1:
        return Found()
    row, fault = rows[0], rows[0]["name"].rpartition(".")[2]
    ends = (row["value"], row["lower"], row["upper"])
    if fault == "gain":
        told = tuple(100.0 * (end - 1.0) for end in ends)
        return Found(
            f"{sensor} reads {_size(told)} % {'high' if told[0] > 0.0 else 'low'}",
            f"{_interval(told, '%')}: it reads {number(row['value'], 5)} times the truth.",
        )
    if fault == "offset":
        unit, scale = shown or (printed(row["unit"]), 1.0)
        told = tuple(scale * end for end in ends)
        way = "high" if told[0] > 0.0 else "low"
        return Found(f"{sensor} reads {_size(told)} {unit}".rstrip() + f" {way}", f"{_interval(told, unit)}.")
    if fault == "lag" and row["unit"] == "s":
        told = tuple(1e3 * end for end in ends)
        return Found(f"{sensor} reads {_size(told)} ms late", f"{_interval(told, 'ms')}.")
    return Found()


def misentered(what: str, entered: str, rows: Rows) -> Found:
    """A condition that is off what was entered: one number where the recordings agree, else their range.

    Parameters
    ----------
    what, entered
        The condition in words, and how its value came to be known: ``"entered"``, ``"recorded"``.
    rows
        The mean, if the recordings agree on it, and each recording: what acts, less what was entered. Where
        no recording tells the mean, it is marked so, and each recording is told apart from it too. Of what
        is off by the same in all of them that number alone. Where there is no mean, those that are off by
        the same are told by one number (see `HARDLY`, `ALIKE`): forks without a load weigh as entered.
    """
    apart = [row for row in rows if APART in row["name"]]
    each = [row for row in rows if OF in row["name"] and row not in apart]
    mean = next((row for row in rows if OF not in row["name"]), None)
    off = [row for row in each if row["lower"] > 0.0 or row["upper"] < 0.0]
    if mean and not mean.get("identifiable", True):
        return _differing(what, entered, mean, apart) if apart else Found()
    if not (mean or off):
        return Found()
    unit = printed((mean or off[0])["unit"])
    some = "" if len(off) in (0, len(each)) else f" in {len(off)} of the {len(each)} recordings fitted"
    if mean:
        told = (mean["value"], mean["lower"], mean["upper"])
        way = "low" if told[0] > 0.0 else "high"
        return Found(
            f"the {what} was {entered} {_size(told)} {unit} too {way}{some}", f"{_interval(told, unit)}."
        )
    furthest = max(abs(row["value"]) for row in off)
    off = [row for row in off if abs(row["value"]) >= HARDLY * furthest]
    low, high = min(off, key=lambda row: row["value"]), max(off, key=lambda row: row["value"])
    wide = max(row["upper"] - row["lower"] for row in off)
    known = f"each recording's is known to ±{number(0.5 * wide, 2)} {unit} (95 % interval)"
    some = f" in {len(off)} of the {len(each)} recordings fitted" if len(off) < len(each) else ""
    by = f"by {_signed(low['value'])} to {_signed(high['value'])} {unit}"
    if high["value"] - low["value"] <= ALIKE * furthest:
        usual = fmean(row["value"] for row in off)
        way = "low" if usual > 0.0 else "high"
        return Found(
            f"the {what} was {entered} {number(abs(usual))} {unit} too {way}{some}",
            f"{capital(known if _signed(low['value']) == _signed(high['value']) else f'{by}, {known}')}.",
        )
    return Found(
        f"the {what} is not what was {entered}: {by}, differing from recording to recording{some}",
        f"{capital(known)}; positive: it was {entered} too low.",
    )


def _differing(what: str, entered: str, mean: Mapping[str, Any], apart: Rows) -> Found:
    """Recordings that differ by what they tell, about a mean that they do not tell."""
    unit = printed(mean["unit"])
    low, high = min(apart, key=lambda row: row["value"]), max(apart, key=lambda row: row["value"])
    least, greatest = ([_signed(row[end]) for end in ("value", "lower", "upper")] for row in (low, high))
    return Found(
        f"the {what} is not what was {entered}: its error differs from recording to recording, by "
        f"{least[0]} to {greatest[0]} {unit} about a mean that they do not tell",
        f"95 % intervals {least[1]} to {least[2]} {unit} and {greatest[1]} to {greatest[2]} {unit}; "
        f"positive: it was {entered} too low. How far it is off in all of them together is not known, as "
        f"other parameters make up for it: anything from {_signed(mean['lower'])} to "
        f"{_signed(mean['upper'])} {unit}.",
    )


def _size(ends: Sequence[float]) -> str:
    return size(*_upright(ends))[0]


def _interval(ends: Sequence[float], unit: str) -> str:
    _, low, high = size(*_upright(ends))
    return f"95 % interval {low} to {high} {unit}".rstrip()


def _upright(ends: Sequence[float]) -> tuple[float, float, float]:
    """Value, lower and upper without the sign, which the direction says."""
    value, lower, upper = ends
    return (value, lower, upper) if value > 0.0 else (-value, -upper, -lower)


def _signed(value: float) -> str:
    return f"{'+' if value > 0.0 else ''}{number(value)}"
