"""What a plant's things are called: its own names."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from forklift.base.typeset import printed
from forklift.plant.misread import Found, misread
from forklift.plant.parts import Plant
from forklift.plant.protocol import Hypothesis
from forklift.plant.subject import Shown

PLACES = {"balance": "a balance", "law": "a law", "input": "an input", "sensor": "a sensor"}
"""By a place's kind: what it means to be wrong there."""


@dataclass(frozen=True)
class PlantWords:
    """The vocabulary of a plant: its own names; see `forklift.plant.subject.Words`."""

    plant: Plant
    noun: ClassVar[str] = "model"
    kinds: ClassVar[Mapping[str, str]] = {
        "physics": "effect",
        "sensor": "sensor or input",
        "parameter": "parameter that was held as known",
        "unknown": "curve without a name",
    }

    def part(self, name: str) -> str:
        """There is one."""
        return ""

    def equation(self, name: str) -> str:
        """A balance, a law, an input, a sensor or a parameter."""
        return PLACES.get(name, f"a {name}")

    def place(self, name: str) -> Shown:
        """A port, an input, an output or a parameter."""
        unit = printed(self._units().get(name, "1"))
        port = next((one for one in self.plant.ports if one.name == name), None)
        if port is not None:
            return Shown(f"{name}, {PLACES[port.kind]}", unit)
        if any(one.name == name for one in self.plant.inputs):
            return Shown(f"the input {name}", unit)
        if any(one.name == name for one in self.plant.outputs):
            return Shown(f"the sensor of {name}", unit)
        return Shown(f"the parameter {name}", unit)

    def signal(self, channel: str) -> str:
        """As it is called."""
        return channel

    def circuit(self, marked: Collection[str], tied: Collection[str], part: str) -> str:
        """None."""
        return ""

    def like(self, channel: str) -> str:
        """As any."""
        return ""

    def parameters_like(self, part: str) -> str:
        """As any."""
        return ""

    def drawn(self, channel: str, unit: str) -> Shown:
        """In its own unit."""
        return Shown(channel, printed(unit))

    def used(self, channel: str, unit: str) -> Shown:
        """As it is called."""
        return self.fine(channel, unit)._replace(name=f"{channel} is at")

    def fine(self, channel: str, unit: str) -> Shown:
        """In its own unit."""
        return Shown(channel, printed(unit))

    def variable(self, name: str, part: str) -> Shown:
        """A state, input, output or port; what is on the bus has no unit."""
        return Shown(name, printed(self._units().get(name, "1")))

    def condition(self, name: str) -> Shown:
        """As it is called."""
        return Shown(name)

    def at(self, name: str, where: str) -> str:
        """With where it acts, if the name does not say it."""
        said = not where or re.search(rf"(?<!\w){re.escape(where)}(?!\w)", name)
        return name if said else f"{name} ({where})"

    def sentence(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> str:
        """Its name says it."""
        return ""

    def found(self, one: Hypothesis, rows: Sequence[Mapping[str, Any]]) -> Found:
        """A sensor's or an input's gain, offset or lag."""
        if one.kind != "sensor" or not one.where:
            return Found()
        given = any(own.name == one.where for own in self.plant.inputs)
        return Found() if given else misread(f"the sensor of {one.where}", rows)

    def check(self, one: Hypothesis) -> str:
        """Nothing is known of a machine of one's own."""
        return ""

    def sound(self, one: Hypothesis) -> str:
        """Nothing is known of a machine of one's own."""
        return ""

    def law(self, one: Hypothesis) -> Sequence[str]:
        """Where it acts, and its source."""
        effect = next((e for e in self.plant.effects if one.kind == "physics" and e.id == one.id), None)
        if effect is None:
            return ()
        source = f" Source: {effect.source}." if effect.source else ""
        name = self.at(one.name, one.where)
        where = f", at {' and '.join(effect.ports)}" if effect.ports else ""
        return (f"{name[:1].upper()}{name[1:]} (“{one.id}”){where}.{source}",)

    def _units(self) -> dict[str, str]:
        plant = self.plant
        states = (*plant.states, *(state for one in plant.effects for state in one.states))
        parts: tuple[Any, ...] = (*states, *plant.inputs, *plant.outputs, *plant.ports)
        return {one.name: one.unit for one in reversed(parts)}
