"""What a diagnosis does not know: what cannot be told apart, what was not asked, where it may be wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from forklift.report import words
from forklift.report.blocks import Block, Points, Section, Table
from forklift.report.words import number, printed

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import Diagnosis


def doubts(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks against the verdict, or limits it."""
    blocks: list[Block] = [
        Points(_alike(found), "Could it be taken for something else?"),
        Points(list(_form(found, told)), "Is the law right?"),
        Points(_regimes(told), "Does it hold everywhere?"),
        Points(_untestable(told), "What these recordings cannot tell"),
        Points([told["deficient"]["after"]["sentence"]], "Is anything left over?"),
    ]
    if found.cautions:
        blocks.append(Points([words.prose(one.sentence) for one in found.cautions], "About these recordings"))
    if told["regimes"]:
        blocks.append(_regime_table(told))
    blocks.append(_tests(told))
    return Section(
        "doubts", "Doubts", "What could be wrong with this verdict, and what it leaves open.", blocks
    )


def _alike(found: Diagnosis) -> list[str]:
    said = [
        f"“{words.capital(words.hypothesis(cause.hypothesis))}” cannot be told from "
        f"{' or '.join(f'“{words.hypothesis(one)}”' for one in cause.not_separable_from)}: they explain the "
        "recordings held out as well."
        for cause in found.causes
        if cause.not_separable_from
    ]
    if said:
        return said
    if not found.causes:
        return ["No cause was named, so that there is none to be taken for another."]
    return ["Nothing that was tried explains the recordings held out as well."]


def _form(found: Diagnosis, told: Mapping[str, Any]) -> Iterator[str]:
    for cause, row in zip(found.causes, told["causes"], strict=True):
        name = words.capital(words.hypothesis(cause.hypothesis))
        if row["form"] == "complete":
            yield f"{name}: complete. With it nothing above the sensors' noise is left over in any signal."
        elif found.final.complete and found.selection.curve:
            yield f"{name}: uncertain. {words.another_law(found.selection.curve, bool(cause.curve))}"
        else:
            yield (
                f"{name}: uncertain. The place is supported, but the final model leaves up to "
                f"{number(told['left_over']['worst_after'])} {words.NOISE} in a signal, or needed a curve "
                "without a name beside it; the law may be another."
            )
    if not found.causes:
        yield "No law was added."


def _regimes(told: Mapping[str, Any]) -> list[str]:
    tested = [one for one in told["regimes"] if one["agree"] is not None]
    bad = [one for one in tested if not one["agree"]]
    if bad:
        return [
            f"{one['parameter']} disagrees across the {one['split']}: {_side(one, 0)}, but {_side(one, 1)} "
            f"(z = {one['z']:.1f})."
            for one in bad
        ]
    if not tested:
        return ["No two parts of these recordings each tell it alone, so that this was not tested."]
    splits = ", ".join(dict.fromkeys(one["split"] for one in tested))
    return [f"Estimated from two disjoint parts of the recordings, its size agrees, split by: {splits}."]


def _side(one: Mapping[str, Any], place: int) -> str:
    side = one["sides"][place]
    return (
        f"{number(side['value'])} ({number(side['lower'])} to {number(side['upper'])}) "
        f"{printed(one['unit'])} from {side['regime']}"
    )


UNTOLD = {
    "one-value": "It shows only between recordings at several oil temperatures, or loads, and these have one",
    "no-trace": "Nothing that these recordings measure answers to it",
    "any-size": "What these recordings measure answers to it so little that it may have any plausible size",
}
"""Why recordings tell nothing of a hypothesis, by `forklift.diagnosis.ledger.Untold`."""


def _untestable(told: Mapping[str, Any]) -> list[str]:
    """One line per reason."""
    names: dict[str, list[str]] = {}
    for one in told["hypotheses"]:
        if one["unidentifiable"]:
            names.setdefault(one["unidentifiable"], []).append(words.at(one["name"], one["where"]))
    if not names:
        return ["Every hypothesis of the catalogue could be tested."]
    return [
        f"{UNTOLD[why]}, so that neither its presence nor its absence is claimed: {'; '.join(those)}."
        for why, those in names.items()
    ]


def _regime_table(told: Mapping[str, Any]) -> Table:
    words_for = {True: "agree", False: "disagree", None: "not told"}
    return Table(
        "The same parameter from two parts of the recordings",
        ["Parameter", "Split by", "One part", "The other", "z", "Verdict"],
        [
            [
                one["parameter"], one["split"], _side(one, 0), _side(one, 1), f"{one['z']:.1f}",
                words_for[one["agree"]],
            ]
            for one in told["regimes"]
        ],
        [False, False, False, False, True, False],
        note="Intervals of 95 %. z is the difference in units of its standard deviation.",
        folded=True,
    )  # fmt: skip


def _tests(told: Mapping[str, Any]) -> Table:
    rows = [(when, test) for when in ("before", "after") for test in told["deficient"][when]["tests"]]
    each = " and ".join(f"{len(told['deficient'][when]['tests'])} {when}" for when in ("before", "after"))
    return Table(
        f"Every test of what is left over: {each}",
        ["Model", "Test", "Signal", "Against", "Statistic", "p", "p, corrected", "Passed"],
        [
            [
                when, test["test"], words.signal(test["channel"]), test["against"], number(test["statistic"]),
                f"{test['p']:.1g}", f"{test['p_corrected']:.1g}", "no" if test["failed"] else "yes",
            ]
            for when, test in rows
        ],
        [False, False, False, False, True, True, True, False],
        note="Of a complete model all pass, but for one time in a hundred. The p-values are corrected for "
        "the number of tests (Holm 1979).",
        folded=True,
    )  # fmt: skip
