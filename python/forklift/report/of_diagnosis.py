"""The page of a diagnosis. It shows what ``diagnosis.json`` holds, and draws what that cannot.

Read from top to bottom it is the page: the verdict, the first screen's facts, then evidence, doubts, the next
recording and provenance, each from the module of that name.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from forklift.report import page, words
from forklift.report.answers import answers
from forklift.report.blocks import Page, Table
from forklift.report.doubts import doubts
from forklift.report.evidence import evidence
from forklift.report.ledger import considered
from forklift.report.next_step import next_step
from forklift.report.provenance import provenance

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import Diagnosis


def diagnosis_page(found: Diagnosis, told: Mapping[str, Any] | None = None) -> str:
    """The page of a diagnosis; `told` is its ``to_dict()``, if that is at hand."""
    told = found.to_dict() if told is None else told
    seconds = [[name, f"{spent:.1f}"] for name, spent in told["seconds"].items()]
    return page.html(
        Page(
            f"{words.capital(words.campaign(found.campaign))} diagnosed",
            f"Diagnosis of {words.campaign(found.campaign)}, "
            f"starting from the truck “{told['start']['name']}”",
            told["sentence"],
            (),
            answers(found, told),
            [
                evidence(found, told),
                doubts(found, told),
                next_step(found, told),
                provenance(
                    found.campaign,
                    {"Start": found.start, "Final truck, truck.toml": found.truck},
                    told["command"],
                    [Table("Seconds by stage", ["Stage", "Seconds"], seconds, [False, True], folded=True)],
                ),
            ],
            words.GLOSSARY | words.CAUSES,
            [considered(told)],
        )
    )
