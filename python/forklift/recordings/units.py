"""Units as people and loggers write them, brought to the channels' own by pint.

A unit that pint does not know, or that says nothing (``""``, ``"-"``, ``"1"``, ``"raw"``), is no unit. A
share (``"%"``) has no size of its own: what 100 % is must be given as a scale.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Any

SAYS_NOTHING = frozenset({"", "-", "--", "1", "none", "n/a", "na", "raw", "unit", "unitless", "[-]", "count"})
SHARES = frozenset({"%", "percent", "pct", "%pwm", "% pwm", "pwm%", "pwm %", "permille", "‰"})
DIGITS = 15
"""Of a factor: pint's own products are off in the last."""
STANDARD_ATMOSPHERE_PA = 101325.0
"""BIPM, The International System of Units, 9th edition (2019): what an absolute pressure has more."""

# Spelt as loggers and handbooks do, in lower case without spaces; what follows is pint's name.
_SPELT = {
    "°c": "degC",
    "degc": "degC",
    "celsius": "degC",
    "grdc": "degC",
    "gradc": "degC",
    "℃": "degC",
    "°f": "degF",
    "degf": "degF",
    "fahrenheit": "degF",
    "℉": "degF",
    "°k": "kelvin",
    "k": "kelvin",
    "psig": "psi",
    "lbf/in2": "psi",
    "lbf/in^2": "psi",
    "barg": "bar",
    "bar(g)": "bar",
    "baru": "bar",
    "n/mm2": "MPa",
    "n/mm^2": "MPa",
    '"': "inch",
    "in": "inch",
    "inch": "inch",
    "inches": "inch",
    "'": "foot",
    "ft": "foot",
    "amp": "ampere",
    "amps": "ampere",
    "sec": "second",
    "secs": "second",
    "msec": "millisecond",
    "µsec": "microsecond",
    "usec": "microsecond",
    "t": "metric_ton",
    "to": "metric_ton",
}
_PRESSURES = {"bar": "bar", "mbar": "mbar", "psi": "psi", "pa": "Pa", "kpa": "kPa", "mpa": "MPa"}
_ABSOLUTE = {f"{low}{mark}": unit for low, unit in _PRESSURES.items() for mark in ("a", "(a)")}
_TEMPERATURES = {"c": "degC", "f": "degF"}
_PLAIN = {  # whatever their case: nobody records oil in millipascals
    "ma": "mA", "a": "A", "mpa": "MPa", "kpa": "kPa", "hpa": "hPa", "pa": "Pa", "bar": "bar", "mbar": "mbar",
    "psi": "psi", "mm": "mm", "cm": "cm", "m": "m", "ms": "ms", "s": "s", "kg": "kg", "lb": "lb", "lbs": "lb",
    "g": "g",
}  # fmt: skip


@dataclass(frozen=True)
class Linear:
    """``value in the channel's unit = raw · scale + offset``."""

    scale: float
    offset: float

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Linear):
            return NotImplemented
        size = max(abs(self.offset), abs(other.offset), abs(self.scale))
        return abs(self.scale - other.scale) <= 1e-6 * abs(self.scale) and (
            abs(self.offset - other.offset) <= 1e-6 * size
        )

    def __hash__(self) -> int:
        return 0  # equality is approximate


def says_nothing(unit: str) -> bool:
    """Whether the text names no unit that a value could be converted from."""
    return unit.strip().lower() in SAYS_NOTHING


def is_share(unit: str) -> bool:
    """Whether the text is a share, such as per cent of a duty cycle."""
    return unit.strip().lower() in SHARES


def known(unit: str) -> bool:
    """Whether pint knows the unit, however it is spelt."""
    return not says_nothing(unit) and not is_share(unit) and _parsed(unit, "") is not None


def conversion(unit: str, to: str, *, exact: bool = False) -> Linear | None:
    """From `unit` to the channel's unit `to`; None if either is unknown, or they measure different things.

    With `exact` both are first taken as they are spelt: of a machine that may have mPa, MPa, mT and S.
    """
    text = unit.strip()
    if text == to:
        return Linear(1.0, 0.0)
    target = (_as_spelt(to) if exact else None) or _parsed(to, to)
    for found in (_as_spelt(text.strip("[]")) if exact else None, _parsed(text, to)):
        if found and target and found[0].dimensionality == target[0].dimensionality:
            return _linear(found, target)
    return None


def _linear(found: tuple[Any, float], target: tuple[Any, float]) -> Linear:
    registry = _registry()
    low, high = (float(registry.Quantity(x, found[0]).to(target[0]).magnitude) for x in (0.0, 1.0))
    more = found[1] - target[1]
    above = float(registry.Quantity(more, "Pa").to(target[0]).magnitude) if more else 0.0
    return Linear(_rounded(high - low), _rounded(low - above))


def in_brackets(name: str, to: str | None = None) -> str:
    """The unit a column's name ends with, as in ``"p_A [bar]"``; empty if there is none that is known.

    Round brackets hold many things besides units: where `to` is given, theirs must convert to it.
    """
    found = re.fullmatch(r".*\S\s*(?:\[([^\[\]]+)\]|\(([^()]+)\))\s*", name)
    if not found:
        return ""
    text = (found[1] or found[2]).strip()
    fits = known(text) if found[1] or to is None else conversion(text, to) is not None
    return text if fits or is_share(text) else ""


def without_brackets(name: str, to: str | None = None) -> str:
    """A column's name without the unit that it ends with, see `in_brackets`."""
    return re.sub(r"\s*(\[[^\[\]]+\]|\([^()]+\))\s*$", "", name) if in_brackets(name, to) else name


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


@cache
def _parsed(unit: str, to: str) -> tuple[Any, float] | None:
    """pint's unit, and what an absolute pressure has more than the channel's [Pa]."""
    text = unit.strip()
    low = text.lower().replace(" ", "").strip("[]")
    extra, name = 0.0, text.strip("[]")
    if low in _ABSOLUTE:
        extra, name = STANDARD_ATMOSPHERE_PA, _ABSOLUTE[low]
    elif to == "degC" and low in _TEMPERATURES:
        name = _TEMPERATURES[low]
    elif low in _SPELT:
        name = _SPELT[low]
    elif low in _PLAIN:
        name = _PLAIN[low]
    found = _as_spelt(name)
    return None if found is None else (found[0], extra)


def _as_spelt(name: str) -> tuple[Any, float] | None:
    found = _named(name) or _named(_EXPONENT.sub(r"**\1", name))
    return None if found is None else (found, 0.0)


_EXPONENT = re.compile(r"(?<=[A-Za-zµμ])(-?\d)")
"""Of a unit as loggers and data sheets write it: m2, kg/m3, s-1."""


def _named(name: str) -> Any | None:
    try:
        return _registry().Unit(name)
    except Exception:  # pint raises errors of many kinds, tokenize's own among them
        return None


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True, cache_folder=None)
