"""What is told of clocks that stand apart from the command's: by how much, and that it is allowed for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from forklift.base.typeset import size
from forklift.fitting.intervals import QUANTILE
from forklift.plant.findings import Caution
from forklift.plant.parameter import Unknown
from forklift.plant.sensor_faults import SensorUnknown
from forklift.plant.subject import Words

CLOCKS_APART = "clocks-apart"
"""Code of the caution."""
BEYOND_CHANCE = 4.0
"""Deviations from which on a clock is said to be off: one in 16 000 is by chance. Below, the parameters'
table has it."""


class Told(NamedTuple):
    """An unknown with its value and the ends of its 95 % interval, in its unit."""

    unknown: Unknown
    value: float
    lower: float
    upper: float

    @property
    def clear(self) -> bool:
        """Whether it is off by more than chance has it."""
        return 2.0 * QUANTILE * abs(self.value) > BEYOND_CHANCE * (self.upper - self.lower)


def clock_cautions(words: Words, measured: Sequence[str], told: Iterable[Told]) -> tuple[Caution, ...]:
    """One of each clock that is off. `measured`: all channels; `told`: whatever is unknown."""
    clocks: dict[tuple[str, ...], list[Told]] = {}
    for one in told:
        if isinstance(one.unknown, SensorUnknown) and one.unknown.fault in ("shift", "drift") and one.clear:
            clocks.setdefault(one.unknown.channels, []).append(one)
    return tuple(_caution(words, channels, measured, off) for channels, off in clocks.items())


def _caution(words: Words, channels: Sequence[str], measured: Sequence[str], off: Sequence[Told]) -> Caution:
    every = len(channels) == len(measured)
    whose = "all sensors" if every else " and ".join(f"the {words.signal(one)}" for one in channels)
    like = f"{'Valves that answer' if every else 'A sensor that answers'} as late would look the same."
    late = any(one.value > 0.0 for one in off if _is_shift(one))
    return Caution(
        CLOCKS_APART,
        f"The time stamps of {whose} {' and '.join(_said(off))}, compared with those of the commands. All "
        f"numbers and curves here allow for that; look at how they are logged.{f' {like}' if late else ''}",
        {
            "channels": list(channels),
            **{
                "shift_s" if _is_shift(one) else "drift": {
                    "value": one.value, "lower": one.lower, "upper": one.upper,
                }
                for one in off
            },
        },
    )  # fmt: skip


def _is_shift(one: Told) -> bool:
    return isinstance(one.unknown, SensorUnknown) and one.unknown.fault == "shift"


def _said(off: Sequence[Told]) -> Iterator[str]:
    """``"are 3 ms (95 %: 2.9 to 3.1) late"``."""
    for one in off:
        shift = _is_shift(one)
        sign, factor, unit = -1.0 if one.value < 0.0 else 1.0, 1e3 if shift else 1e2, "ms" if shift else "%"
        ends = sorted([sign * factor * one.lower, sign * factor * one.upper])
        value, lower, upper = size(sign * factor * one.value, *ends)
        how = ("late" if sign > 0.0 else "early") if shift else ("fast" if sign > 0.0 else "slow")
        yield f"{'are' if shift else 'run'} {value} {unit} (95 %: {lower} to {upper}) {how}"
