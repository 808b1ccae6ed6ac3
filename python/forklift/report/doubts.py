"""What a diagnosis does not know: what cannot be told apart, what does not hold, where it may be wrong."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import capital, number, printed, prose, size
from forklift.diagnosis.ledger import Untold
from forklift.diagnosis.sentences import beside, doubt, led, remainder, with_it
from forklift.report.answers import ENTERED
from forklift.report.blocks import Block, Points, Section, Table
from forklift.report.entered import each_alone
from forklift.report.instead import ruled_out, said
from forklift.report.judged import judged
from forklift.report.words import NOISE, another_law

if TYPE_CHECKING:
    from forklift.diagnosis.group_validation import GroupFold
    from forklift.diagnosis.result import Diagnosis
    from forklift.plant.findings import Caution
    from forklift.plant.subject import Words

MANY = 4
"""Recordings from which on a caution that they share is spelt out for the first only."""
FEW = 4
"""Stretches below which a credibility says little."""
UNTOLD: Mapping[Untold, str] = {
    "one-value": "It shows only between recordings at several oil temperatures, or loads, and these "
    "have one, as it was "
    "entered or recorded",
    "no-trace": "Nothing that these recordings measure answers to it",
    "any-size": "It would hardly show in these recordings, whatever size it may plausibly have",
}
"""Why recordings tell nothing of a hypothesis."""


def doubts(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks against the verdict, or limits it."""
    blocks: list[Block] = [
        *_of_causes(found, told),
        *_groups(found),
        Points(
            [*_untestable(told, found.machine.words), *_skipped(told, found.machine.words)],
            "What these recordings cannot tell",
        ),
        Points(
            [_spoken(found, told["deficient"]["after"]["sentence"]), *_left(found)], "Is anything left over?"
        ),
        Points(list(_recordings(found)), "About these recordings"),
    ]
    if told["regimes"]:
        blocks.append(_regime_table(told))
    blocks.append(_tests(found, told))
    return Section(
        "doubts", "Doubts", "What could be wrong with this verdict, and what it leaves open.", blocks
    )


def _of_causes(found: Diagnosis, told: Mapping[str, Any]) -> Iterator[Points]:
    """What is asked of causes."""
    none = ["No cause was named."]
    yield Points(list(_alike(found)) if found.causes else none, "Could it be taken for something else?")
    yield Points(list(_form(found, told)) if found.causes else none, "Is the law right?")
    everywhere = [*_regimes(found, told), *_everywhere(found)]
    yield Points(everywhere if found.causes else none, "Does it hold everywhere?")


def _alike(found: Diagnosis) -> Iterator[str]:
    none = True
    for cause in found.causes:
        name = capital(said(found, cause.hypothesis))
        if cause.not_separable_from:
            none = False
            others = " or ".join(f"“{said(found, one)}”" for one in cause.not_separable_from)
            yield f"“{name}” cannot be told from {others}: they explain the recordings as well."
        out = dict(ruled_out(found, cause))
        yield from (f"“{capital(other)}” {told}." for other, told in out.items())
        none = none and not out
        stand = [
            one
            for one in found.confounded
            if one.accepted is cause.hypothesis and said(found, one.other) not in out
        ]
        if stand:
            none = False
            others = ", ".join(f"{said(found, one.other)} ({100 * one.share:.0f} %)" for one in stand)
            yield (
                f"“{name}” has nearly the same effect on these recordings as what follows, which to first "
                f"order takes over so much of it with other parameters moved: {others}. Where that is exact, "
                "such recordings cannot part them, whatever they measure."
            )
    if none:
        none_else = (
            "Nothing else that was fitted explains it as well"
            if any(cause.rivals for cause in found.causes)
            else "Nothing else came near enough to be fitted to its end"
        )
        yield f"{none_else}, and by a linear estimate nothing in the catalogue could stand for it."


def _form(found: Diagnosis, told: Mapping[str, Any]) -> Iterator[str]:
    for cause, row in zip(found.causes, told["causes"], strict=True):
        name = capital(said(found, cause.hypothesis))
        if row["form"] == "complete" and row["kind"] in ENTERED:
            yield f"{name}: this is no part of the machine, and has no law. {capital(with_it(found))}."
        elif row["form"] == "complete":
            yield f"{name}: complete. {with_it(found)}."
        elif doubt(cause):
            yield f"{name}: uncertain. {capital(remainder(found))}, but {doubt(cause)}."
        elif beside(found):
            where = " and ".join(map(found.machine.words.signal, beside(found)))
            nameless = " It has no name." if cause.hypothesis.kind == "unknown" else ""
            yield (
                f"{name}: uncertain.{nameless} Elsewhere nothing is left over; the {where} keeps up to "
                f"{number(told['left_over']['worst_after'])} {NOISE}, with or without it."
            )
        elif found.final.complete and cause.hypothesis.kind == "unknown":
            yield f"{name}: uncertain. It has no name, but with it {remainder(found)}."
        elif found.final.complete and found.selection.curve:
            yield f"{name}: uncertain. {another_law(found.selection.curve, bool(cause.curve))}"
        elif found.final.complete:
            yield f"{name}: uncertain. It needed a curve without a name; the law may be another."
        else:
            yield (
                f"{name}: uncertain. The place is supported, but the final model leaves up to "
                f"{number(told['left_over']['worst_after'])} {NOISE} in a signal; the law may be another."
            )


def _spoken(found: Diagnosis, text: str) -> str:
    """With signals called what the page calls them."""
    for channel in sorted(found.sensors, key=len, reverse=True):
        text = re.sub(rf"(?<!\w){re.escape(channel)}(?!\w)", found.machine.words.signal(channel), text)
    return text


def _left(found: Diagnosis) -> Iterator[str]:
    """How many signals are not explained, and in how many what is left over is correlated."""
    held, worst = found.final.held_out, found.final.worst
    over = [one for one in held if not one.explained]
    signal = found.machine.words.signal
    most = f"most in the {signal(worst.channel)}, {worst.file}: {number(worst.mean_square)} {NOISE}"
    if over:
        yield f"In {len(over)} of {len(held)} signals more than noise is left over, {most}."
    else:
        yield f"In none of {len(held)} signals more than noise is left over; {most}."
    tested = [one for one in held if one.white is not None]
    coloured = [one for one in tested if not one.white]
    if coloured:
        which = f" ({signal(coloured[0].channel)}, {coloured[0].file})" if len(coloured) == 1 else ""
        size_of = "smaller than that noise" if not over else "part of it"
        yield (
            f"What is left over is correlated in time in {len(coloured)}{which} of {len(tested)} signals "
            "that no encoder reads (Ljung–Box test): the sensors' noise may be so itself, or something slow "
            f"is not explained that is {size_of}.{' The intervals allow for it.' if found.causes else ''}"
        )


def _everywhere(found: Diagnosis) -> Iterator[str]:
    """Whether each group of recordings is predicted better with it."""
    if not found.groups:
        if found.causes:
            yield (
                f"Whether it holds beyond these recordings was not asked: no groups of them (each "
                f"{found.machine.part_word}, say, or each day) could be left out in turn."
            )
        return
    asked = [one for one in found.groups if one.asked]
    bad = [one.group for one in asked if one.fails]
    if bad:
        yield (
            f"Predicted from the other groups, it explains nothing in {', '.join(bad)}: what is found in its "
            "own groups only is no physics."
        )
    elif asked:
        yield f"Each of {len(asked)} groups is predicted better with it, fitted on the others alone."
    if len(asked) < len(found.groups):
        untold = " or in ".join(one.group for one in found.groups if not one.asked)
        yield (
            f"Whether it holds in {untold}, foretold from all other recordings, was not asked: these do not "
            "tell the parameters that matter there."
        )
    if found.outlying_groups:
        yield (
            f"{', '.join(found.outlying_groups)} fits no law that fits the others: even fitted alone much "
            "more is left over there. Look at how it was recorded."
        )


def _groups(found: Diagnosis) -> Iterator[Table]:
    if not any(one.asked for one in found.groups):
        return
    names = list(dict.fromkeys(name for one in found.groups for name, _ in one.amplitudes))
    yield Table(
        "Each group left out, and predicted from the others",
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


def _holds(fold: GroupFold) -> str:
    return "not asked" if not fold.asked else "holds" if fold.holds else "does not hold"


def _recordings(found: Diagnosis) -> Iterator[str]:
    if found.judged_on != "validate":
        yield "No recording was held out: on what it was fitted on, any model can be made to look good."
    few = len(found.final.by_recording()) < FEW
    yield f"Judged on {judged(found)}." + (
        " That is few: a credibility from so few says little." if few else ""
    )
    if led(found):
        yield f"{capital(led(found))}."
    yield from _cautions(found.findings.cautions)


def _cautions(cautions: Sequence[Caution]) -> Iterator[str]:
    """A caution that many recordings share is spelt out once; a file keeps its small letter."""
    alike: dict[str, list[Caution]] = {}
    for one in cautions:
        alike.setdefault(one.code if "file" in one.facts else one.sentence, []).append(one)
    for those in alike.values():
        spelt = those if len(those) < MANY else those[:1]
        for one in spelt:
            named = one.sentence.startswith(str(one.facts.get("file", "\n")))
            yield one.sentence[0] + prose(one.sentence)[1:] if named else prose(one.sentence)
        if len(spelt) < len(those):
            more = ", ".join(dict.fromkeys(str(one.facts["file"]) for one in those[1:]))
            yield f"The same, with other numbers, in: {more}."


def _regimes(found: Diagnosis, told: Mapping[str, Any]) -> list[str]:
    tested = [one for one in told["regimes"] if one["agree"] is not None]
    bad = [one for one in tested if not one["agree"]]
    if bad:
        return [
            f"{one['parameter']} disagrees across the {one['split']}: {_side(one, 0)}, but {_side(one, 1)} "
            f"(z = {one['z']:.1f})."
            for one in bad
        ]
    said_apart = [line for cause in found.causes for line in each_alone(found, cause)]
    if not tested:
        rest = any(cause.hypothesis.kind != "parameter" for cause in found.causes)
        untested = "No two parts of these recordings each tell it alone, so that this was not tested."
        return [*said_apart, *([untested] if rest else [])]
    each: dict[str, list[str]] = {}
    for one in tested:
        each.setdefault(one["parameter"], []).append(one["split"])
    return [
        *(
            f"Estimated from two disjoint parts of the recordings, {name} agrees, split by: "
            f"{', '.join(dict.fromkeys(splits))}."
            for name, splits in each.items()
        ),
        *said_apart,
    ]


def _side(one: Mapping[str, Any], place: int) -> str:
    side = one["sides"][place]
    value, lower, upper = size(side["value"], side["lower"], side["upper"])
    unit = printed(one["unit"])
    return f"{value} ({lower} to {upper}){f' {unit}' if unit not in ('', '1') else ''} from {side['regime']}"


def _untestable(told: Mapping[str, Any], words: Words) -> list[str]:
    """One line per reason."""
    names: dict[str, list[str]] = {}
    for one in told["hypotheses"]:
        if one["unidentifiable"] and not (one["fitted"] or one["given_up"] or one["named"]):
            names.setdefault(one["unidentifiable"], []).append(words.at(one["name"], one["where"]))
    if not names:
        return ["Every hypothesis of the catalogue could be tested."]
    return [
        f"{UNTOLD[why]}, so that it may or may not be there: "  # type: ignore[index]
        f"{'; '.join(dict.fromkeys(those))}."
        for why, those in names.items()
    ]


def _skipped(told: Mapping[str, Any], words: Words) -> list[str]:
    """What would have been tried, if the work of a diagnosis had lasted."""
    names = [words.at(one["name"], one["where"]) for one in told["hypotheses"] if one["skipped"]]
    return [f"Not tried, as the work that a diagnosis may do was spent: {'; '.join(names)}."] if names else []


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


def _tests(found: Diagnosis, told: Mapping[str, Any]) -> Table:
    words = found.machine.words
    times = ("before", "after") if found.final.hypotheses else ("after",)
    rows = [(when, test) for when in times for test in told["deficient"][when]["tests"]]
    each = " and ".join(f"{len(told['deficient'][when]['tests'])} {when}" for when in times)
    each = each if len(times) > 1 else each.removesuffix(" after")
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
