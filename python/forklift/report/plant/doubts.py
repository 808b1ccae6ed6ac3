"""What a plant's diagnosis does not know: what cannot be told apart, does not hold, or was not asked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.diagnosis.ledger import Untold
from forklift.report.blocks import Block, Points, Section, Table
from forklift.report.plant import words
from forklift.report.words import NOISE, another_law, capital, number

if TYPE_CHECKING:
    from forklift.diagnosis.group_validation import GroupFold
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis


FEW = 4
"""Stretches below which a credibility says little."""
UNTOLD: Mapping[Untold, str] = {
    "no-trace": "Nothing that these recordings measure answers to it",
    "any-size": "What these recordings measure answers to it so little that it may have any plausible size",
}


def doubts(found: PlantDiagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks against the verdict, or limits it."""
    blocks: list[Block] = [
        Points(list(_alike(found)), "Could it be taken for something else?"),
        Points(list(_form(found)), "Is the law right, and is anything left over?"),
        Points(list(_everywhere(found)), "Does it hold everywhere?"),
        *_groups(found),
        Points(list(_untestable(told)), "What these recordings cannot tell"),
        Points(list(_recordings(found)), "About these recordings"),
    ]
    return Section(
        "doubts", "Doubts", "What could be wrong with this verdict, and what it leaves open.", blocks
    )


def _alike(found: PlantDiagnosis) -> Iterator[str]:
    if not found.causes:
        yield "No cause was named, so that there is none to be taken for another."
        return
    none = True
    for cause in found.causes:
        name = capital(words.hypothesis(cause.hypothesis))
        if cause.not_separable_from:
            none = False
            others = " or ".join(f"“{words.hypothesis(one)}”" for one in cause.not_separable_from)
            yield f"“{name}” cannot be told from {others}: they explain what was held out as well."
        stand = [one for one in found.confounded if one.accepted is cause.hypothesis]
        if stand:
            none = False
            others = ", ".join(f"{words.hypothesis(one.other)} ({100 * one.share:.0f} %)" for one in stand)
            yield (
                f"“{name}” has nearly the same effect on these recordings as what follows, which to first "
                f"order takes over so much of it with other parameters moved: {others}. Where that is exact, "
                "such recordings cannot part them, whatever they measure."
            )
    if none:
        yield "Nothing that was tried explains what was held out as well, and nothing could stand for it."


def _form(found: PlantDiagnosis) -> Iterator[str]:
    held, worst = found.final.held_out, found.final.worst
    over = [one for one in held if not one.explained]
    if not found.causes:
        yield "No law was added."
    for cause in found.causes:
        name = capital(words.hypothesis(cause.hypothesis))
        if cause.form == "complete":
            yield f"{name}: complete. With it nothing above the sensors' noise is left over in any signal."
        elif found.selection.curve:
            yield f"{name}: uncertain. {another_law(found.selection.curve, bool(cause.curve))}"
        else:
            yield f"{name}: uncertain. The place is supported, but the law may be another."
    most = f"most in {worst.channel} of {worst.file}: {number(worst.mean_square)} {NOISE}"
    if over:
        yield f"In {len(over)} of {len(held)} signals more than noise is left over, {most}."
    else:
        yield f"In none of {len(held)} signals more than noise is left over; {most}."
    tested = [one for one in held if one.white is not None]
    coloured = sum(not one.white for one in tested)
    if coloured:
        yield (
            f"What is left over is correlated in time in {coloured} of {len(tested)} signals (Ljung–Box "
            "test): something slow is not explained, if only by a little. The intervals allow for it."
        )
    elif tested:
        yield "What is left over is as random as noise in every signal (Ljung–Box test)."


def _everywhere(found: PlantDiagnosis) -> Iterator[str]:
    if not found.groups:
        yield (
            "Not asked: it takes recordings in two groups at least (a load, a pressure, a day) that can be "
            "left out in turn."
            if found.causes
            else "Not asked, for no cause was named."
        )
        return
    bad = [one.group for one in found.groups if not one.holds]
    yield (
        f"Foreseen from the other groups, it explains nothing in {', '.join(bad)}: what is found in its own "
        "groups only is no physics."
        if bad
        else f"Each of {len(found.groups)} groups is foreseen better with it, fitted on the others alone."
    )
    if found.outlying_groups:
        yield (
            f"{', '.join(found.outlying_groups)} fits no law that fits the others: even fitted alone "
            f"much more is "
            "left over there. Look at how it was recorded."
        )


def _groups(found: PlantDiagnosis) -> Iterator[Table]:
    if not found.groups:
        return
    names = list(dict.fromkeys(name for one in found.groups for name, _ in one.amplitudes))
    yield Table(
        "Each group left out, and foreseen from the others",
        ["Group", "Before", "After", "Fitted alone", *names, "Verdict"],
        [
            [
                one.group, number(one.before), number(one.after), number(one.alone),
                *(number(dict(one.amplitudes).get(name)) for name in names),
                "fits no law" if one.group in found.outlying_groups else _holds(one),
            ]
            for one in found.groups
        ],
        [False, *[True] * (3 + len(names)), False],
        note=f"Mean square left over, {NOISE}; alone: with what was found fitted to the group itself. Then "
        "the size of each cause, as the other groups have it: one that differs from group to group is no "
        "constant of the machine.",
    )  # fmt: skip


def _untestable(told: Mapping[str, Any]) -> Iterator[str]:
    names: dict[str, list[str]] = {}
    for one in told["hypotheses"]:
        if one["unidentifiable"]:
            names.setdefault(one["unidentifiable"], []).append(words.at(one["name"], one["where"]))
    for why, those in names.items():
        yield (
            f"{UNTOLD[why]}, so that neither its presence nor its absence is claimed: "  # type: ignore[index]
            f"{'; '.join(dict.fromkeys(those))}."
        )
    if not names:
        yield "Every hypothesis of the catalogue could be tested."


def _finite(values: Floats | None) -> NDArray[np.bool_]:
    return np.isfinite(np.zeros(0) if values is None else values)


def _recordings(found: PlantDiagnosis) -> Iterator[str]:
    if found.judged_on != "validate":
        yield "No recording was held out: on what it was fitted on, any model can be made to look good."
    stretches = len(found.final.by_recording())
    yield f"Judged on {words.samples(found)}." + (
        " That is few: a credibility from so few says little." if stretches < FEW else ""
    )
    missing = {
        one.name: sum(int((~_finite(r.recording.y.get(one.name))).sum()) for r in found.after)
        for one in found.plant.outputs
    }
    lost = [f"{count} of {name}" for name, count in missing.items() if count]
    if lost:
        yield f"Missing samples, which count for nothing: {', '.join(lost)}."
    absent = [
        f"{one.name} in {', '.join(without)}"
        for one in found.plant.outputs
        if (without := [r.recording.file for r in found.after if one.name not in r.recording.y])
    ]
    if absent:
        yield f"Not recorded: {'; '.join(absent)}."


def _holds(fold: GroupFold) -> str:
    return "holds" if fold.holds else "does not hold"
