"""Numbers as a sentence says them, and as JSON holds them."""

from __future__ import annotations

from math import isfinite
from typing import Any


def amount(value: float, unit: str) -> str:
    """A value as a sentence says it: three digits, with the prefix that keeps them short."""
    value = float(f"{value:.3g}")  # before the prefix is chosen: 999.7 Pa are 1 kPa
    for scale, prefix in ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m")):
        if abs(value) >= scale:
            return f"{value / scale:.3g} {prefix}{unit}"
    return f"{value:.3g} {unit}"


def defined(value: Any) -> Any:
    """`value`, or None for a number that is not finite: JSON has none."""
    return None if isinstance(value, float) and not isfinite(value) else value


def all_defined(told: Any) -> Any:
    """What is to be JSON, with None for every number in it that is not finite."""
    if isinstance(told, dict):
        return {key: all_defined(value) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [all_defined(value) for value in told]
    return defined(told)
