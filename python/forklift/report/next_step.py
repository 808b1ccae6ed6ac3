"""What to record next, and what to do with the truck that was found."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from forklift.report import charts, words
from forklift.report.blocks import Block, Code, Section, Table, Text

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import Diagnosis


def next_step(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """The recording that would tell most, with its command; and the commands that use the truck."""
    proposed, why = told["next_recording"], told["next_recording_why"]
    lead = words.prose(why)
    if proposed is None or found.next_recording is None:
        return Section("next", "Next steps", lead, _use(found))
    again = [
        "forklift", "simulate", "--command", proposed["command"], "--lift", proposed["lift"],
        "--load", f"{proposed['load_kg']:g}", "--temperature", f"{proposed['oil_temperature_degc']:.4g}",
        "--truck", "truck.toml", "--plot", "expected.html",
    ]  # fmt: skip
    blocks: list[Block] = [
        Table(
            "What to set",
            ["What", "Value"],
            [
                ["Lift to command", words.lifts(proposed["lift"])],
                ["Load on the forks", f"{proposed['load_kg']:g} kg"],
                ["Oil temperature", f"{proposed['oil_temperature_degc']:.1f} °C"],
                ["Command file, beside this page", proposed["command"]],
            ],
            [False, False],
        ),
        charts.command(found.next_recording),
        Code("What the final truck would do, simulated", shlex.join(again)),
        *_use(found),
    ]
    return Section("next", "Next steps", lead, blocks)


def _use(found: Diagnosis) -> list[Block]:
    """Simulations with the final truck, at an operating point of the campaign."""
    shown = next(
        (one for one in found.after.predictions if one.recording.role == "validate"),
        found.after.predictions[0],
    )
    command = [
        "forklift", "simulate", "--truck", "truck.toml", "--lift", shown.recording.lift,
        "--load", f"{shown.recording.load_kg:g}", "--temperature", f"{shown.oil_temperature_degc:.0f}",
        "--command", "prms", "--out", "lowering.csv", "--plot", "lowering.html",
    ]  # fmt: skip
    return [
        Text(
            "truck.toml, beside this page, is the truck as it was found: its parameters fitted, and what was "
            "missing added. In this folder, this simulates a lowering with it, here at an operating point of "
            "these recordings; choose another load, temperature and command as you need them."
        ),
        Code("Simulate with the truck that was found", shlex.join(command)),
    ]
