"""The page of a plant's diagnosis. It shows what ``diagnosis.json`` holds, and draws what that cannot.

Read from top to bottom it is the page, as a truck's is: the verdict, the first screen's facts, then evidence,
doubts, the next recording and provenance, each from the module of that name in `forklift.report.plant`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from forklift.report import page
from forklift.report.blocks import Page, Table
from forklift.report.ledger import considered
from forklift.report.plant import words
from forklift.report.plant.answers import answers
from forklift.report.plant.doubts import doubts
from forklift.report.plant.evidence import evidence
from forklift.report.plant.next_step import next_step
from forklift.report.provenance import made_from

if TYPE_CHECKING:
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis
    from forklift.plant.parts import Plant


def plant_page(found: PlantDiagnosis, told: Mapping[str, Any] | None = None) -> str:
    """The page of a diagnosis; `told` is its ``to_dict()``, if that is at hand."""
    told = found.to_dict() if told is None else told
    plant = found.plant
    seconds = [[name, f"{spent:.1f}"] for name, spent in told["runtime_s"].items()]
    recordings = [[one["file"], one["role"], one["sha256"]] for one in told["recordings"]]
    total = sum(found.seconds.values())
    return page.html(
        Page(
            f"{plant.name} diagnosed",
            f"Diagnosis of {plant.name}: {len(recordings)} recordings, "
            f"{len(plant.effects)} effects in its catalogue",
            told["sentence"],
            (),
            answers(found, told),
            [
                evidence(found, told),
                doubts(found, told),
                next_step(found),
                made_from(
                    _runs(plant, {name for one in found.after for name in one.adjusted}),
                    (),
                    recordings,
                    [
                        Table(
                            f"Seconds by stage, {total:.0f} in all",
                            ["Stage", "Seconds"],
                            seconds,
                            [False, True],
                            folded=True,
                        )
                    ],
                ),
            ],
            words.WORDS,
            [considered(told, words.at, "model", words.KINDS)],
        )
    )


def _runs(plant: Plant, adjusted: Collection[str]) -> str:
    """How the plant was scored; `adjusted`: what is adjusted to single recordings."""
    own = "of a recording held out nothing is adjusted"
    if adjusted:
        own += f" but what it has of its own: {', '.join(sorted(adjusted))}"
    if plant.score == "algebraic":
        return f"The machine has no states: every moment is foreseen from its inputs alone; {own}."
    if plant.score == "restart":
        return (
            f"Simulations start anew every {plant.horizon_s:g} s, and run free in between: no state is "
            f"corrected by a measurement; {own}."
        )
    return (
        "Simulations run free from the start of each recording: no state is corrected by a measurement; "
        f"{own}."
    )
