"""Names and numbers as a page says them, to a reader who does not know the engine."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from forklift.diagnosis.criteria import LAW
from forklift.plant.forklift.effects import EFFECTS, Equation
from forklift.plant.forklift.free_curve import ports
from forklift.plant.forklift.tables import outputs
from forklift.recordings.channels import LIFTS, channels

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from forklift.diagnosis.screening import Screened
    from forklift.plant.protocol import Hypothesis
    from forklift.recordings.campaign import Campaign

SHOWN: Mapping[str, tuple[str, str, float]] = {
    "m/s": ("velocity", "m/s", 1.0),
    "Pa": ("pressure", "bar", 1e-5),
    "m": ("position", "m", 1.0),
    "A": ("current", "A", 1.0),
    "degC": ("temperature", "°C", 1.0),
}
"""By unit: what the quantity is called, and the unit and scale it is drawn in."""

FAST = "\u00a0"
"""A space at which no line is broken."""
HIGH = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
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
    "operating-point": "the conditions entered with the recordings, not the machine",
    "any": "a place that could not be told",
}
"""Where in the model something may be wrong."""


class Quantity(NamedTuple):
    """What a figure draws: its name, the unit it is drawn in, and how many of that one of its own is."""

    name: str
    unit: str = ""
    scale: float = 1.0
    symbol: bool = False
    """Whether its name is written as it is, and never with a capital."""

    @property
    def titled(self) -> str:
        """As an axis has it."""
        name = self.name if self.symbol else capital(self.name)
        return f"{name} [{self.unit}]" if self.unit else name


GLOSSARY: dict[str, str] = {
    "Held out": "Recordings that the model was not fitted on (role validate). Only they say how good it is: "
    "on those it was fitted on, any model can be made to look good.",
    "Fit": "Of the simulated to the measured velocity. NRMSE, by the normalised root mean square "
    "error, is 100 % less that error in per cent of the measured signal's standard deviation; NMSE the same "
    "with squares. 100 % is perfect, 0 % no better than a constant.",
    "Noise power": "The mean square of measured less simulated over the sensor's own noise squared. At 1 "
    "nothing is left but noise, so that no model could do better; at 4 the error is twice the noise. "
    "An encoder at rest reads the same count all the time and leaves nothing, so that averages and moments "
    "at rest may lie below 1.",
    "Free run": "A simulation from the start of a recording to its end, which gets the command and sees no "
    "measurement.",
}
"""Words that every page has."""
CAUSES: dict[str, str] = {
    "Before, after": "Before: the truck with its parameters fitted as well as can be. After: the same with "
    "what was found, fitted anew.",
    "Credibility": "In which share of random redraws of the recordings held out a cause leaves less over "
    "than everything else that was tried. It compares what was tried, and does not say that nothing else "
    "exists.",
    "Interval": "Where the true value lies with the probability given, if the model is right: 99 % for the "
    "size of a cause, since a verdict hangs on it, and widened by what is left over; 95 % for all else.",
    "Promise": "How far −ln of the probability of all recordings together would fall with a hypothesis, by a "
    "linear estimate and before any fit. 5 is strong; but many make up for one another, so that fits decide.",
}
"""Words of a diagnosis."""

REST = "an encoder at rest leaves nothing, so that an average may lie below 1"
"""Why averages lie below what is called noise alone."""
NOISE = "times the sensors' noise power (1 is noise alone)"
"""The unit of what is left over, in words."""


DRAWN: Mapping[str, tuple[str, float]] = {
    "Pa": ("bar", 1e-5), "m3/s": ("l/min", 6e4), "N": ("kN", 1e-3), "degC": ("°C", 1.0),
}  # fmt: skip
"""By unit: the one that figures have instead, and how many of it one is."""


def number(value: float | None, digits: int = 3) -> str:
    """A few digits, as print has them; a dash for what is not defined."""
    if value is None:
        return "—"
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0.0 or 1e-3 <= abs(rounded) < 1e6:
        decimals = 0 if rounded == 0.0 else max(0, digits - 1 - int(np.floor(np.log10(abs(rounded)))))
        said = f"{rounded:.{decimals}f}"
        said = said.rstrip("0").rstrip(".") if "." in said else said
        return said.replace("-", "−")
    said, _, power = f"{rounded:.{digits - 1}e}".partition("e")
    said = said.rstrip("0").rstrip(".") if "." in said else said
    return f"{said.replace('-', '−')}{FAST}×{FAST}10{str(int(power)).translate(HIGH)}"


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


def signal(channel: str) -> str:
    """A channel in words: ``"pressure of the main lift"``."""
    known = (outputs() | channels()).get(channel)
    lift = next((lift for lift in LIFTS if f"_{lift}_" in channel), None)
    if known is None or lift is None or known["unit"] not in SHOWN:
        return channel.rpartition("_")[0].replace("_", " ") or channel
    return f"{SHOWN[known['unit']][0]} of the {lift} lift"


def place(port: str) -> tuple[str, str, float]:
    """A port of a lift, or a channel's sensor, in words; what an unknown input there is drawn in.

    And how many of that unit one of its own is.
    """
    lift, _, name = port.partition(".")
    spec = ports().get(name)
    if spec is None:
        unit = (outputs() | channels())[port]["unit"] if port in outputs() | channels() else ""
        return f"sensor of the {signal(port)}", *drawn(unit)
    meaning = spec["meaning"].partition(",")[0].partition(" (3")[0].rstrip(".")
    meaning = meaning[:1].lower() + meaning[1:]
    unit, scale = ("relative change", 1.0) if spec["join"] == "factor" else drawn(spec["unit"])
    return f"{meaning}, {lift} lift", unit, scale


def lifts(lift: str) -> str:
    """``"the main lift"`` or ``"both lifts"``."""
    return "both lifts" if lift == "both" else f"the {lift} lift"


def campaign(campaign: Campaign) -> str:
    """Its name, if that says anything; else what it is."""
    names = [campaign.name, *([campaign.folder.resolve().name] if campaign.folder else [])]
    telling = next((name for name in names if name.lower() != "campaign"), None)
    return f"campaign “{telling}”" if telling else "a campaign"


def fine(channel: str, unit: str) -> tuple[str, str, float]:
    """An error of this signal: of what, and the unit and scale that suit its size."""
    small = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3)}
    _, shown, scale = SHOWN[unit]
    return signal(channel), *small.get(unit, (shown, scale))


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


def prose(text: str) -> str:
    """A clause of the engine's as a sentence."""
    text = capital(text.replace(" degC", " °C"))
    return text if text.endswith((".", "?")) else f"{text}."


def hypothesis(one: Hypothesis) -> str:
    """A hypothesis with where it acts."""
    return at(one.name, one.where)


def at(name: str, where: str) -> str:
    """What has a name, with where it acts: a lift, a channel, or nothing in particular."""
    if not where:
        return name
    return f"{name} ({f'{where} lift' if where in LIFTS else signal(where)})"


def sentence(one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> str:
    """What is the matter, with its numbers: an effect's own sentence, else the hypothesis's name."""
    effect = next((effect for effect in EFFECTS if effect.id == one.id), None)
    said = {row["name"].rpartition(".")[2]: amount(row["value"], row["unit"]) for row in rows}
    if effect is None:
        return f"{capital(hypothesis(one))}."
    try:
        return effect.sentence.format(lift=one.where, **said).replace(" degC", " °C")
    except KeyError:  # a parameter that was not estimated
        return f"{capital(hypothesis(one))}."


def another_law(curve: Screened, joined: bool) -> str:
    """Why the law of what explains everything is in doubt; `joined`: whether the curve is in the model."""
    return (
        "The catalogue's law alone leaves no more than the noise in any signal, but a curve over "
        f"{curve.hypotheses[0].over} beside it explains all recordings better (it promises "
        f"{number(curve.gain)} in ln posterior, where {LAW:g} is much); fitted without those held out, it "
        f"{'explains these better too' if joined else 'does not clearly explain these better'}. Where no "
        "recording lies, neither is told."
    )
