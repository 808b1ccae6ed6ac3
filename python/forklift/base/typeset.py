"""Numbers, units and clauses as print has them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

FAST = "\u00a0"
"""A space at which no line is broken."""
HIGH = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
RAISED = str.maketrans("23456", "²³⁴⁵⁶")

DRAWN: Mapping[str, tuple[str, float]] = {
    "Pa": ("bar", 1e-5), "m3/s": ("l/min", 6e4), "N": ("kN", 1e-3), "degC": ("°C", 1.0),
}  # fmt: skip
"""By unit: the one that figures have instead, and how many of it one is."""


def number(value: float | None, digits: int = 3) -> str:
    """A few digits, as print has them; a dash for what is not defined."""
    if value is None or np.isnan(value):
        return "—"
    if np.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0.0 or 1e-3 <= abs(rounded) < 1e6:
        decimals = 0 if rounded == 0.0 else max(0, digits - 1 - int(np.floor(np.log10(abs(rounded)))))
        said = f"{rounded:.{decimals}f}"
        said = said.rstrip("0").rstrip(".") if "." in said else said
        return said.replace("-", "−")
    said, _, power = f"{rounded:.{digits - 1}e}".partition("e")
    said = said.rstrip("0").rstrip(".") if "." in said else said
    return f"{said.replace('-', '−')}{FAST}×{FAST}10{str(int(power)).translate(HIGH)}"


def as_precise(*values: float, digits: int = 2) -> list[str]:
    """Numbers that are compared, all to the decimals that the least of them needs for so many digits; each by
    itself where they are further apart than a hundredfold."""
    sizes = [abs(value) for value in values if np.isfinite(value) and value]
    if len(sizes) < len(values) or max(sizes) > 100.0 * min(sizes) or not 1e-3 <= min(sizes) < 1e6:
        return [number(value, digits) for value in values]
    least = float(f"{min(sizes):.{digits}g}")
    decimals = max(0, digits - 1 - int(np.floor(np.log10(least))))
    return [f"{value:.{decimals}f}".replace("-", "−") for value in values]


def amount(value: float, unit: str, digits: int = 3) -> str:
    """A value in its own unit."""
    return f"{number(value, digits)} {printed(unit)}".rstrip()


def size(value: float, lower: float, upper: float) -> tuple[str, str, str]:
    """A value and the ends of its interval, with as many digits as tell the ends apart."""
    width = abs(upper - lower)
    largest = max(abs(lower), abs(upper))
    digits = 3 if not width else int(np.clip(np.ceil(np.log10(largest / width)) + 1, 3, 6))
    return number(value, digits), number(lower, digits), number(upper, digits)


def drawn(unit: str) -> tuple[str, float]:
    """The unit that figures have instead of this one, and how many of it one is."""
    return DRAWN.get(unit, (printed(unit), 1.0))


def printed(unit: str) -> str:
    """A unit as print has it; nothing for a pure number."""
    if unit == "1":
        return ""
    return "°C" if unit == "degC" else re.sub(r"(?<=[A-Za-z])[2-6]", lambda at: at[0].translate(RAISED), unit)


def spans(values: Sequence[float], share: float = 0.2) -> list[tuple[float, float]]:
    """From where to where the values lie, broken where there is none over this share of all their range."""
    ordered = np.unique(np.asarray(values, float))
    if not len(ordered):
        return []
    wide = np.flatnonzero(np.diff(ordered) > share * np.ptp(ordered))
    starts, ends = ordered[[0, *(wide + 1)]], ordered[[*wide, -1]]
    return [(float(start), float(end)) for start, end in zip(starts, ends, strict=True)]


def stretches(values: Sequence[float]) -> str:
    """The same in words: ``"18 to 32 and 58 to 61"``."""
    said = [[f"{end:.0f}" for end in span] for span in spans(values)]
    return " and ".join(" to ".join(dict.fromkeys(ends)) for ends in said)


def capital(text: str) -> str:
    """With a capital first."""
    return text[:1].upper() + text[1:]


def counted(count: int, what: str) -> str:
    """So many of a noun whose plural ends with s."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def mean_square(value: float) -> str:
    """A mean square in units of noise, as a table shows it: hundreds without decimals."""
    return f"{value:.2f}" if value < 100.0 else f"{value:.0f}"


def prose(text: str) -> str:
    """A clause of the engine's as a sentence."""
    text = capital(text.replace(" degC", " °C"))
    return text if text.endswith((".", "?")) else f"{text}."
