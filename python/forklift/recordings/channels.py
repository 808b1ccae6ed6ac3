"""The channels a recording may hold, with their units and limits, as the Rust core's table has them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats

if TYPE_CHECKING:
    from forklift._core import QuantitySpec


Lift = Literal["free", "main"]
Lifts = Literal["both", "free", "main"]
LIFTS: tuple[Lift, Lift] = ("free", "main")


def commanded(lift: Lifts) -> tuple[Lift, ...]:
    """The lifts that `lift` stands for: ``"both"`` is both of them."""
    return LIFTS if lift == "both" else (lift,)


def names_other_lift(name: str, channel: str) -> bool:
    """Whether `name` is of the other lift than `channel`, so that one cannot stand for the other."""
    own, other = ({lift for lift in LIFTS if lift in one.lower().split("_")} for one in (channel, name))
    return bool(own and other) and own != other


TIME = "time_s"
COMMANDS = ("current_free_a", "current_main_a")
"""The commanded currents: known at every instant, held from one sample until the next."""
REQUIRED = (TIME, *COMMANDS)
"""What every recording must hold; all other channels are optional."""


@dataclass(frozen=True)
class Channel:
    """One row of the core's channel table.

    Attributes
    ----------
    name, unit, meaning
        What the channel is called, its unit and what it measures.
    lower, upper
        Limits of every value, in `unit`.
    typical_lower, typical_upper
        Limits of the largest absolute value, in `unit`; None: no such limit.
    """

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float
    typical_lower: float | None
    typical_upper: float | None

    def fits(self, values: Floats) -> bool:
        """Whether finite `values`, in `unit`, keep to all limits."""
        largest = float(np.max(np.abs(values)))
        low = self.typical_lower is None or largest >= self.typical_lower
        high = self.typical_upper is None or largest <= self.typical_upper
        return low and high and self.inside(values)

    def inside(self, values: Floats) -> bool:
        """Whether finite `values`, in `unit`, keep to `lower` and `upper`."""
        return bool(values.min() >= self.lower and values.max() <= self.upper)


@cache
def channels() -> dict[str, QuantitySpec]:
    """What a recording may hold, in its order."""
    return {spec["name"]: spec for spec in _core.channel_table()}


@cache
def table() -> dict[str, Channel]:
    """Every channel by name, in the core's order."""
    return {name: _channel(cast("dict[str, Any]", row)) for name, row in channels().items()}


def _channel(row: dict[str, Any]) -> Channel:
    return Channel(
        name=row["name"],
        unit=row["unit"],
        meaning=row["meaning"],
        lower=row.get("lower", -np.inf),
        upper=row.get("upper", np.inf),
        typical_lower=row.get("typical_lower"),
        typical_upper=row.get("typical_upper"),
    )


@dataclass(frozen=True)
class Conversion:
    """From a unit in which people measure to the table's: ``value * scale + offset``."""

    name: str
    scale: float
    offset: float = 0.0


# BIPM, The International System of Units, 9th edition (2019): 0 degC = 273.15 K; 1 bar = 1e5 Pa; prefixes.
_OWN: dict[str, tuple[Conversion, ...]] = {
    "Pa": (Conversion("bar", 1e5), Conversion("MPa", 1e6), Conversion("kPa", 1e3)),
    "degC": (Conversion("K", 1.0, -273.15),),
    "m": (Conversion("mm", 1e-3), Conversion("cm", 1e-2)),
    "s": (Conversion("ms", 1e-3), Conversion("µs", 1e-6)),
}


def conversions(unit: str) -> tuple[Conversion, ...]:
    """What values that ought to be in `unit` may have been measured in, the likeliest first."""
    return _OWN.get(unit, (Conversion(f"m{unit}", 1e-3),))


def looks_like(channel: Channel, values: Floats) -> list[Conversion]:
    """The conversions after which finite `values` would keep to all limits of `channel`."""
    return [unit for unit in conversions(channel.unit) if channel.fits(values * unit.scale + unit.offset)]
