"""What belongs to a plant, in words: its hypotheses, places and quantities."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from forklift.report.words import CAUSES, GLOSSARY, Quantity, number, printed, size

if TYPE_CHECKING:
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis
    from forklift.plant.parts import Effect, Input, Output, Plant, Port, State
    from forklift.plant.protocol import Hypothesis

KINDS = {
    "physics": "effect",
    "sensor": "sensor or input",
    "parameter": "parameter that was held as known",
    "unknown": "curve without a name",
}
PLACES = {"balance": "a balance", "law": "a law", "input": "an input", "sensor": "a sensor"}
"""By a port's kind: what it means to be wrong there."""

WORDS = {
    "Held out": GLOSSARY["Held out"],
    "Root mean square error": "Of measured less simulated, over all samples that are not missing, in the "
    "unit of what was measured. Where a sensor is at an end of its range, the simulation is, too.",
    "Noise power": "The mean square of measured less simulated over the sensor's own noise squared. At 1 "
    "nothing is left but noise, so that no model could do better; at 4 the error is twice the noise.",
    "Before, after": "Before: the model with its parameters fitted as well as can be. After: the same with "
    "what was found, fitted anew.",
    "Credibility": "In which share of random redraws of what was held out a cause leaves less over than "
    "everything else that was tried. It compares what was tried, and does not say that nothing else exists.",
    "Interval": "Where the true value lies with a probability of 95 %, if the model is right. It is wider "
    "where what is left over is correlated, and where more is left over of what was held out than of what "
    "was fitted.",
    "Promise": CAUSES["Promise"],
}


def hypothesis(one: Hypothesis) -> str:
    """A hypothesis with where it acts."""
    return at(one.name, one.where)


def at(name: str, where: str) -> str:
    """What has a name, with where it acts, if the name does not say it."""
    said = not where or re.search(rf"(?<!\w){re.escape(where)}(?!\w)", name)
    return name if said else f"{name} ({where})"


def effect(plant: Plant, one: Hypothesis) -> Effect | None:
    """The plant's own effect that a hypothesis is; None for its dull rivals and for free shapes."""
    return next((found for found in plant.effects if one.kind == "physics" and found.id == one.id), None)


def ports(plant: Plant, one: Hypothesis) -> tuple[str, ...]:
    """Where a hypothesis enters: ports, inputs or outputs."""
    found = effect(plant, one)
    if found is not None:
        return found.ports
    return (one.where,) if one.where else ()


def place(plant: Plant, name: str) -> str:
    """A port, an input or an output in words."""
    for port in plant.ports:
        if port.name == name:
            return f"{name}, {PLACES[port.kind]}"
    if any(one.name == name for one in plant.inputs):
        return f"the input {name}"
    if any(one.name == name for one in plant.outputs):
        return f"the sensor of {name}"
    return f"the parameter {name}"


def quantity(plant: Plant, name: str) -> Quantity:
    """A state, input, output or port as a figure has it; what is on the bus has no unit."""
    states = (*plant.states, *(state for one in plant.effects for state in one.states))
    parts: tuple[State | Input | Output | Port, ...] = (*states, *plant.inputs, *plant.outputs, *plant.ports)
    units = {one.name: one.unit for one in reversed(parts)}
    return Quantity(name, printed(units[name]) if name in units else "", symbol=True)


def sizes(told: Mapping[str, Any], one: Hypothesis) -> Iterator[str]:
    """Every parameter of a hypothesis with its interval; of a curve without a name none."""
    if one.kind == "unknown" or one.amplitude is None:
        return
    head = f"{one.id}." if one.kind == "physics" else one.amplitude
    for row in told["parameters"]:
        if row["name"].startswith(head) if one.kind == "physics" else row["name"] == head:
            yield interval(row)


def interval(row: Mapping[str, Any]) -> str:
    """A parameter with its interval and unit."""
    value, lower, upper = size(row["value"], row["lower"], row["upper"])
    return f"{row['name']} = {value} {printed(row['unit'])}".rstrip() + f" (95 % interval {lower} to {upper})"


def change(before: float, after: float, unit: str) -> str:
    """What falls, with its unit."""
    return f"{number(before)} → {number(after)} {printed(unit)}".rstrip()


def samples(found: PlantDiagnosis) -> str:
    """What was judged on: how many recordings, and in how many stretches that err independently."""
    held = len({one.file for one in found.scores if one.role == found.judged_on})
    stretches = len(found.final.by_recording())
    each = f", as {stretches} stretches" if stretches != held else ""
    kind = "held out" if found.judged_on == "validate" else "fitted on"
    return f"{held} recording{'s' if held > 1 else ''} {kind}{each}"
