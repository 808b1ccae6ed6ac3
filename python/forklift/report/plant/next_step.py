"""What to record next, and how to simulate with what was found."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from forklift.diagnosis.next_recording import PARTS
from forklift.report import charts
from forklift.report.blocks import Block, Code, Figure, Section, Table, Text
from forklift.report.plant import words
from forklift.report.words import prose

if TYPE_CHECKING:
    from forklift.diagnosis.next_recording import Proposal
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis

UNASKED = (
    "No candidates were given, or no other explanation came near enough to be parted from what was found. "
    "With candidates=[...], recordings that could be made (inputs only), a diagnosis names the one that "
    "parts best."
)


def next_step(found: PlantDiagnosis) -> Section:
    """The recording that would tell most, and a call that simulates what was found."""
    proposed = found.next_recording
    lead = UNASKED if proposed is None else _why(proposed)
    if not found.causes:
        lead = (
            "No cause was named, so that there are no rivals to part."
            if found.verdict == "no-mismatch"
            else "No effect of the catalogue explains what is left over. Look at what the recordings ask for "
            "(Evidence), write an effect that acts there as a function of what tells it, and diagnose again."
        )
    return Section("next", "Next steps", lead, [*_candidate(found), *_use(found)])


def _why(proposed: Proposal) -> str:
    """Of a candidate that was chosen the pairs are in a table; else the engine's own words."""
    if proposed.candidate is None:
        return prose(proposed.why)
    parted = sum(one.expected >= PARTS for one in proposed.partings)
    return (
        f"Of the candidates this parts most explanations, {parted} of {len(proposed.partings)} pairs below: "
        f"{proposed.candidate.name}."
    )


def _candidate(found: PlantDiagnosis) -> Iterator[Block]:
    proposed = found.next_recording
    if proposed is None or proposed.candidate is None:
        return
    recording, plant = proposed.candidate.sample.recording, found.plant
    inputs = [words.quantity(plant, one.name) for one in plant.inputs if one.derived is None]
    inputs.sort(key=lambda of: not np.ptp(recording.u[of.name]))  # what moves first
    rows = [
        [
            f"{one.expected:.0f}", f"{one.recorded:.0f}", "yes" if one.expected >= PARTS else "no",
            *(said.replace(" and ", " + ") for said in one.rivals),
        ]
        for one in sorted(proposed.partings, key=lambda one: -one.expected)
    ]  # fmt: skip
    yield Figure(
        f"To record: {proposed.candidate.name}",
        "",
        [charts.over_time(of, recording.time_s, recording.u[of.name]) for of in inputs],
        height=260,
        choose="Input",
    )
    yield Table(
        "What it would part",
        ["Expected", "So far", "Parted", "One explanation", "The other"],
        rows,
        [True, True, False, False, False],
        note="Expected ln of their likelihood ratio, and the greatest of those recorded so far, were it made "
        f"once more; {PARTS:g} is the least that parts them.",
    )


def _use(found: PlantDiagnosis) -> list[Block]:
    """A call that simulates with the parameters and effects that were found."""
    plant = found.plant
    effects = [one.hypothesis.id for one in found.causes if words.effect(plant, one.hypothesis)]
    heads = tuple(f"{name}." for name in effects)
    own = {one.name for one in plant.params} | {f"{state.name}.start" for state in plant.states}
    values = {one.name: one.value for one in found.numbers if one.name in own or one.name.startswith(heads)}
    given = ", ".join(f'"{name}": {value:.6g}' for name, value in values.items())
    present = f", present={effects}".replace("'", '"') if effects else ""
    others = [one.hypothesis.label for one in found.causes if not words.effect(plant, one.hypothesis)]
    more: list[Block] = (
        [Text(f"It leaves out what is no effect of the plant's own: {', '.join(others)}.", note=True)]
        if others
        else []
    )
    return [
        Code(
            "Simulate with what was found, through times and inputs of your own",
            f"forklift.simulate_plant(plant, time_s, u, {{{given}}}{present})",
        ),
        *more,
    ]
