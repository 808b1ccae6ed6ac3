"""Every hypothesis that was considered, with its predicted gain and what became of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import drawn
from forklift.report.blocks import Table
from forklift.report.words import capital, number

if TYPE_CHECKING:
    from forklift.plant.subject import Words


def considered(told: Mapping[str, Any], words: Words) -> Table:
    """The greatest predicted gain first, those that could not be tested last."""
    count = counts(told)
    nothing = told["verdict"] == "no-mismatch"
    return Table(
        considered_of(count),
        ["Hypothesis", "Kind", "Predicted gain", *["Tried from"] * nothing, "What became of it"],
        [
            [
                capital(words.at(one["name"], one["where"])), words.kinds[one["kind"]],
                "—" if one["promised"] is None else number(one["promised"]),
                *[_tried_from(one)] * nothing, _fate(one, told),
            ]
            for one in told["hypotheses"]
        ],
        [False, False, True, *[True] * nothing, False],
        note="Predicted gain: how far −ln of the probability of all recordings together would fall with it "
        f"and all parameters at their best, by a linear estimate at the fitted {words.noun}, before any fit. "
        "As long as a cause is missing, others are predicted to gain by some of what it explains; so only "
        "those are fitted that do not fall far behind the best, and fits on recordings held out decide. "
        "Numbers compare within one round: where one cause was found and something was left over, the next "
        "round began from the model with it. Where even then something was left over, effects that act at "
        "the same place were tried as well, little as was predicted of them."
        + (
            " Tried from: the size, of the number that is zero without it, at which it would be predicted to "
            "gain enough to be tried where nothing is left over, by the same estimate. What is smaller is "
            "not seen in these recordings; what is larger is fitted, and decided on recordings held out."
            if nothing
            else ""
        ),
    )  # fmt: skip


def counts(told: Mapping[str, Any]) -> dict[str, int]:
    """How many were considered, fitted to their end, begun and given up, could not be told, and were seen
    before any fit."""
    hypotheses = told["hypotheses"]
    return {
        "considered": len(hypotheses),
        "fitted": sum(one["fitted"] for one in hypotheses),
        "given_up": sum(one["given_up"] for one in hypotheses),
        "unidentifiable": sum(
            bool(one["unidentifiable"]) and not (one["fitted"] or one["given_up"] or one["named"])
            for one in hypotheses
        ),
        "seen": sum(one["named"] and not (one["fitted"] or one["given_up"]) for one in hypotheses),
    }


def considered_of(count: Mapping[str, int]) -> str:
    """How many were considered, and what became of them, in words."""
    given_up = f", {count['given_up']} begun and given up" if count["given_up"] else ""
    untried = count["considered"] - sum(count[of] for of in ("fitted", "given_up", "unidentifiable", "seen"))
    untested = f", {count['unidentifiable']} not testable" if count["unidentifiable"] else ""
    return (
        f"{count['considered']} hypotheses considered: {count['fitted'] or 'none'} fitted{given_up}, "
        f"{untried} not tried{untested}"
    )


def _tried_from(one: Mapping[str, Any]) -> str:
    least = one["tried_from"]
    if not least:
        return "—"
    unit, factor = drawn(least["unit"])
    return f"{number(factor * least['value'], 2)} {unit}".rstrip()


def _fate(one: Mapping[str, Any], told: Mapping[str, Any]) -> str:
    if one["fitted"]:
        beside = f", beside {' and '.join(one['beside'])}" if one["beside"] else ""
        left = f"fitted{beside}: leaves {number(one['left_over'])}"
        return f"named; {left}" if one["named"] else left
    if one["named"]:
        return "named before any fit"
    if one["given_up"]:
        tried = max((row["promised"] or 0.0 for row in told["hypotheses"] if _untried(row)), default=0.0)
        why = "tried, as it acts at the same place" if (one["promised"] or 0.0) < tried else "begun"
        return f"{why}, and given up: it fell far behind"
    if one["skipped"]:
        return "not tried: the work that a diagnosis may do was spent"
    if one["unidentifiable"]:
        return "not testable"
    if told["verdict"] == "no-mismatch":
        least = one["tried_from"]
        if least and one["promised"] < least["promised"]:
            return f"not tried: less than the {number(least['promised'])} asked of its kind"
        return "not tried: nothing is left over for it"
    return "not tried: its predicted gain is far behind that of what was found"


def _untried(one: Mapping[str, Any]) -> bool:
    return not any(one[of] for of in ("fitted", "named", "given_up", "skipped", "unidentifiable"))
