"""The page of a diagnosis, of any machine: what ``diagnosis.json`` holds, and drawings of what it cannot.

Read from top to bottom it is the page: the verdict, the first screen's facts, then evidence, doubts, the next
recording and provenance, each from the module of that name.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from forklift.report import page, words
from forklift.report.answers import answers
from forklift.report.blocks import Code, Page, Section, Table
from forklift.report.doubts import doubts
from forklift.report.evidence import evidence
from forklift.report.ledger import considered
from forklift.report.next_step import next_step
from forklift.report.provenance import made_from

if TYPE_CHECKING:
    from forklift.diagnosis.result import Diagnosis


def diagnosis_page(found: Diagnosis, told: Mapping[str, Any] | None = None) -> str:
    """The page of a diagnosis; `told` is its ``to_dict()``, if that is at hand."""
    told = found.to_dict() if told is None else told
    noun = found.machine.words.noun
    return page.html(
        Page(
            f"{words.capital(found.origin.title)} diagnosed",
            f"Diagnosis of {found.origin.title}, starting from the {noun} “{found.machine.name}”",
            told["sentence"],
            (),
            answers(found, told),
            [
                evidence(found, told),
                doubts(found, told),
                next_step(found, told),
                _provenance(found, told),
            ],
            words.GLOSSARY | words.CAUSES,
            [considered(told, found.machine.words)],
        )
    )


def _provenance(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """Hashes, versions, the command, and how long it took."""
    condition = found.machine.words.condition
    adjusted = {condition(name).name for one in found.after.predictions for name in one.adjusted}
    own = f" but what it has of its own: {', '.join(sorted(adjusted))}" if adjusted else ""
    made = [[words.capital(found.origin.title), told["campaign_facts"]["sha256"]]]
    made += [
        [f"{part}: “{told[key]['name']}”", told[key]["sha256"]]
        for part, key in (("Start", "start"), (f"Final, {found.machine.file}", found.machine.words.noun))
        if "sha256" in told.get(key, {})
    ]
    again = [Code("The same again", told["command"])] if told["command"] else []
    seconds = [[name, f"{spent:.1f}"] for name, spent in found.seconds.items()]
    return made_from(
        f"{found.machine.runs} Of a recording held out nothing is adjusted{own}.",
        [*again, Table("Made from", ["What", "SHA-256"], made, [False, False])],
        [[one["file"], one["role"], one["sha256"]] for one in told["recordings"]],
        [
            Table(
                f"Seconds by stage, {sum(found.seconds.values()):.0f} in all",
                ["Stage", "Seconds"],
                seconds,
                [False, True],
                folded=True,
            )
        ],
    )
