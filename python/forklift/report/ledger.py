"""Every hypothesis that was considered, with its predicted gain and what became of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from forklift.report.blocks import Table
from forklift.report.words import capital, number

if TYPE_CHECKING:
    from forklift.plant.subject import Words


def considered(told: Mapping[str, Any], words: Words) -> Table:
    """The greatest predicted gain first, those that could not be tested last."""
    count = counts(told)
    return Table(
        f"{considered_of(count)}, {count['unidentifiable']} not testable",
        ["Hypothesis", "Kind", "Predicted gain", "What became of it"],
        [
            [
                capital(words.at(one["name"], one["where"])), words.kinds[one["kind"]],
                "—" if one["promised"] is None else number(one["promised"]), _fate(one),
            ]
            for one in told["hypotheses"]
        ],
        [False, False, True, False],
        note="Predicted gain: how far −ln of the probability of all recordings together would fall with it "
        f"and all parameters at their best, by a linear estimate at the fitted {words.noun}, before any fit. "
        "As long as a cause is missing, others are predicted to gain by some of what it explains; so only "
        "those are fitted that do not fall far behind the best, and fits on recordings held out decide.",
    )  # fmt: skip


def counts(told: Mapping[str, Any]) -> dict[str, int]:
    """How many were considered, fitted to their end, begun and given up, and could not be told."""
    hypotheses = told["hypotheses"]
    return {
        "considered": len(hypotheses),
        "fitted": sum(one["fitted"] for one in hypotheses),
        "given_up": sum(one["given_up"] for one in hypotheses),
        "unidentifiable": sum(bool(one["unidentifiable"]) for one in hypotheses),
    }


def considered_of(count: Mapping[str, int]) -> str:
    """How many were considered, and how many of them fitted, in words."""
    given_up = f", {count['given_up']} begun and given up" if count["given_up"] else ""
    fitted = count["fitted"] or "none"
    return f"{count['considered']} hypotheses considered, {fitted} of them fitted{given_up}"


def _fate(one: Mapping[str, Any]) -> str:
    if one["fitted"]:
        beside = f", beside {' and '.join(one['beside'])}" if one["beside"] else ""
        left = f"fitted{beside}: leaves {number(one['left_over'])}"
        return f"named; {left}" if one["named"] else left
    if one["named"]:
        return "named before any fit"
    if one["given_up"]:
        return "begun and given up: it fell far behind"
    if one["skipped"]:
        return "not tried: the work that a diagnosis may do was spent"
    return "not testable" if one["unidentifiable"] else "not fitted: its predicted gain is far behind"
