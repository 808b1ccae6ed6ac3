"""What to record next, and how."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from forklift.report import charts, words
from forklift.report.blocks import Block, Code, Section, Table

if TYPE_CHECKING:
    from forklift.diagnose import Diagnosis


def next_step(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """The recording that would tell most, with its command."""
    proposed, why = told["next_recording"], told["next_recording_why"]
    lead = words.prose(why)
    if proposed is None or found.next_recording is None:
        return Section("next", "Next recording", lead, [])
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
    ]
    return Section("next", "Next recording", lead, blocks)
