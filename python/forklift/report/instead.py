"""What could be taken for what was found: what explains as much, places that tie, names that stand for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import capital, number
from forklift.diagnosis import sentences
from forklift.diagnosis.criteria import AS_GOOD
from forklift.report.blocks import Fact
from forklift.report.ledger import counts
from forklift.report.words import NOISE

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.result import Diagnosis
    from forklift.plant.protocol import Hypothesis

LIKE = 3
"""How many names of what could stand for a cause are told here; all are in Doubts."""


def said(found: Diagnosis, one: Hypothesis) -> str:
    """A hypothesis with where it acts."""
    return found.machine.words.at(one.name, one.where)


def instead(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    question = "What could it be instead?"
    first = next((alike for cause in found.causes if (alike := as_good(found, cause))), [])
    open_ = untold(counts(told))
    if first:
        return Fact(
            question,
            f"{capital(some(first, quoted=False))}: these recordings cannot tell.",
            ["These explain the recordings as well, and are not ruled out.", *open_],
        )
    places = [place for cause in found.causes for place in sentences.as_well(found, cause)]
    if places:
        return Fact(
            question,
            f"The same, acting on {some(places, quoted=False)}.",
            [
                "By a linear estimate it does as much to these recordings there: "
                "they cannot part the places.",
                *open_,
            ],
        )
    rivals = sorted(
        (
            (left, share, names)
            for cause in found.causes
            for names, share, left in cause.rivals
            if not set(names) <= set(found.final.hypotheses)
            and said(found, cause.hypothesis) not in [said(found, one) for one in names]  # the cause and more
        ),
        key=lambda one: one[0],
    )
    if not rivals:
        count = counts(told)
        none = (
            "Nothing else is needed."
            if told["verdict"] == "no-mismatch"
            else "Nothing that was begun came near it."
            if count["given_up"]
            else "Nothing that was tried comes near it."
            if not found.unexplained and _made_up_for(told)
            else "Nothing else comes near it, by a linear estimate."
            if not found.unexplained
            else "Nothing that was tried explains it."
        )
        near = [*_given_up(found, told), *_runner_up(found, told)] if found.causes else []
        return Fact(question, none, [*near, *open_])
    alone = [
        f"The same by the catalogue's law alone leaves {number(cause.alone)} on average: its law is in "
        "doubt, not its place."
        for cause in found.causes
        if cause.alone is not None
    ]
    left, share, names = rivals[0]
    nearest = " and ".join(said(found, one) for one in names) or "nothing added"
    return Fact(
        question,
        "Nothing that was tried explains it as well.",
        [
            f"Nearest: {nearest}. On average over all signals it leaves {number(left)} {NOISE}, "
            "where what was "
            f"found leaves {number(found.final.reduced_chi2)}; its credibility is {share:.2f}.",
            *alone,
            *open_,
        ],
    )


def as_good(found: Diagnosis, cause: Cause) -> list[str]:
    """What explains what was held out as well as a cause."""
    return list(dict.fromkeys(said(found, one) for one in cause.not_separable_from))


def standing(found: Diagnosis, cause: Cause) -> list[str]:
    """What could stand for a cause on such recordings, to first order."""
    other = (said(found, one.other) for one in found.confounded if one.accepted is cause.hypothesis)
    return [name for name in dict.fromkeys(other) if name not in as_good(found, cause)]


def ruled_out(found: Diagnosis, cause: Cause) -> Iterator[tuple[str, str]]:
    """What could stand for a cause to first order, but was fitted and explains less: what it came to."""
    alike = {one.label for one in cause.not_separable_from}
    for one in found.confounded:
        if one.accepted is not cause.hypothesis or one.other.label in alike:
            continue
        fitted = [
            (left, share)
            for names, share, left in cause.rivals
            if one.other.label in {name.label for name in names}
            and cause.hypothesis.label not in {name.label for name in names}
        ]
        if fitted and max(share for _, share in fitted) < AS_GOOD:
            left = min(left for left, _ in fitted)
            yield (
                said(found, one.other),
                f"imitates {100.0 * one.share:.0f} % of it by a linear estimate, but fitted in its place it "
                f"leaves {number(left)} on average over all signals, where this leaves "
                f"{number(_in_its_round(found, cause))}: it is ruled out",
            )


def _in_its_round(found: Diagnosis, cause: Cause) -> float:
    """What was left over when the cause was found, which is what its rivals were held against."""
    rounds = (step.accepted for step in found.selection.steps if step.accepted is not None)
    own = (one for one in rounds if cause.hypothesis.label in {name.label for name in one.hypotheses})
    return next(own, found.final).reduced_chi2


def some(names: Sequence[str], *, quoted: bool = True, between: str = " or ") -> str:
    names = list(dict.fromkeys(names))
    more = f" and {len(names) - LIKE} more" if len(names) > LIKE else ""
    return between.join(f"“{name}”" if quoted else name for name in names[:LIKE]) + more


def _given_up(found: Diagnosis, told: Mapping[str, Any]) -> list[str]:
    """What was begun and fell far behind."""
    at = found.machine.words.at
    each = [one for one in told["hypotheses"] if one["given_up"]]
    names = [at(one["name"], one["where"]) for one in each]
    left = [one["left_over"] for one in each if one["left_over"] is not None]
    alone = found.baseline.reduced_chi2
    best = (
        ""
        if not left
        else f" (no better than nothing added when stopped: {number(min(left))} on average)"
        if min(left) >= alone
        else f" (the best was left with {number(min(left))} on average)"
    )
    return [f"Begun, and given up far behind{best}: {some(names, between=', ')}."] if names else []


def _next(told: Mapping[str, Any]) -> tuple[Mapping[str, Any], float] | None:
    """What promised most of what was not even begun, and how much of what was found."""
    named = max((one["promised"] or 0.0 for one in told["hypotheses"] if one["named"]), default=0.0)
    other = next(
        (
            one
            for one in told["hypotheses"]
            if not (one["named"] or one["fitted"] or one["given_up"] or one["unidentifiable"])
        ),
        None,
    )
    return (other, (other["promised"] or 0.0) / named) if other and named else None


def _made_up_for(told: Mapping[str, Any]) -> bool:
    """Whether what was found promised less than others: the machine's parameters had made up for it."""
    following = _next(told)
    return following is not None and following[1] > 1.0


def _runner_up(found: Diagnosis, told: Mapping[str, Any]) -> list[str]:
    following = _next(told)
    if following is None:
        return []
    other, share = following
    words = found.machine.words
    best = f"Next best, and not tried: {words.at(other['name'], other['where'])}."
    if _made_up_for(told):
        return [
            f"{best} No linear estimate compares them: the {words.noun}'s parameters had made up for what "
            "was found, so that such a step promised little of it (list below)."
        ]
    return [f"{best} By a linear estimate it could explain {100.0 * share:.0f} % as much (list below)."]


def untold(count: Mapping[str, int]) -> list[str]:
    others = count["unidentifiable"]
    plural = "hypotheses" if others > 1 else "hypothesis"
    return [f"{others} {plural} could not be tested with these recordings: see Doubts."] if others else []
