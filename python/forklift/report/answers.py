"""The first screen of a diagnosis: what a reader asks first, each answered in a few words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forklift import operation
from forklift.diagnosis_files import TELLING
from forklift.estimation.judgement import AT_NOISE
from forklift.report import words
from forklift.report.blocks import Fact

if TYPE_CHECKING:
    from forklift.diagnose import Diagnosis
    from forklift.diagnosis.causes import Cause


def answers(found: Diagnosis, told: Mapping[str, Any]) -> list[Fact]:
    """What is wrong, where, how sure, how much, what it improves, what else it could be, what to do next."""
    what = [] if found.causes else [_nothing(found, told), _tested(told)]
    for cause, row in zip(found.causes, told["causes"], strict=True):
        what += [_what(cause, row), _sure(cause, row)]
    where = [_where(told)] if told["location"] else []
    return [*what[:1], *where, *what[1:], _better(found, told), _else(found, told), _next(told)]


def _nothing(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    judged = len({one.file for one in found.final.held_out})
    worst = told["left_over"]["worst_before"]
    if found.unexcited:
        return Fact("What is wrong?", "It cannot be told.", [found.unexcited])
    if told["verdict"] == "no-mismatch":
        return Fact(
            "What is wrong?",
            "Nothing that these recordings show.",
            [
                f"With its parameters fitted, the truck explains all {judged} recordings that it was not "
                f"fitted on. At worst one signal is left with {words.number(worst)} {words.NOISE}; up to "
                f"about {AT_NOISE:g} counts as explained."
            ],
        )
    return Fact(
        "What is wrong?",
        "Something that has no name yet.",
        ["No effect of the catalogue, no sensor and no condition entered wrongly explains the difference."],
    )


def _tested(told: Mapping[str, Any]) -> Fact:
    """How sure one may be that nothing is amiss, or that something is."""
    tests = told["deficient"]["after"]["tests"]
    failed = sum(test["failed"] for test in tests)
    if not failed:
        return Fact(
            "How sure is that?",
            f"All {len(tests)} tests pass",
            [
                "What is left over has the size of the sensors' noise, is as random, and depends on nothing "
                "that was measured. A complete model passes all of them 99 times in 100."
            ],
        )
    return Fact(
        "How sure is that?",
        f"{failed} of {len(tests)} tests fail",
        ["They ask whether what is left over is noise alone: see Doubts. A complete model passes all of them "
         "99 times in 100."],
    )  # fmt: skip


def _what(cause: Cause, row: Mapping[str, Any]) -> Fact:
    sizes = []
    for one in row["parameters"][:1]:
        value, lower, upper = words.size(one["value"], one["lower"], one["upper"])
        unit = words.printed(one["unit"])
        sizes.append(
            f"{value} {unit} ({100 * one['level']:g} % interval {lower} to {upper})".replace("  ", " ")
        )
    name = words.suspect(cause.suspect)
    return Fact(
        f"What is wrong{', and how much' if sizes else ''}?",
        words.capital(name),
        [
            *([words.sentence(cause.suspect, row["parameters"])] if row["parameters"] else []),
            *(f"Size: {size}." for size in sizes),
        ],
    )


def _where(told: Mapping[str, Any]) -> Fact:
    location = told["location"]
    where = words.EQUATIONS[location["equation"]]
    details = [f"It shows most in the {words.signal(location['signal'])}."]
    telling = [one for one in told["functions_of"] if one["explained"] >= TELLING][:1]
    details += [
        "Found without knowing any cause: something unseen acts on the "
        f"{words.place(told['unknown_inputs'][0]['port'])[0]}, and {100 * one['explained']:.0f} % of it is a "
        f"function of the {operation.words(one['variable'], 'main')[0]}."
        for one in telling
    ]
    return Fact("Where?", f"{words.capital(words.lifts(location['lift']))}: {where}", details)


def _sure(cause: Cause, row: Mapping[str, Any]) -> Fact:
    share = 100.0 * row["credibility"]
    complete = row["form"] == "complete"
    return Fact(
        f"How sure is “{cause.suspect.name}”?",
        f"Credibility {row['credibility']:.2f} of 1",
        [
            f"The recordings held out were drawn anew at random many times; in {share:.0f} % of the draws "
            "this explains them better than everything else that was tried."
            if cause.rivals or not complete
            else "No rival came near enough to be tried.",
            "Nothing but the sensors' noise is left over: its law is right, as far as these recordings tell."
            if complete
            else "Its law is uncertain: the place is right, but something is left over, or only a curve "
            "without a name explains it.",
        ],
    )


def _better(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    left, gain = told["left_over"], told["fit_summary"].get("validate")
    if told["verdict"] == "no-mismatch" or not found.causes:
        answer = "There is nothing to gain." if told["verdict"] == "no-mismatch" else "Nothing was added."
        fit = (
            f"The velocity fits to {gain['nrmse_before']:.1f} % (NRMSE) on recordings held out."
            if gain
            else ""
        )
        return Fact("How much better does the model get?", answer, [fit] if fit else [])
    details = [
        f"What is left over falls in the worst signal from {words.number(left['worst_before'])} to "
        f"{words.number(left['worst_after'])} {words.NOISE}, and on average from "
        f"{words.number(left['before'])} to {words.number(left['after'])}."
    ]
    if any(cause.suspect.kind in ("sensor", "parameter") for cause in found.causes):
        details.append(
            "The velocity fit is the truck's own: what a sensor reads wrongly, or was entered wrongly, is "
            "not put right in it, but in what is left over."
        )
    if not gain:
        return Fact("How much better does the model get?", "See what is left over.", details)
    return Fact(
        "How much better does the model get?",
        f"Velocity fit {gain['nrmse_before']:.1f} → {gain['nrmse_after']:.1f} %",
        [
            f"A gain of {gain['gain']:.2f} points (NRMSE; 95 % interval {gain['gain_lower']:.2f} to "
            f"{gain['gain_upper']:.2f}) on recordings it was not fitted on; 100 % is perfect.",
            *details,
        ],
    )


def _else(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    question = "What could it be instead?"
    alike = dict.fromkeys(words.suspect(one) for cause in found.causes for one in cause.not_separable_from)
    if alike:
        return Fact(
            question,
            f"{_listed(list(alike))}: these recordings cannot tell.",
            ["These explain the recordings held out as well, and are not ruled out."],
        )
    rivals = sorted(
        ((left, share, names) for cause in found.causes for names, share, left in cause.rivals),
        key=lambda one: one[0],
    )
    untestable = len(told["untestable"])
    open_ = (
        [f"Of {untestable} other suspects these recordings can tell nothing: see Doubts."]
        if untestable
        else []
    )
    if not rivals:
        none = "Nothing else was needed." if told["verdict"] == "no-mismatch" else "Nothing else was tried."
        return Fact(question, none, open_)
    left, share, names = rivals[0]
    nearest = " and ".join(words.suspect(one) for one in names)
    return Fact(
        question,
        "Nothing that was tried explains it as well.",
        [
            f"Nearest: {nearest}, which leaves {words.number(left)} {words.NOISE}, with a credibility of "
            f"{share:.2f}.",
            *open_,
        ],
    )


def _next(told: Mapping[str, Any]) -> Fact:
    proposed, why = told["next_recording"], told["next_recording_why"]
    if proposed is None:
        return Fact("What to record next?", "Nothing more is needed.", [f"{words.capital(why)}."])
    return Fact(
        "What to record next?",
        f"{words.capital(words.lifts(proposed['lift']))}, "
        f"{proposed['load_kg']:g} kg, oil at {proposed['oil_temperature_degc']:.0f} °C",
        [f"{words.capital(why)}.", f"The command is in {proposed['command']}, beside this page."],
    )


def _listed(names: Sequence[str]) -> str:
    return words.capital(" or ".join(names))
