"""What a sweep varies, asks and measures, in words and units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from forklift.base.typeset import number, printed
from forklift.control.controller import lift_settings, shared_settings
from forklift.ensemble.tables import conditions, measures, signals
from forklift.plant.forklift.tables import parameters
from forklift.recordings.channels import commanded

if TYPE_CHECKING:
    from forklift.ensemble.specification import Specification, Vary


@dataclass(frozen=True)
class Quantity:
    """A column of a sweep's members.

    Attributes
    ----------
    label
        What a reader calls it: ``"oil temperature"``; of a truck's parameter its name.
    unit
        As the core's tables have it: ``"degC"``, ``"1"``.
    """

    label: str
    unit: str

    @property
    def heading(self) -> str:
        """With its unit, for an axis or a column: ``"oil temperature [°C]"``."""
        unit = printed(self.unit)
        return f"{self.label} [{unit}]" if unit else self.label


def quantity(specification: Specification, name: str, *, controlled: bool) -> Quantity:
    """Of what varies, by the name it has in ``[vary.NAME]``; `controlled`: whether a controller ran."""
    if name in conditions():
        unit = conditions()[name]["unit"]
        return Quantity(name.removesuffix(f"_{unit.lower()}").replace("_", " "), unit)
    if name in parameters():
        return Quantity(name, parameters()[name]["unit"])
    if name.startswith("profile."):
        stretch = specification.profile[int(name.removeprefix("profile."))]
        unit = "m/s" if controlled else "A"
        return Quantity(f"what is asked for from {number(stretch.from_s)} s on", unit)
    part, _, setting = name.removeprefix("controller.").partition(".")
    known = shared_settings() if part == "shared" else lift_settings()
    return Quantity(name, known[setting]["unit"] if setting in known else "1")


def units(specification: Specification, *, controlled: bool) -> dict[str, str]:
    """Of what varies, of the margins (their signals') and of the measures, by the members' columns."""
    found = {name: quantity(specification, name, controlled=controlled).unit for name in specification.vary}
    found |= {f"margin.{one.name}": signals()[one.signal]["unit"] for one in specification.require}
    lifts = commanded(specification.lifts)
    return found | {f"{lift}.{name}": known["unit"] for lift in lifts for name, known in measures().items()}


def distribution(vary: Vary, name: str) -> str:
    """A distribution in words: ``"uniform, 0 to 2500"``."""
    kind = vary.kind(name)
    numbers = [number(x, 4) for x in getattr(vary, kind)]
    of = " times the value it has" if vary.relative else ""
    if kind == "choice":
        return f"one of {', '.join(numbers)}{of}"
    if kind == "grid":
        return f"{numbers[2]} values from {numbers[0]} to {numbers[1]}{of}"
    cut = f", cut off at {numbers[2]} and {numbers[3]}{of}" if len(numbers) == 4 else ""
    if kind == "normal":
        return f"normal, mean {numbers[0]}{of}, standard deviation {numbers[1]}{of}{cut}"
    if kind == "log_normal":
        return f"log-normal, median {numbers[0]}{of}, deviation of its logarithm {numbers[1]}{cut}"
    return f"{kind.replace('_', '-')}, {numbers[0]} to {numbers[1]}{of}"
