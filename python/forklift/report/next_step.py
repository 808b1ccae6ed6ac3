"""What to record next, and what to do with the machine that was found."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import printed, prose
from forklift.diagnosis.next_recording import PARTS
from forklift.report import charts
from forklift.report.answers import gaps
from forklift.report.blocks import Block, Code, Figure, Section, Table, Text
from forklift.report.words import Quantity

if TYPE_CHECKING:
    from forklift.diagnosis.result import Diagnosis


def next_step(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """The recording that would tell most, with what drives it; and how to use what was found."""
    lead = prose(found.next_why)
    if found.next_recording is None and gaps(found):
        lead += f" A recording in the gap would tell its law there, too: {'; '.join(gaps(found))}."
    return Section("next", "Next steps", lead, [*_wanted(found, told), *_parted(found), *_use(found)])


def _wanted(found: Diagnosis, told: Mapping[str, Any]) -> Iterator[Block]:
    wanted, proposed = found.next_recording, told["next_recording"]
    if wanted is None:
        return
    rows = [[what, value] for what, value in wanted.settings]
    yield Table(
        "What to set",
        ["What", "Value"],
        [*rows, ["File of what drives it, beside this page", proposed["command"]]],
        [False, False],
    )
    time, drives = wanted.drives
    yield Figure(
        f"To record: {wanted.title}",
        "",
        [charts.over_time(Quantity(one.name, printed(one.unit)), time, one.values) for one in drives],
        height=260,
        choose="Input",
    )
    if "lift" in proposed:
        again = [
            "forklift", "simulate", "--command", proposed["command"], "--lift", proposed["lift"],
            "--load", f"{proposed['load_kg']:g}", "--temperature", f"{proposed['oil_temperature_degc']:.4g}",
            "--truck", found.machine.file, "--plot", "expected.html",
        ]  # fmt: skip
        yield Code("What the final model would do, simulated", shlex.join(again))


def _parted(found: Diagnosis) -> Iterator[Block]:
    """The pairs of explanations that it would part."""
    if found.proposal is None or found.next_recording is None or not found.proposal.partings:
        return
    yield Table(
        "What it would part",
        ["Expected", "So far", "Parted", "One explanation", "The other"],
        [
            [
                f"{one.expected:.0f}", f"{one.recorded:.0f}", "yes" if one.expected >= PARTS else "no",
                *(said.replace(" and ", " + ") for said in one.rivals),
            ]
            for one in sorted(found.proposal.partings, key=lambda one: -one.expected)
        ],
        [True, True, False, False, False],
        note="Expected ln of their likelihood ratio, and the greatest of those recorded so far, were it made "
        f"once more; {PARTS:g} is the least that parts them.",
    )  # fmt: skip


def _use(found: Diagnosis) -> Iterator[Block]:
    """Simulations with what was found."""
    use = found.machine.use(found.values, found.recordings, [one.hypothesis for one in found.causes])
    yield Text(use.lead)
    yield Code(use.title, use.code)
    if use.note:
        yield Text(use.note, note=True)
    sensors = any(one.hypothesis.kind == "sensor" for one in found.causes)
    if any(one.hypothesis.doubts for one in found.causes):
        yield Text(
            "corrected/, beside this page, holds the recordings with the conditions that were found: give "
            "that folder instead of the campaign to any command that reads one."
            + (" What a sensor reads wrongly is still in its signal." if sensors else "")
        )
