"""The first answers of a page where no cause was named: what was seen, and how sure that is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import amount, number, prose
from forklift.fitting.clocks import CLOCKS_APART
from forklift.fitting.criteria import AT_NOISE
from forklift.report.blocks import Fact
from forklift.report.instead import said
from forklift.report.judged import judged
from forklift.report.ledger import considered_of, counts
from forklift.report.words import NOISE

if TYPE_CHECKING:
    from forklift.diagnosis.result import Diagnosis


def unexcited(found: Diagnosis, told: Mapping[str, Any]) -> list[Fact]:
    """Where nothing moves, nothing can be told, and it is no good news."""
    return [
        Fact("What is wrong?", "It cannot be told.", [prose(found.findings.unexcited)]),
        Fact(
            "What could it be?",
            f"Any of {len(told['untestable'])} hypotheses, or nothing",
            ["These recordings tell nothing of any of them: see Doubts."],
        ),
        Fact(
            "What to record next?",
            "Recordings in which something moves.",
            ["At several commands, speeds and operating points."],
        ),
    ]


def nothing(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    worst = told["left_over"]["worst_before"]
    if told["verdict"] == "no-mismatch":
        return Fact(
            "What is wrong?",
            "Nothing that these recordings show.",
            [
                f"With its parameters fitted, the {found.machine.words.noun} explains {judged(found)}. At "
                f"worst one signal is left with {number(worst)} {NOISE}; up to about {AT_NOISE:g} of a whole "
                "signal is taken for noise.",
                *(one.sentence for one in found.findings.cautions if one.code == CLOCKS_APART),
                *_farthest(found),
            ],
        )
    if found.doubted:
        names = [
            f"“{said(found, one.hypothesis)}” (credibility {one.credibility:.2f})" for one in found.doubted
        ]
        return Fact(
            "What is wrong?",
            "Something that several explanations fit about as well.",
            [f"None is more likely than all others together: {', '.join(names)}."],
        )
    return Fact(
        "What is wrong?",
        "Something that has no name yet.",
        [
            "No effect of the catalogue, no sensor, no input and no condition entered wrongly explains the "
            "difference."
        ],
    )


def _farthest(found: Diagnosis) -> Iterator[str]:
    """Which parameter lies farthest from where the fit began: what a fit takes up, no test can show."""
    known = [one for one in found.numbers if one.identifiable]
    reach = {
        one.name: abs(theta)
        for one, theta in zip(found.numbers, found.final.found.x.tolist(), strict=False)
        if one.identifiable
    }
    far = max(known, key=lambda one: reach[one.name], default=None)
    if far is not None:
        yield (
            "A change that its parameters can follow is fitted with them. The farthest from where they began "
            f"is {far.name}: {amount(far.value, far.unit)}, from {amount(far.start, far.unit)}."
        )


def _but(found: Diagnosis) -> str:
    """In how many signals it is correlated in time, which no test of all of them together shows."""
    white = [one.white for one in found.final.held_out if one.white is not None]
    coloured = len(white) - sum(white)
    return f" (but for {coloured} of {len(white)} signals: see Doubts)" if coloured else ""


def tested(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    """How sure one may be that nothing is amiss, or that something is."""
    tests, count = told["deficient"]["after"]["tests"], counts(told)
    failed = sum(test["failed"] for test in tests)
    screened = f"{considered_of(count)} (list below)."
    if not failed:
        return Fact(
            "How sure is that?",
            f"All {len(tests)} tests pass",
            [
                f"What is left over has the size of the sensors' noise, is as random{_but(found)}, and "
                "depends on nothing that was measured. A complete model passes all of them 99 times in 100.",
                screened,
            ],
        )
    explained = told["verdict"] == "no-mismatch"
    size = "What is left over has the size of the noise" if explained else "More than noise is left over"
    return Fact(
        "How sure is that?",
        f"{size}; {failed} of {len(tests)} tests of its randomness fail" if explained else size,
        [
            f"{'The verdict rests on its size' if explained else f'{failed} of {len(tests)} tests fail'}. "
            "The tests also ask whether it is as random as white noise, and depends on nothing that was "
            "measured: see Doubts. "
            + (
                "That some fail means that the sensors' noise is not white, or that something is missing "
                "whose effect is smaller than the noise."
                if explained
                else "A complete model passes all of them 99 times in 100."
            ),
            screened,
        ],
    )
