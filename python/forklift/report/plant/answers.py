"""The first screen of a plant's diagnosis: what a reader asks first, each answered in a few words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.diagnosis.criteria import REDRAWS
from forklift.diagnosis.next_recording import PARTS
from forklift.diagnosis.plant_files import LIKELY
from forklift.fitting.residuals import AT_NOISE
from forklift.report.blocks import Fact
from forklift.report.ledger import counts
from forklift.report.plant import words
from forklift.report.words import NOISE, capital, number, printed

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis

TELLING = 0.2
"""A variable is worth naming if the input is this much a function of it."""
LIKE = 3
"""How many names of what could stand for a cause are told here; all are in Doubts."""


def answers(found: PlantDiagnosis, told: Mapping[str, Any]) -> list[Fact]:
    """What is wrong, where, how sure, by how much better, what else it could be, what to record next."""
    where = [_where(found)] if found.inputs or found.causes else []
    return [
        _what(found, told),
        *where,
        _sure(found, told),
        _better(found),
        _else(found, told),
        _next(found, told),
    ]


def _what(found: PlantDiagnosis, told: Mapping[str, Any]) -> Fact:
    if not found.causes:
        if found.verdict == "no-mismatch":
            return Fact(
                "What is wrong?",
                "Nothing that these recordings show.",
                [
                    f"With its parameters fitted, the model explains {words.samples(found)}. At worst one "
                    f"signal is left with {number(found.final.worst.mean_square)} {NOISE}; up to about "
                    f"{AT_NOISE:g} counts as explained."
                ],
            )
        return Fact(
            "What is wrong?",
            "Something that has no name here.",
            ["No effect of the catalogue, no sensor, no input and no doubtful parameter explains it."],
        )
    first, *others = found.causes
    sized = [f"Size: {'; '.join(own)}." for own in [[*words.sizes(told, first.hypothesis)]] if own]
    if first.hypothesis.kind == "unknown":
        sized = ["It has no name in the catalogue; its curve is drawn below."]
    for cause in others:
        size = "; ".join(words.sizes(told, cause.hypothesis))
        sized.append(
            f"And {_perhaps(cause)}{words.hypothesis(cause.hypothesis)}{f': {size}' if size else ''}."
        )
    return Fact(
        "What is wrong, and how much?",
        capital(f"{_perhaps(first)}{words.hypothesis(first.hypothesis)}"),
        sized,
    )


def _perhaps(cause: Cause) -> str:
    return "" if cause.credibility >= LIKELY else "perhaps "


def _where(found: PlantDiagnosis) -> Fact:
    plant = found.plant
    named = dict.fromkeys(name for cause in found.causes for name in words.ports(plant, cause.hypothesis))
    first = next(iter(named), found.inputs[0].port if found.inputs else "")
    details = []
    if found.inputs:
        best = found.inputs[0]
        others = [one for one in found.inputs[1:] if best.evidence - one.evidence < 5.0]
        doubt = f" ({' or '.join(one.port for one in others[:LIKE])} would explain as much)" if others else ""
        telling = [one for one in found.shapes[:1] if one.explained >= TELLING]
        details.append(
            f"Found without knowing any cause: an unknown input explains most at "
            f"{words.place(plant, best.port)}{doubt}"
            + "".join(
                f"; {100 * one.explained:.0f} % of it is a function of {one.variable}" for one in telling
            )
            + (". " if telling else ", but no variable tells it. ").rstrip()
        )
    further = [words.place(plant, name) for name in list(named)[1:]]
    if further:
        details.insert(0, f"And at {'; '.join(further)}.")
    return Fact("Where?", f"At {words.place(plant, first)}", details)


def _sure(found: PlantDiagnosis, told: Mapping[str, Any]) -> Fact:
    question, count = "How sure is that?", counts(told)
    if not found.causes:
        left = [one for one in found.final.held_out if not one.explained]
        if not left:
            return Fact(
                question,
                f"All {len(found.final.held_out)} signals of recordings held out are explained",
                [
                    f"{count['considered']} hypotheses were screened, and none promises more than chance.",
                    *_untold(count),
                ],
            )
        return Fact(
            question,
            f"{len(left)} of {len(found.final.held_out)} signals of recordings held out are not explained",
            [
                f"Of {count['considered']} hypotheses considered (list below), {count['fitted']} were "
                f"fitted; "
                "none makes what was held out better.",
                *_untold(count),
            ],
        )
    first, *others = found.causes
    alike = _alike(first)
    answer = (
        f"Not sure: it cannot be told from {_some(alike)}"
        if alike
        else f"Credibility {first.credibility:.2f} of 1{', for the first' if others else ''}"
    )
    details = [f"Credibility {first.credibility:.2f} of 1."] if alike else []
    stands = _stands(found, first)
    details += [f"To first order {_some(stands)} could stand for it: see Doubts."] if stands else []
    details += [
        f"{capital(words.hypothesis(cause.hypothesis))}: credibility {cause.credibility:.2f}"
        f"{_doubted(found, cause)}."
        for cause in others
    ]
    details += [
        f"Of {count['considered']} hypotheses considered (list below), {count['fitted']} "
        f"{'was' if count['fitted'] == 1 else 'were'} fitted. Judged on "
        f"{words.samples(found)}, redrawn at "
        f"random {REDRAWS} times.",
        "Nothing but the sensors' noise is left over"
        f"{', but the law is uncertain: see Doubts' if found.selection.curve else ''}."
        if found.final.complete
        else "The law is uncertain: more than the sensors' noise is left over.",
        *_groups(found),
    ]
    return Fact(question, answer, details)


def _groups(found: PlantDiagnosis) -> list[str]:
    """What speaks against it where whole groups were left out."""
    bad = [one.group for one in found.groups if not one.holds]
    said = [f"It does not hold in {', '.join(bad)}, foreseen from the others: see Doubts."] if bad else []
    if found.outlying_groups:
        said.append(f"{', '.join(found.outlying_groups)} fits no law that fits the others: see Doubts.")
    return said


def _untold(count: Mapping[str, int]) -> list[str]:
    unidentifiable = count["unidentifiable"]
    return (
        [f"{unidentifiable} could not be tested with these recordings: see Doubts."] if unidentifiable else []
    )


def _alike(cause: Cause) -> list[str]:
    """What explains what was held out as well as a cause."""
    return list(dict.fromkeys(map(words.hypothesis, cause.not_separable_from)))


def _stands(found: PlantDiagnosis, cause: Cause) -> list[str]:
    """What could stand for a cause on such recordings, to first order."""
    confounded = (words.hypothesis(one.other) for one in found.confounded if one.accepted is cause.hypothesis)
    return [name for name in dict.fromkeys(confounded) if name not in _alike(cause)]


def _doubted(found: PlantDiagnosis, cause: Cause) -> str:
    """The same as the end of a sentence."""
    alike, stands = _alike(cause), _stands(found, cause)
    said = f"; it cannot be told from {_some(alike)}" if alike else ""
    return said + (f"; to first order {_some(stands)} could stand for it" if stands else "")


def _some(names: list[str]) -> str:
    more = f" and {len(names) - LIKE} more" if len(names) > LIKE else ""
    return " or ".join(f"“{name}”" for name in names[:LIKE]) + more


def _better(found: PlantDiagnosis) -> Fact:
    question = "How much better does the model get?"
    judged = words.samples(found)
    errors = list(_errors(found))
    if not found.final.hypotheses:
        answer = "There is nothing to gain." if found.verdict == "no-mismatch" else "Nothing was added."
        said = ", ".join(
            f"{name} {number(after)} {printed(unit)}".rstrip() for name, unit, _, after in errors
        )
        return Fact(question, answer, [f"Root mean square error, {judged}: {said}."])
    first, *others = [f"{name} {words.change(before, after, unit)}" for name, unit, before, after in errors]
    own = [one for one in found.scores if one.role == found.judged_on]
    better = sum(one.rmse_after < one.rmse_before for one in own)
    return Fact(
        question,
        f"Error of {first}",
        [
            *([f"Error of {'; '.join(others)}."] if others else []),
            f"Root mean square, {judged}; smaller in {better} of {len(own)} signals held out.",
            f"What is left over falls from {number(found.baseline.reduced_chi2)} to "
            f"{number(found.final.reduced_chi2)} {NOISE}.",
        ],
    )


def _errors(found: PlantDiagnosis) -> Iterator[tuple[str, str, float, float]]:
    """By output: name, unit, and the root mean square error before and after over what was held out."""
    for one in found.plant.outputs:
        own = [s for s in found.scores if s.output == one.name and s.role == found.judged_on]
        if own:
            weight = [s.samples for s in own]
            before = np.sqrt(np.average([s.rmse_before**2 for s in own], weights=weight))
            after = np.sqrt(np.average([s.rmse_after**2 for s in own], weights=weight))
            yield one.name, one.unit, float(before), float(after)


def _else(found: PlantDiagnosis, told: Mapping[str, Any]) -> Fact:
    question = "What could it be instead?"
    first = next(map(_alike, found.causes), [])
    later = [
        f"{capital(words.hypothesis(cause.hypothesis))} could be {_some(like)}."
        for cause in found.causes
        if (like := [*(_alike(cause) if cause is not found.causes[0] else []), *_stands(found, cause)])
    ]
    if first:
        return Fact(
            question,
            f"{_some(first)}: these recordings cannot tell.",
            [*later, "These explain what was held out as well, and are not ruled out."],
        )
    rivals = [
        (left, share, names)
        for cause in found.causes
        for names, share, left in cause.rivals
        if not set(names) <= set(found.final.hypotheses) and cause.hypothesis not in names
    ]
    unidentifiable = [*later, *_untold(counts(told))]
    if not rivals:
        none = (
            "Nothing else was needed."
            if found.verdict == "no-mismatch"
            else "Nothing else that could be tested."
        )
        return Fact(question, none, unidentifiable)
    left, share, names = min(rivals, key=lambda one: one[0])
    nearest = " and ".join(map(words.hypothesis, names)) or "nothing added"
    return Fact(
        question,
        "Nothing that was tried explains it as well.",
        [
            f"Nearest: {nearest}, which leaves {number(left)} {NOISE}, with a credibility of {share:.2f}.",
            *unidentifiable,
        ],
    )


def _next(found: PlantDiagnosis, told: Mapping[str, Any]) -> Fact:
    question, proposed = "What to record next?", found.next_recording
    if proposed is not None and proposed.candidate is not None:
        parted = sum(one.expected >= PARTS for one in proposed.partings)
        pairs = f"{parted} of {len(proposed.partings)} pairs"
        return Fact(
            question,
            capital(proposed.candidate.name),
            [f"Of the candidates it parts most of what is in question, {pairs}: see Next steps."],
        )
    if proposed is not None:
        return Fact(question, "None of the candidates would settle it.", ["See Next steps."])
    if not found.causes:
        if found.verdict == "no-mismatch":
            return Fact(question, "Nothing more is needed.", _untold(counts(told)))
        telling = next((one.variable for one in found.shapes if one.explained >= TELLING), None)
        return Fact(
            question,
            f"More of {telling}, over a wider range." if telling else "Nothing can be proposed.",
            ["And give the catalogue an effect that may act there: see Next steps."],
        )
    doubtful = not found.final.complete or any(map(_alike, found.causes))
    return Fact(
        question,
        "Candidates would be needed." if doubtful else "Nothing more is needed for this cause.",
        [
            "With recordings that could be made, the diagnosis names the one that parts best: see Next steps."
            if doubtful
            else "No other explanation came near it. What no recording covers (other ranges, the other "
            "direction) stays untested."
        ],
    )
