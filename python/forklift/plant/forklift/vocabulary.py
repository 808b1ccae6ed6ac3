"""What a forklift's things are called, in text and on pages."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from forklift.base.typeset import amount, drawn
from forklift.plant.forklift.circuit import circuit
from forklift.plant.forklift.effects import EFFECTS, Equation
from forklift.plant.forklift.free_curve import ports
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.plant.forklift.hypotheses import effect_specs
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.variables import words as variable_words
from forklift.plant.misread import Found, misentered, misread
from forklift.plant.protocol import Hypothesis
from forklift.plant.sensor_faults import ALL_SENSORS, CLOCK_SHIFT
from forklift.plant.subject import Shown
from forklift.recordings.channels import LIFTS, Lift, channels

SHOWN: Mapping[str, tuple[str, str, float]] = {
    "m/s": ("velocity", "m/s", 1.0),
    "Pa": ("pressure", "bar", 1e-5),
    "m": ("position", "m", 1.0),
    "A": ("current", "A", 1.0),
    "degC": ("temperature", "°C", 1.0),
}
"""By unit: what the quantity is called, and the unit and scale it is drawn in."""

ENTERED: Mapping[str, tuple[str, str]] = {
    "load_entered": ("load", "entered"),
    "temperature_offset": ("oil temperature", "recorded"),
}
"""By hypothesis: a condition in words, and how its value came to be known."""

CHECKED: Mapping[str, str] = {
    "load_entered": "Weigh the load, with the pallet and all that hangs on the forks.",
    "temperature_offset": "Measure the oil's temperature near the valve.",
}
"""By hypothesis: how what was entered is checked."""

THESIS = "Fri & Fahlén (2017)"

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

CONDITIONS = {
    "load_kg": Shown("load", "kg"),
    "oil_temperature_degc": Shown("oil", "°C"),
    "load": Shown("load", "kg"),
    "oil_temperature": Shown("oil temperature", "K"),
    "oil_warming": Shown("warming of the oil", "K"),
    "free.start": Shown("start of the free lift", "m"),
    "main.start": Shown("start of the main lift", "m"),
}
"""Conditions of a recording: as they are entered, and what is found of each recording by itself."""


class ForkliftWords:
    """A forklift's vocabulary; see `forklift.plant.subject.Words`."""

    noun = "truck"
    kinds: Mapping[str, str] = {
        "physics": "effect",
        "sensor": "sensor",
        "parameter": "conditions entered",
        "unknown": "curve without a name",
    }

    def part(self, name: str) -> str:
        """``"the main lift"``, ``"both lifts"``."""
        return "both lifts" if name == "both" else f"the {name} lift" if name else ""

    def equation(self, name: str) -> str:
        """See `EQUATIONS`."""
        return EQUATIONS[name]  # type: ignore[index]

    def place(self, name: str) -> Shown:
        """A port of a lift, or a channel's sensor, and the unit that an unknown input there is drawn in."""
        lift, _, port = name.partition(".")
        spec = ports().get(port)
        if spec is None:
            known = outputs() | channels()
            return Shown(
                f"sensor of the {self.signal(name)}", *drawn(known[name]["unit"] if name in known else "")
            )
        meaning = spec["meaning"].partition(",")[0].partition(" (3")[0].rstrip(".")
        meaning = meaning[:1].lower() + meaning[1:]
        unit = ("relative change", 1.0) if spec["join"] == "factor" else drawn(spec["unit"])
        return Shown(f"{meaning}, {lift} lift", *unit)

    def signal(self, channel: str) -> str:
        """A channel in words: ``"pressure of the main lift"``."""
        known = (outputs() | channels()).get(channel)
        lift = next((lift for lift in LIFTS if f"_{lift}_" in channel), None)
        if known is None or lift is None or known["unit"] not in SHOWN:
            return channel.rpartition("_")[0].replace("_", " ") or channel
        return f"{SHOWN[known['unit']][0]} of the {lift} lift"

    def like(self, channel: str) -> str:
        """Velocities as Tables 5.4 and 5.5 of the thesis that the model is from."""
        tables = {"velocity_free_m_s": "5.4", "velocity_main_m_s": "5.5"}
        return f"as Table {tables[channel]} of {THESIS}" if channel in tables else ""

    def circuit(self, marked: Collection[str], tied: Collection[str], part: str) -> str:
        """One lift's: of both, the drawing is the same."""
        return circuit(marked, tied, self.part(part))

    def parameters_like(self, part: str) -> str:
        """As its Tables 5.1 and 5.2."""
        tables = {"free": "5.1", "main": "5.2"}
        return f"as Table {tables[part]} of {THESIS}" if part in tables else ""

    def drawn(self, channel: str, unit: str) -> Shown:
        """With the unit and scale of its kind."""
        return Shown(self.signal(channel), *SHOWN[unit][1:])

    def used(self, channel: str, unit: str) -> Shown:
        """Of a lift's velocity, how fast it lowers the forks."""
        for lift, forks in FORKS_PER_SENSOR.items():
            if channel == f"velocity_{lift}_m_s":
                return Shown("the forks lower at", "mm/s", -1e3 * forks)
        fine = self.fine(channel, unit)
        return fine._replace(name=f"{fine.name} at")

    def fine(self, channel: str, unit: str) -> Shown:
        """Millimetres for metres."""
        small = {"m": ("mm", 1e3), "m/s": ("mm/s", 1e3)}
        return Shown(self.signal(channel), *small.get(unit, SHOWN[unit][1:]))

    def variable(self, name: str, part: str) -> Shown:
        """As an operator says it."""
        lift: Lift = "free" if part == "free" else "main"
        known, unit = variable_words(name, lift)
        return Shown(known, *drawn(unit))

    def condition(self, name: str) -> Shown:
        """Load and oil, as entered; and what a recording has of its own."""
        if name.endswith(CLOCK_SHIFT):
            whose = name.removesuffix(CLOCK_SHIFT)
            of = whose if whose == ALL_SENSORS else " and ".join(map(self.signal, whose.split("+")))
            return Shown(f"clock of the {of}", "s")
        return CONDITIONS[name]

    def at(self, name: str, where: str) -> str:
        """With the lift or the channel."""
        if not where:
            return name
        return f"{name} ({f'{where} lift' if where in LIFTS else self.signal(where)})"

    def sentence(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> str:
        """An effect's own sentence with its numbers, else the hypothesis's name."""
        plain = self.at(one.name, one.where)
        plain = f"{plain[:1].upper()}{plain[1:]}."
        effect = next((effect for effect in EFFECTS if effect.id == one.id), None)
        if effect is None:
            return plain
        said = {row["name"].rpartition(".")[2]: amount(row["value"], row["unit"]) for row in rows}
        try:
            return effect.sentence.format(lift=one.where, **said).replace(" degC", " °C")
        except KeyError:  # a parameter that was not estimated
            return plain

    def check(self, one: Hypothesis) -> str:
        """As the effect's file has it; a load is weighed, and a sensor compared with another."""
        if one.kind == "physics":
            return next((effect.check for effect in EFFECTS if effect.id == one.id), "")
        if one.kind == "sensor" and one.where:
            return f"Compare {self._sensor(one.where)} with a reference instrument."
        return CHECKED.get(one.id, "")

    def sound(self, one: Hypothesis) -> str:
        """By the effect's file."""
        effect = next((effect for effect in EFFECTS if effect.id == one.id), None)
        if effect is None or one.kind != "physics":
            return ""
        return f"The machine does so; a sound one {'hardly does' if effect.wear else 'may, too'}."

    def found(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> Found:
        """``"the free lift's pressure sensor reads 4.02 % high"``, or the same of what was entered."""
        if one.kind == "sensor":
            unit = (outputs() | channels())[one.where]["unit"] if one.where else ""
            return misread(self._sensor(one.where), rows, SHOWN[unit][1:] if unit in SHOWN else None)
        if one.kind == "parameter" and one.id in ENTERED:
            told = misentered(*ENTERED[one.id], rows)
            exact = " That takes the pressure sensors for exact." if "load" in one.doubts else ""
            return told._replace(interval=f"{told.interval}{exact}" if told.interval else "")
        return Found()

    def _sensor(self, channel: str) -> str:
        lift = next((lift for lift in LIFTS if f"_{lift}_" in channel), None)
        if not channel:
            return "every sensor"
        what = self.signal(channel).partition(" of the ")[0]
        return f"the {lift} lift's {what} sensor" if lift else f"the sensor of the {what}"

    def law(self, one: Hypothesis) -> Sequence[str]:
        """The equation, its signature and its source."""
        effect = next((effect for effect in EFFECTS if effect.id == one.id), None)
        if one.kind != "physics" or effect is None:
            return ()
        spec, name = effect_specs()[one.id], self.at(one.name, one.where)
        return (
            f"{name[:1].upper()}{name[1:]}: {spec['equation']}",
            f"How it shows itself: {effect.signature}",
            f"Source: {spec['source']}.",
        )
