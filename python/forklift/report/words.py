"""Names and numbers as a page says them, to a reader who does not know the engine."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from forklift.effects import EFFECTS, Equation
from forklift.free_shape import ports
from forklift.names import LIFTS, channels, outputs

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from forklift.diagnosis.suspect import Suspect

SHOWN: Mapping[str, tuple[str, str, float]] = {
    "m/s": ("velocity", "m/s", 1.0),
    "Pa": ("pressure", "MPa", 1e-6),
    "m": ("position", "m", 1.0),
    "A": ("current", "A", 1.0),
    "degC": ("temperature", "°C", 1.0),
}
"""By unit: what the quantity is called, and the unit and scale it is drawn in."""

RAISED = str.maketrans("23456", "²³⁴⁵⁶")

EQUATIONS: Mapping[Equation, str] = {
    "force-balance": "the balance of forces on the cylinder",
    "friction": "the friction of the cylinder",
    "cylinder-pressure": "the oil balance of the cylinder, which sets its pressure",
    "bulk-modulus": "the stiffness of the oil",
    "valve-dynamics": "how the valve follows its command",
    "valve-flow": "the flow through the valve",
    "compensator": "the pressure compensator",
    "control-volume": "the oil between valve and compensator",
    "viscosity": "the viscosity of the oil",
    "tank": "the return to the tank",
    "mast-coupling": "how the lifts push each other through the mast",
    "chassis": "the truck's chassis",
    "sensor": "a sensor, not the machine",
    "operating-point": "the conditions that were entered with the recordings",
    "any": "a place that could not be told",
}
"""Where in the model something may be wrong."""

NOISE = "times the sensors' noise (1 is noise alone)"
"""The unit of what is left over, in words."""


def number(value: float | None) -> str:
    """Three digits; a dash for what is not defined."""
    return "—" if value is None else f"{value:.3g}"


def amount(value: float, unit: str) -> str:
    """A value in its own unit."""
    return f"{value:.3g} {printed(unit)}".rstrip()


def printed(unit: str) -> str:
    """A unit as print has it; nothing for a pure number."""
    if unit == "1":
        return ""
    return "°C" if unit == "degC" else re.sub(r"(?<=[A-Za-z])[2-6]", lambda at: at[0].translate(RAISED), unit)


def signal(channel: str) -> str:
    """A channel in words: ``"pressure of the main lift"``."""
    known = (outputs() | channels()).get(channel)
    lift = next((lift for lift in LIFTS if f"_{lift}_" in channel), None)
    if known is None or lift is None or known["unit"] not in SHOWN:
        return channel.rpartition("_")[0].replace("_", " ") or channel
    return f"{SHOWN[known['unit']][0]} of the {lift} lift"


def place(port: str) -> tuple[str, str]:
    """A port of a lift, or a channel's sensor, in words, and what an unknown input there is measured in."""
    lift, _, name = port.partition(".")
    spec = ports().get(name)
    if spec is None:
        unit = (outputs() | channels())[port]["unit"] if port in outputs() | channels() else ""
        return f"sensor of the {signal(port)}", printed(unit)
    meaning = spec["meaning"].partition(",")[0].partition(" (3")[0].rstrip(".")
    meaning = meaning[:1].lower() + meaning[1:]
    return f"{meaning}, {lift} lift", "relative change" if spec["join"] == "factor" else printed(spec["unit"])


def lifts(lift: str) -> str:
    """``"the main lift"`` or ``"both lifts"``."""
    return "both lifts" if lift == "both" else f"the {lift} lift"


def suspect(one: Suspect) -> str:
    """A suspect with where it acts."""
    if not one.where:
        return one.name
    return f"{one.name} ({f'{one.where} lift' if one.where in LIFTS else signal(one.where)})"


def sentence(one: Suspect, rows: Sequence[Mapping[str, Any]]) -> str:
    """What is the matter, with its numbers: an effect's own sentence, else the suspect's name."""
    effect = next((effect for effect in EFFECTS if effect.id == one.id), None)
    said = {row["name"].rpartition(".")[2]: amount(row["value"], row["unit"]) for row in rows}
    if effect is None:
        return f"{suspect(one)[:1].upper()}{suspect(one)[1:]}."
    try:
        return effect.sentence.format(lift=one.where, **said)
    except KeyError:  # a parameter that was not estimated
        return f"{suspect(one)[:1].upper()}{suspect(one)[1:]}."
