"""The first screen of a diagnosis: what a reader asks first, each answered in a few words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import as_precise, capital, number, printed, prose, size, spans, stretches
from forklift.diagnosis import sentences
from forklift.diagnosis.criteria import LIKELY, NAMED_RIGHTLY, REDRAWS, TOLD_REGION
from forklift.diagnosis.numbers import of_hypothesis
from forklift.fitting.intervals import QUANTILE
from forklift.report.blocks import Fact
from forklift.report.entered import in_how_many
from forklift.report.instead import LIKE, as_good, instead, ruled_out, said, some, standing
from forklift.report.judged import judged
from forklift.report.ledger import considered_of, counts
from forklift.report.nothing import nothing, tested, unexcited
from forklift.report.words import NOISE

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.result import Diagnosis
    from forklift.fitting.residuals import ChannelResidual


ENTERED = ("sensor", "parameter")
"""Kinds of cause that are none of the machine's: a sensor, or what was entered."""
IS_A = {
    "sensor": "The sensor is wrong, not the machine.",
    "parameter": "What was entered is wrong, neither the machine nor a sensor.",
    "physics": "The machine does so, and the model did not.",
}
"""By kind of cause, what is to blame."""
AS_CREDIBLE = 5.0
"""Difference in ln evidence below which two places explain as much."""
LITTLE = 0.01
"""Share of a mean by less than which it hardly changes."""


def answers(found: Diagnosis, told: Mapping[str, Any]) -> list[Fact]:
    """What is wrong, where, how sure, how much, what it improves, what else it could be, what to do next."""
    if found.findings.unexcited:
        return unexcited(found, told)
    none = not found.causes or found.unexplained
    what = [nothing(found, told), tested(found, told)] if none else []
    for cause, row in zip(found.causes, told["causes"], strict=True):
        fact = _what(found, cause, row)
        further = replace(fact, question=fact.question.replace("What is wrong", "What else is wrong"))
        what += [further if what else fact, _sure(found, told, cause, row)]
    where = [_where(found, told)] if told["location"] else []
    better = _better(found, told)
    better = replace(better, details=[*better.details, *_in_use(found)])
    return [*what[:1], *where, *what[1:], better, instead(found, told), _next(found, told)]


def _what(found: Diagnosis, cause: Cause, row: Mapping[str, Any]) -> Fact:
    words = found.machine.words
    name = ("" if cause.credibility >= LIKELY else "perhaps ") + said(found, cause.hypothesis)
    if cause.curve:
        return Fact(
            "What is wrong?",
            capital(name),
            [
                "But by another law than the catalogue's: a curve without a name, over "
                f"{cause.curve.over}, has joined it in the model. Only their sum is told, not the share of "
                "either; it is drawn below."
            ],
        )
    known = sentences.told_as(found, cause.hypothesis)
    if known.clause:
        perhaps = "" if cause.credibility >= LIKELY else "perhaps "
        return Fact(
            "What is wrong, and how much?",
            capital(perhaps + known.clause),
            [known.interval, *in_how_many(found, cause), *_is_a(found, cause)],
        )
    told = list(sizes(row))
    shown = (
        found.machine.physical(cause.hypothesis, found.values, found.recordings) if row["parameters"] else ""
    )
    details = []
    if told:
        whole = words.sentence(cause.hypothesis, row["parameters"])
        details = [*([whole] if whole else []), f"Size: {'; '.join(told)}."]
    if row["kind"] == "unknown":
        curve = "; its curve is drawn below." if cause.hypothesis.over and not shown else "."
        details = [f"It has no name in the catalogue{curve}"]
    return Fact(
        f"What is wrong{', and how much' if told else ''}?",
        capital(name),
        [*details, *([shown] if shown else []), *_is_a(found, cause)],
    )


def _is_a(found: Diagnosis, cause: Cause) -> Iterator[str]:
    """What is to blame, where that is not in doubt: it is likely, and nothing of another kind is as good."""
    kind = cause.hypothesis.kind
    alike = {one.kind for one in cause.not_separable_from}
    if kind in IS_A and cause.credibility >= LIKELY and alike <= {kind}:
        yield found.machine.words.sound(cause.hypothesis) or IS_A[kind]


def _in_use(found: Diagnosis) -> Iterator[str]:
    """What each cause does to the machine, where it does most."""
    for cause in found.causes:
        used = found.in_use.get(cause.hypothesis.label)
        if used is None:
            continue
        shown = found.machine.words.used(used.signal, used.unit)
        unit = printed(shown.unit)
        present, absent = (f"{number(shown.scale * one)} {unit}" for one in (used.present, used.absent))
        most = f"{number(abs(shown.scale) * used.most, 2)} {unit} apart {number(used.at_s)} s after the start"
        hardly = abs(used.present - used.absent) < LITTLE * abs(used.absent)
        means = (
            f"{present} on average with and without it; {most}"
            if hardly
            else f"{present}, and at {absent} with it switched off in the final model"
        )
        which = f", “{_apart(found, cause)}”" if len(found.causes) > 1 else ""
        yield f"In use{which} ({used.file}): {shown.name} {means}."


def _apart(found: Diagnosis, cause: Cause) -> str:
    """Its name, with where it acts if another has that name too."""
    alike = [one for one in found.causes if one.hypothesis.name == cause.hypothesis.name]
    return said(found, cause.hypothesis) if len(alike) > 1 else cause.hypothesis.name


def sizes(row: Mapping[str, Any]) -> Iterator[str]:
    """Every parameter of a cause with its interval: of a condition the mean, of a curve none."""
    rows = row["parameters"] if row["kind"] != "unknown" else ()
    for one in [one for one in rows if " in " not in one["name"]]:
        value, lower, upper = size(one["value"], one["lower"], one["upper"])
        unit = f" {printed(one['unit'])}".rstrip()
        yield f"{one['name']} = {value}{unit} (95 % interval {lower} to {upper})"


def _where(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    words, location = found.machine.words, told["location"]
    named = dict.fromkeys(
        place
        for cause in ([] if found.unexplained else found.causes)
        for place in (found.machine.acted_on(cause.hypothesis) or (cause.hypothesis.where,))
        if place
    )
    velocity = bool(found.causes) and sentences.gain(found) is not None and not sentences.in_all_alone(found)
    details = [] if sentences.strained(found) else [_most(found, location["signal"], velocity)]
    theirs = bool(found.causes) and not found.unexplained and found.causes[0].hypothesis.kind in ENTERED
    if found.inputs and not theirs:
        details.append(_unknown(found))
    part = words.part(location[found.machine.part_word])
    of = "" if location["equation"] == "operating-point" or not part else f"{part}: "
    places = [words.place(name).name for name in named]
    answer = f"{of}{words.equation(location['equation'])}"
    if not part and places:
        answer = f"at {'; at '.join(places)}"
    return Fact("Where?", capital(answer), details)


def _unknown(found: Diagnosis) -> str:
    """The place as the recordings tell it, without knowing any cause."""
    words, best = found.machine.words, found.inputs[0]
    near = [
        f"“{words.place(one.port).name}”"
        for one in found.inputs[1:]
        if best.evidence - one.evidence < AS_CREDIBLE
    ]
    doubt = f" (one at {' or '.join(near[:LIKE])} would explain as much)" if near else ""
    telling = next((one for one in found.dependences if one.explained >= TOLD_REGION), None)
    over = found.causes[0].hypothesis.over if found.causes else ""
    told = (
        f"Of the curves that were screened, one over {over} explains the recordings best"
        if over
        else f"{100 * telling.explained:.0f} % of that input is a function of "
        f"“{words.variable(telling.variable, found.machine.part_of(best.port)).name}”"
        if telling
        else "No variable tells most of that input"
    )
    return (
        f"Found without any hypothesis: what the fitted {words.noun} does not explain, an unknown input at "
        f"“{words.place(best.port).name}” would{doubt}. {told}."
    )


def _most(found: Diagnosis, channel: str, headline: bool) -> str:
    """In which signal it shows most; and why the headline has another, if so."""
    words, of = found.machine.words, found.machine.headline
    told = f"It shows most in the {words.signal(channel)}, compared with that sensor's noise."
    if not headline or not of or channel.startswith(of):
        return told
    derived = channel == "fork_height_m" or channel.startswith("position")
    return told + (f" The {of} in the headline is derived from such a position." if derived else "")


def _sure(found: Diagnosis, told: Mapping[str, Any], cause: Cause, row: Mapping[str, Any]) -> Fact:
    question = f"How sure is “{_apart(found, cause)}”?"
    if not cause.hypothesis.amplitude and row["kind"] == "sensor":
        return Fact(
            question,
            "It is seen in the samples themselves",
            [
                "The signal stands still while it should not, or jumps, which no working sensor does; these "
                "samples were left out of everything below."
            ],
        )
    count = counts(told)
    if found.judged_on != "validate":
        return Fact(
            question,
            "It cannot be said: no recording was held out",
            [
                f"{considered_of(count)} (list below). "
                "On the recordings that it was fitted to this explains most; on those, any model can be "
                "made to look good. Give some recordings the role validate.",
            ],
        )
    law = [_law(found, cause, row), *_named_so(row)]
    tried = f"{considered_of(count)} (list below)"
    if cause.rivals:
        share = 100.0 * row["share"]
        which = f"All {len(found.recordings)} recordings" if cause.by_all else f"The {judged(found)}"
        best = "they foretell each other best with it" if cause.by_all else "this explains them best"
        draws = (
            f"{tried}. {which} were redrawn at random {REDRAWS} times; in {share:.0f} % of the draws {best}, "
            "of all that was fitted."
        )
    else:
        far = _far_from_none(found, cause)
        draws = f"{far}Judged on {judged(found)}. {tried}."
    out = dict(ruled_out(found, cause))
    stands = [name for name in standing(found, cause) if name not in out]
    first_order = [f"By a linear estimate {some(stands)} could stand for it: see Doubts."] if stands else []
    first_order += [f"“{name}” {told}." for name, told in out.items()]
    groups = _groups(found) if cause is found.causes[0] else []
    alike = as_good(found, cause)
    if alike:
        return Fact(
            question,
            f"Not sure: it cannot be told from {some(alike)}",
            [
                *([f"Credibility {row['credibility']:.2f} of 1."] if cause.rivals else []),
                draws,
                "Each of them explains the recordings as well.",
                *_named_so(row),
                *first_order,
                *groups,
            ],
        )
    sure = f"Credibility {row['credibility']:.2f} of 1" if cause.rivals else _uncontested(found, cause, count)
    return Fact(question, sure, [draws, *law, *first_order, *groups])


def _uncontested(found: Diagnosis, cause: Cause, count: Mapping[str, int]) -> str:
    """Why there is no credibility, which compares what was fitted."""
    if count["given_up"]:
        return "No rival came near: those begun were given up"
    if cause.hypothesis.kind != "unknown" and count["fitted"] > len(found.causes):
        return "No rival came near: all else that was fitted contains it"
    return "No rival came near enough to be fitted"


def _far_from_none(found: Diagnosis, cause: Cause) -> str:
    """How sure it is that it is there at all, where nothing else was fitted against it."""
    if cause.hypothesis.kind in ("unknown", "parameter"):
        return ""  # how finely a recording tells its load is no measure of what else it could be
    off = 1.0 if cause.hypothesis.kind == "sensor" and _is_gain(cause) else 0.0
    rows = [row for row in of_hypothesis(found.final, cause.hypothesis) if row.upper > row.lower]
    if cause.hypothesis.kind == "physics":
        rows = [row for row in rows if row.name == cause.hypothesis.amplitude]
    deviations = [2.0 * QUANTILE * abs(row.value - off) / (row.upper - row.lower) for row in rows]
    if not deviations:
        return ""
    return f"Its size is {number(max(deviations), 2)} standard deviations from none. "


def _is_gain(cause: Cause) -> bool:
    return (cause.hypothesis.amplitude or "").rpartition(".")[2] == "gain"


def _law(found: Diagnosis, cause: Cause, row: Mapping[str, Any]) -> str:
    """How sure its law is."""
    if row["form"] != "complete":
        return f"{'It' if row['kind'] in ENTERED else 'Its law'} is uncertain: {_doubt(found, cause)}."
    if row["kind"] in ENTERED:
        return f"{sentences.with_it(found)}."
    right = "its law is right" if not found.deficiency[1].failures else "its law is right in size"
    return (
        f"{capital(sentences.remainder(found))}: {right} as far as these recordings tell"
        f"{_covered(found, cause)}."
    )


def _named_so(row: Mapping[str, Any]) -> list[str]:
    """How often the name is right of what has one and is not settled."""
    if row["kind"] == "unknown" or row["form"] == "complete":
        return []
    return [
        f"Of causes told so on campaigns of known truth, {100.0 * NAMED_RIGHTLY:.0f} % were named rightly: "
        "no credibility says more than that. Most others were laws that the catalogue lacks, at the same "
        "place."
    ]


def _doubt(found: Diagnosis, cause: Cause) -> str:
    """In the order of `doubts`, which tells it in full."""
    if sentences.doubt(cause):
        return f"{sentences.remainder(found)}, but {sentences.doubt(cause)}"
    if sentences.beside(found):
        return "it has no name" if cause.hypothesis.kind == "unknown" else _elsewhere(found)
    if not found.final.complete:
        return "something is left over, so that it is not settled"
    if cause.hypothesis.kind == "unknown":
        return f"it has no name, but with it {sentences.remainder(found)}"
    if found.selection.curve:
        return (
            "the catalogue's leaves no more than the noise in any signal, but a curve over "
            f"{found.selection.curve.hypotheses[0].over} beside it explains all recordings better"
            f"{'' if cause.curve else '; those held out alone do not decide'}"
        )
    return f"the catalogue's alone leaves something over; with a curve beside it {sentences.remainder(found)}"


def _elsewhere(found: Diagnosis) -> str:
    """Where what is left over has nothing to do with what was found."""
    signals = " and ".join(map(found.machine.words.signal, sentences.beside(found)))
    return f"the {signals} keeps what is left over there with or without it"


def _covered(found: Diagnosis, cause: Cause) -> str:
    """Over which values of the conditions that tell it, where these leave gaps."""
    told = []
    for name in cause.hypothesis.needs_two_of:
        values = [one.conditions[name] for one in found.after.predictions]
        what, unit, _ = found.machine.words.condition(name)
        none = ", none between" if len(spans(values)) > 1 else ""
        told.append(f"{what} at {stretches(values)} {unit}{none}")
    return f" ({'; '.join(told)})" if told else ""


def gaps(found: Diagnosis) -> list[str]:
    """Values of the conditions that tell the causes, between which nothing was recorded."""
    told = []
    for name in dict.fromkeys(name for cause in found.causes for name in cause.hypothesis.needs_two_of):
        seen = spans([one.conditions[name] for one in found.after.predictions])
        what, unit, _ = found.machine.words.condition(name)
        told += [
            f"{what} of {number(0.5 * (low[1] + high[0]), 2)} {unit} or so" for low, high in pairwise(seen)
        ]
    return told


def _better(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    question = "How much better does the model get?"
    left, summary = told["left_over"], told["fit_summary"].get("validate")
    errors = list(_errors(found, told))
    kept = judged(found)
    if not found.final.hypotheses:
        answer = "There is nothing to gain." if told["verdict"] == "no-mismatch" else "Nothing was added."
        now = ", ".join(f"{name} {after} {unit}".rstrip() for name, _, after, unit in errors)
        return Fact(question, answer, [f"Root mean square error, {kept}: {now}."] if now else [])
    changes = [f"{name} {before} → {after} {unit}".rstrip() for name, before, after, unit in errors]
    all_errors = [f"Root mean square errors, {kept}: {', '.join(changes)}."] if changes else []
    if sentences.strained(found):
        return Fact(
            question,
            "It does not: it fits as well before",
            [
                *all_errors,
                "But before, each recording's own conditions had to lie further from those entered than is "
                f"plausible. That costs {number(left['worst_before'] - _unstrained(found))} of the "
                f"{number(left['worst_before'])} {NOISE} in the worst signal "
                f"({_worst_of(found, found.baseline.worst)}); after, nothing of it is left.",
            ],
        )
    noise = (
        f"Left over in the worst signal before: {number(left['worst_before'])} "
        f"({_worst(found, found.baseline.worst)}); in the worst after: {number(left['worst_after'])} "
        f"({_worst(found, found.final.worst)}) {NOISE}."
    )
    if found.final.loo_log_score:
        noise += f" {capital(sentences.by_all(found))}, which decides here."
    gain = sentences.gain(found)
    if gain is None or not gain.shows:
        change = f"Left over {number(left['worst_before'])} → {number(left['worst_after'])}"
        beside = [f"{capital(gain.what)}: {' → '.join(gain.printed)}."] if gain else []
        return Fact(question, change, [noise, *beside, *all_errors])
    if gain.unit == "%" and summary:
        return Fact(
            question,
            f"{capital(found.machine.headline)} fit {gain.before:.1f} → {gain.after:.1f} %",
            [
                *all_errors,
                f"{capital(found.machine.headline)} fit: a gain of {summary['gain']:.2f} points (95 % "
                f"interval {summary['gain_lower']:.2f} to {summary['gain_upper']:.2f}) of NRMSE.",
                noise,
            ],
        )
    rows = [row for row in told["fit"] if row["role"] == found.judged_on and row["rmse_after"] is not None]
    fewer = sum(row["rmse_after"] < row["rmse_before"] for row in rows)
    return Fact(
        question,
        f"Error of {changes[0]}",
        [*all_errors, f"Smaller in {fewer} of {len(rows)} signals.", noise],
    )


def _unstrained(found: Diagnosis) -> float:
    """What the worst signal leaves over but for the cost of implausible conditions."""
    worst = found.baseline.worst
    return worst.mean_square - worst.strain / worst.samples


def _worst_of(found: Diagnosis, one: ChannelResidual) -> str:
    return f"{found.machine.words.signal(one.channel)}, {one.file}"


def _worst(found: Diagnosis, one: ChannelResidual) -> str:
    """Which signal of which recording; and how much of it is the cost of implausible conditions."""
    cost = one.strain / one.samples
    of = _worst_of(found, one)
    told = cost >= max(0.05, 0.05 * one.mean_square)
    return f"{of}; {number(cost)} of it for conditions beyond what is plausible" if told else of


def _errors(found: Diagnosis, told: Mapping[str, Any]) -> Iterator[tuple[str, str, str, str]]:
    """Root mean square errors in units that a workshop reads: signal, before, after, unit."""
    for one in sorted(told["errors"], key=lambda one: one["channel"]):
        name, unit, scale = found.machine.words.fine(one["channel"], one["unit"])
        before, after = as_precise(scale * one["before"], scale * one["after"])
        yield name, before, after, unit


def _next(found: Diagnosis, told: Mapping[str, Any]) -> Fact:
    question, wanted = "What to record next?", found.next_recording
    use = f"The model with it is {found.machine.file}, beside this page: see Next steps."
    alike = [name for cause in found.causes for name in as_good(found, cause)]
    uncertain = any(cause.form == "uncertain" for cause in found.causes)
    if wanted is None:
        if alike or uncertain:
            name = any(cause.hypothesis.kind == "unknown" for cause in found.causes)
            effect = "To give it a name, look for what acts there on the machine: its curve is in Evidence."
            return Fact(
                question,
                "No recording is known that would tell what it is.",
                [prose(found.next_why), *([effect] if name else [])],
            )
        if found.unexplained:
            telling = next((one for one in found.dependences if one.explained >= TOLD_REGION), None)
            over = (
                found.machine.words.variable(
                    telling.variable, found.machine.part_of(found.inputs[0].port)
                ).name
                if telling
                else ""
            )
            files = sentences.shown_alone(found.baseline)
            if files and not over:
                look = sentences.look_at(files, found.machine.words.noun)
                return Fact(question, "First look at what was recorded.", [prose(look)])
            return Fact(
                question,
                f"More of the {over}, over a wider range." if over else "Nothing can be proposed.",
                ["To give it a name, look for what acts there on the machine: see Evidence."],
            )
        answer = (
            "No further recording would say more about this cause."
            if found.causes
            else "No further recording is needed"
            + (" for what could be tested." if told["untestable"] else ".")
        )
        between = gaps(found)
        if between:
            answer = f"A recording in the gap would tell its law there, too: {'; '.join(between)}."
        if found.causes and all(cause.hypothesis.kind in ENTERED for cause in found.causes):
            sensors = {cause.hypothesis.kind == "sensor" for cause in found.causes}
            what = ["what was entered", "the sensor"]
            answer = f"First check {' and '.join(what[one] for one in sorted(sensors, reverse=True))}."
            use = f"The fitted {found.machine.words.noun}{use.removeprefix('The model with it')}"
        checks = [check for cause in found.causes if (check := found.machine.words.check(cause.hypothesis))]
        return Fact(question, answer, [*checks, prose(found.next_why), *([use] if found.causes else [])])
    if alike:
        why = f"It would tell the cause from this: {some(alike)}."
    elif found.selection.curve:
        why = "It would tell the catalogue's law from the curve."
    elif uncertain:
        why = "It would tell the cause from what comes nearest to it."
    elif found.causes:
        why = "It would tell the size of the cause more closely, or part it from what could stand for it."
    else:
        why = prose(found.next_why)
    return Fact(
        question,
        capital(wanted.title),
        [why, f"What drives it is in {told['next_recording']['command']}, beside this page.", use],
    )


def _groups(found: Diagnosis) -> list[str]:
    """What speaks against it where whole groups were left out."""
    bad = [one.group for one in found.groups if one.fails]
    told = [f"It does not hold in {', '.join(bad)}, predicted from the others: see Doubts."] if bad else []
    if found.outlying_groups:
        told.append(f"{', '.join(found.outlying_groups)} fits no law that fits the others: see Doubts.")
    return told
