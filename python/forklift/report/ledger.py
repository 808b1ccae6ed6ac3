"""Every hypothesis that was considered, with what it promised and what became of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from forklift.report.blocks import Table
from forklift.report.words import at, capital, number

KINDS = {
    "physics": "effect",
    "sensor": "sensor",
    "parameter": "conditions entered",
    "unknown": "curve without a name",
}


def considered(
    told: Mapping[str, Any],
    said: Callable[[str, str], str] = at,
    noun: str = "truck",
    kinds: Mapping[str, str] = KINDS,
) -> Table:
    """The most promising first, those that could not be tested last; `said` of a name and where it acts."""
    count = counts(told)
    return Table(
        f"{count['considered']} hypotheses considered, {count['fitted']} of them fitted, "
        f"{count['unidentifiable']} not testable",
        ["Hypothesis", "Kind", "Promise", "What became of it"],
        [
            [
                capital(said(one["name"], one["where"])), kinds[one["kind"]],
                "—" if one["promised"] is None else number(one["promised"]), _fate(one),
            ]
            for one in told["hypotheses"]
        ],
        [False, False, True, False],
        note="Promise: how far −ln of the probability of all recordings together would fall with it "
        f"and all parameters at their best, by a linear estimate at the fitted {noun}, before any fit. As "
        "long as a cause is missing, others promise some of what it explains; so only those are fitted that "
        "do not fall far behind the best, and fits on recordings held out decide.",
    )  # fmt: skip


def counts(told: Mapping[str, Any]) -> dict[str, int]:
    """How many were considered, screened (by a promise), fitted, and could not be told."""
    hypotheses = told["hypotheses"]
    return {
        "considered": len(hypotheses),
        "fitted": sum(one["fitted"] for one in hypotheses),
        "unidentifiable": sum(bool(one["unidentifiable"]) for one in hypotheses),
    }


def _fate(one: Mapping[str, Any]) -> str:
    if one["fitted"]:
        beside = f", beside {' and '.join(one['beside'])}" if one["beside"] else ""
        left = f"fitted{beside}: leaves {number(one['left_over'])}"
        return f"named; {left}" if one["named"] else left
    if one["named"]:
        return "named before any fit"
    return "not testable" if one["unidentifiable"] else "too little beside the best to be fitted"
