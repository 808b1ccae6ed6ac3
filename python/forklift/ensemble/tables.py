"""The core's tables of what a sweep may vary, ask and measure, by name."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from forklift import _core

if TYPE_CHECKING:
    from forklift._core import ConditionSpec, QuantitySpec


@cache
def conditions() -> dict[str, ConditionSpec]:
    """What a member's run can be given besides the truck: load, oil temperature, delay, faults of sensors."""
    return {spec["name"]: spec for spec in _core.ensemble_tables()["conditions"]}


@cache
def signals() -> dict[str, QuantitySpec]:
    """What a requirement may speak of."""
    return {spec["name"]: spec for spec in _core.ensemble_tables()["signals"]}


@cache
def measures() -> dict[str, QuantitySpec]:
    """What is measured of every member and lift."""
    return {spec["name"]: spec for spec in _core.ensemble_tables()["measures"]}


@cache
def verdicts() -> dict[str, QuantitySpec]:
    """What may become of a member, by rising gravity; a verdict's number is its place."""
    return {spec["name"]: spec for spec in _core.ensemble_tables()["verdicts"]}


@cache
def tick_s() -> float:
    """Seconds of a controller's tick."""
    return _core.ensemble_tables()["tick_s"]
