"""The first screen of a diagnosis: what a reader asks first, each answered in a few words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forklift.diagnosis.criteria import REDRAWS
from forklift.diagnosis.files import TELLING
from forklift.fitting.residuals import AT_NOISE
from forklift.plant.forklift import variables as operation
from forklift.report import words
from forklift.report.blocks import Fact
from forklift.report.ledger import counts
from forklift.report.physical import physical

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.diagnose import Diagnosis


ENTERED = ("sensor", "parameter")
"""Kinds of cause that are none of the machine's: a sensor, or what was entered."""
NRMSE = "NRMSE: 100 % less the normalised root mean square error"
USE = "The model with it is truck.toml, beside this page: how to simulate with it, see Next steps."


def answers(found: Diagnosis, told: Mapping[str, Any]) -> list[Fact]:
    """What is wrong, where, how sure, how much, what it improves, what else it could be, what to do next."""
    if found.unexcited:
        return _unexcited(found, told)
    what = [] if found.causes else [_nothing(found, told), _tested(told)]
    for cause, row in zip(found.causes, told["causes"], strict=True):
        what += [_what(found, cause, row), _sure(found, told, cause, row)]
    where = [_where(found, told)] if told["location"] else []
    return [*what[:1], *where, *what[1:], _better(found, told), _else(found, told), _next(found, told)]


def _unexcited(found: Diagnosis, told: Mapping[str, Any]) -> list[Fact]:
    """Where nothing moves, nothing can be told, and it is no good news."""
    return [
        Fact("What is wrong?", "It cannot be told.", [words.prose(found.unexcited)]),
        Fact(
            "What could it be?",
            f"Any of {len(told['untestable'])} hypotheses, or nothing",
            ["These recordings tell nothing of any of them: see Doubts."],
        ),
        Fact(
            "What to record next?", "Lowerings that move a lift.", ["At several currents, loads and speeds."]
        ),
    ]


def _nothing(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    judged = len({one.file for one in found.final.held_out})
    worst = told["left_over"]["worst_before"]
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


def _what(found: Diagnosis, cause: Cause, row: Mapping[str, Any]) -> Fact:
    sizes = []
    for one in row["parameters"][:1] if row["kind"] != "unknown" else ():
        value, lower, upper = words.size(one["value"], one["lower"], one["upper"])
        unit = words.printed(one["unit"])
        sizes.append(
            f"{value} {unit} ({100 * one['level']:g} % interval {lower} to {upper})".replace("  ", " ")
        )
    name = words.hypothesis(cause.hypothesis)
    if cause.curve:
        return Fact(
            "What is wrong?",
            words.capital(name),
            [
                "But by another law than the catalogue's: a curve without a name, over "
                f"{cause.curve.over}, has joined it in the model. Only their sum is told, not the share of "
                "either; it is drawn below."
            ],
        )
    return Fact(
        f"What is wrong{', and how much' if sizes else ''}?",
        words.capital(name),
        [
            *([words.sentence(cause.hypothesis, row["parameters"])] if sizes else []),
            *(f"Size: {size}." for size in sizes),
            *(
                [said]
                if sizes and (said := physical(found, cause.hypothesis.id, cause.hypothesis.where))
                else []
            ),
            *([f"It has no name in the catalogue{_curve(found, cause)}"] if row["kind"] == "unknown" else []),
        ],
    )


def _curve(found: Diagnosis, cause: Cause) -> str:
    """Where the curve of what has no name is told: in words, by the effect that holds it, or in a picture."""
    effect = (cause.hypothesis.amplitude or "").split(".")[1:2]
    told = [said for one in effect if (said := physical(found, one, cause.hypothesis.where))]
    if told:
        return f". {told[0]}"
    return "; its curve is drawn below." if cause.hypothesis.over else "."


def _where(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    location = told["location"]
    where = words.EQUATIONS[location["equation"]]
    velocity = (
        bool(told["causes"]) and told["causes"][0]["kind"] not in ENTERED and not found.final.loo_log_score
    )
    details = [_most(location["signal"], velocity)]
    telling = [one for one in told["functions_of"] if one["explained"] >= TELLING][:1]
    details += [
        "Found without knowing any cause: beyond the fitted truck, something unseen acts on the "
        f"{words.place(told['unknown_inputs'][0]['port'])[0]}, and {100 * one['explained']:.0f} % of it is a "
        f"function of the {operation.words(one['variable'], 'main')[0]}."
        for one in telling
    ]
    lift = "" if location["equation"] == "operating-point" else f"{words.lifts(location['lift'])}: "
    return Fact("Where?", words.capital(f"{lift}{where}"), details)


def _sure(found: Diagnosis, told: Mapping[str, Any], cause: Cause, row: Mapping[str, Any]) -> Fact:
    question = f"How sure is “{cause.hypothesis.name}”?"
    if not cause.hypothesis.amplitude and row["kind"] == "sensor":
        return Fact(
            question,
            "It is seen in the samples themselves",
            [
                "The signal stands still while the lift moves, or jumps while the lift does not, which no "
                "working sensor does; these samples were left out of everything below."
            ],
        )
    law = _law(found, cause, row)
    count, held = counts(told), len({one.file for one in found.final.held_out})
    tried = f"Of {count['considered']} hypotheses considered (list below), {count['fitted']} were fitted"
    if cause.rivals:
        share = 100.0 * row["credibility"]
        draws = (
            f"{tried}. The {held} recordings held out were redrawn at random {REDRAWS} times; in "
            f"{share:.0f} % of the draws this explains them better than all else that was fitted."
        )
    else:
        why = "no other promised enough beside it" if count["fitted"] == 1 else "none of them without it"
        draws = (
            f"{tried.replace(' 1 were', ' 1 was')}: {why}, so that it had no rival to beat on the {held} "
            "recordings held out."
        )
    alike = [words.hypothesis(one) for one in cause.not_separable_from]
    if alike:
        return Fact(
            question,
            f"Not sure: it cannot be told from {_listed(alike)}",
            [
                f"Credibility {row['credibility']:.2f} of 1. {draws}",
                "Each of them leaves nothing but the sensors' noise over.",
            ],
        )
    alone = "" if cause.rivals else ", without a rival"
    return Fact(question, f"Credibility {row['credibility']:.2f} of 1{alone}", [draws, law])


def _law(found: Diagnosis, cause: Cause, row: Mapping[str, Any]) -> str:
    """How sure its law is."""
    if row["form"] != "complete":
        return f"Its law is uncertain: {_doubt(found, cause)}."
    if row["kind"] in ENTERED:
        return "With it nothing but the sensors' noise is left over."
    if found.final.loo_log_score:
        return "Nothing but noise is left over, as without it: these recordings tell little of its law."
    return (
        "Nothing but the sensors' noise is left over: its law is right as far as these recordings tell"
        f"{_covered(found, cause)}."
    )


def _doubt(found: Diagnosis, cause: Cause) -> str:
    if found.selection.curve:
        return (
            "the catalogue's leaves no more than the noise in any signal, but a curve over "
            f"{found.selection.curve.hypotheses[0].over} beside it explains all recordings better"
            f"{'' if cause.curve else '; those held out alone do not decide'}"
        )
    if not found.final.complete:
        return "the place is right, but something is left over"
    if cause.hypothesis.kind == "unknown":
        return "it has no name, but with it nothing but the sensors' noise is left over"
    return (
        "the catalogue's alone leaves something over; with a curve beside it nothing but the sensors' noise "
        "is left"
    )


def _better(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    left, gain = told["left_over"], told["fit_summary"].get("validate")
    if not found.final.hypotheses:
        answer = "There is nothing to gain." if told["verdict"] == "no-mismatch" else "Nothing was added."
        fit = (
            f"The velocity fits to {gain['nrmse_before']:.1f} % ({NRMSE}) on recordings held out."
            if gain
            else ""
        )
        return Fact("How much better does the model get?", answer, [fit] if fit else [])
    details = [
        f"What is left over falls in the worst signal from {words.number(left['worst_before'])} to "
        f"{words.number(left['worst_after'])} {words.NOISE}."
    ]
    if found.final.loo_log_score:
        details.append(
            "It shows in no recording alone. But each recording is foretold better by all the "
            "others with "
            f"it, altogether by {words.number(found.final.loo_log_score)} in ln probability, which "
            f"decides here."
        )
    if not gain or any(cause.hypothesis.kind == "sensor" for cause in found.causes):
        return Fact(
            "How much better does the model get?",
            f"Left over {words.number(left['worst_before'])} → {words.number(left['worst_after'])}",
            details[:1],
        )
    return Fact(
        "How much better does the model get?",
        f"Velocity fit {gain['nrmse_before']:.1f} → {gain['nrmse_after']:.1f} %",
        [
            *_errors(told),
            f"Velocity fit: a gain of {gain['gain']:.2f} points (95 % interval {gain['gain_lower']:.2f} to "
            f"{gain['gain_upper']:.2f}) of {NRMSE}.",
            *details,
        ],
    )


def _else(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    question = "What could it be instead?"
    alike = dict.fromkeys(words.hypothesis(one) for cause in found.causes for one in cause.not_separable_from)
    if alike:
        return Fact(
            question,
            f"{words.capital(' or '.join(alike))}: these recordings cannot tell.",
            ["These explain the recordings held out as well, and are not ruled out."],
        )
    rivals = sorted(
        (
            (left, share, names)
            for cause in found.causes
            for names, share, left in cause.rivals
            if words.hypothesis(cause.hypothesis) not in map(words.hypothesis, names)  # the cause and more
        ),
        key=lambda one: one[0],
    )
    untestable = counts(told)["unidentifiable"]
    open_ = (
        [f"{_others(untestable)} could not be tested with these recordings: see Doubts."]
        if untestable
        else []
    )
    if not rivals:
        needed = told["verdict"] != "no-mismatch"
        none = "Nothing else that could be tested." if needed else "Nothing else was needed."
        if found.causes:
            open_ = [*_runner_up(told), *open_]
        return Fact(question, none, open_)
    open_ = [
        *(
            f"The same by the catalogue's law alone leaves {words.number(cause.alone)} on average: its law "
            "is in doubt, not its place."
            for cause in found.causes
            if cause.alone is not None
        ),
        *open_,
    ]
    left, share, names = rivals[0]
    nearest = " and ".join(words.hypothesis(one) for one in names)
    return Fact(
        question,
        "Nothing that was tried explains it as well.",
        [
            f"Nearest: {nearest}, which leaves {words.number(left)} {words.NOISE}, with a credibility of "
            f"{share:.2f}.",
            *open_,
        ],
    )


def _next(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    question, proposed = "What to record next?", told["next_recording"]
    alike = [words.hypothesis(one) for cause in found.causes for one in cause.not_separable_from]
    uncertain = any(cause.form == "uncertain" for cause in found.causes)
    if proposed is None:
        if alike or uncertain:
            return Fact(
                question,
                "No recording would settle it.",
                ["None that this machine can make would tell the explanations apart: see Next steps."],
            )
        unidentifiable = counts(told)["unidentifiable"]
        left = [f"{_others(unidentifiable)} could not be tested: see Doubts."] if unidentifiable else []
        return Fact(
            question,
            "Nothing more is needed for this cause." if found.causes else "Nothing more is needed.",
            [words.prose(told["next_recording_why"]), *left, USE],
        )
    if alike:
        why = f"It would tell the cause from this: {_listed(alike)}."
    elif found.selection.curve:
        why = "It would tell the catalogue's law from the curve."
    elif uncertain:
        why = "It would tell the cause from what comes nearest to it."
    elif found.causes:
        why = "It would tell the size of the cause more closely."
    else:
        why = words.prose(told["next_recording_why"])
    return Fact(
        question,
        f"{words.capital(words.lifts(proposed['lift']))}, {proposed['load_kg']:g} kg, "
        f"oil at {proposed['oil_temperature_degc']:.0f} °C",
        [why, f"The command is in {proposed['command']}, beside this page.", USE],
    )


def _most(channel: str, velocity: bool) -> str:
    """In which signal it shows most; and why the headline has another, if so."""
    said = f"It shows most in the {words.signal(channel)}, held against that sensor's noise."
    if not velocity or channel.startswith("velocity"):
        return said
    derived = channel == "fork_height_m" or channel.startswith("position")
    return said + (
        " The headline's velocity is derived from such a position."
        if derived
        else " The headline tells the velocity, for which the model is made."
    )


def _covered(found: Diagnosis, cause: Cause) -> str:
    """Over which values of the conditions that tell it, where these leave gaps."""
    said = []
    runs = found.after.predictions
    for name in cause.hypothesis.needs_two_of:
        values = [
            one.oil_temperature_degc if name == "oil_temperature_degc" else one.recording.load_kg
            for one in runs
        ]
        what, unit = ("oil", "°C") if name == "oil_temperature_degc" else ("load", "kg")
        none = ", none between" if len(words.spans(values)) > 1 else ""
        said.append(f"{what} at {words.stretches(values)} {unit}{none}")
    return f" ({'; '.join(said)})" if said else ""


def _errors(told: Mapping[str, Any]) -> list[str]:
    """Root mean square errors in units that a workshop reads."""
    if not told["errors"]:
        return []
    said = []
    for one in sorted(told["errors"], key=lambda one: one["channel"]):
        name, unit, scale = words.fine(one["channel"], one["unit"])
        before, after = (words.number(scale * one[when], 2) for when in ("before", "after"))
        said.append(f"{name} {before} → {after} {unit}")
    count = max(one["recordings"] for one in told["errors"])
    return [f"Root mean square errors, {count} recordings held out: {', '.join(said)}."]


def _runner_up(told: Mapping[str, Any]) -> list[str]:
    """What promised most of what was neither named nor fitted."""
    named = max((one["promised"] or 0.0 for one in told["hypotheses"] if one["named"]), default=0.0)
    other = next((one for one in told["hypotheses"] if not (one["named"] or one["unidentifiable"])), None)
    if not other or not named:
        return []
    return [
        f"Next in promise, and not fitted: {words.at(other['name'], other['where'])}, with "
        f"{100.0 * other['promised'] / named:.0f} % of the cause's promise (list below)."
    ]


def _others(count: int) -> str:
    return f"{count} other {'hypotheses' if count > 1 else 'hypothesis'}"


def _listed(names: Sequence[str]) -> str:
    return " or ".join(f"“{name}”" for name in dict.fromkeys(names))
