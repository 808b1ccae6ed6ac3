"""A diagnosis in words: its one sentence, and everything for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from forklift.base.typeset import amount, capital, number
from forklift.diagnosis.criteria import AS_GOOD, FLAT, LIKELY, TOLD_REGION
from forklift.diagnosis.ledger import uncontested
from forklift.diagnosis.numbers import of_hypothesis
from forklift.diagnosis.outcome import COMMAND
from forklift.fitting.agreement import together
from forklift.fitting.clocks import CLOCKS_APART
from forklift.plant.misread import HARDLY, OF, Found

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.dependence import Dependence
    from forklift.diagnosis.outcome import Outcome
    from forklift.diagnosis.refit import Refit
    from forklift.fitting.agreement import Agreement
    from forklift.plant.protocol import Hypothesis
    from forklift.plant.subject import Words


FEW = 3
"""Recordings that a sentence names; of more it tells how many."""
AS_BEFORE = 0.05
"""Share of a mean square by less than which it is as before: chosen, as no reader calls that a change."""


class Gain(NamedTuple):
    """What the machine is told by: its headline, before and after, on what was held out."""

    what: str
    before: float
    after: float
    unit: str
    better: str
    """``"rises"`` or ``"falls"``."""

    @property
    def printed(self) -> tuple[str, str]:
        """Before and after, the latter with its unit."""
        if self.unit == "%":
            return f"{self.before:.1f}", f"{self.after:.1f} %"
        return number(self.before), amount(self.after, self.unit)

    @property
    def shows(self) -> bool:
        """Whether it is better, as printed."""
        better = self.after > self.before if self.better == "rises" else self.after < self.before
        before, after = self.printed
        return better and before != after.partition(" ")[0]


def sentence(found: Outcome) -> str:
    """The verdict in one sentence."""
    judged = sum(one.role == found.judged_on for one in found.recordings)
    kept = "held out" if found.judged_on == "validate" else "that it was fitted on"
    noun = found.machine.words.noun
    if found.findings.unexcited:
        return f"No mismatch can be seen, and nothing be told of any effect: {found.findings.unexcited}."
    if found.verdict == "no-mismatch":
        clocks = any(one.code == CLOCKS_APART for one in found.findings.cautions)
        return (
            f"No mismatch{', but for a clock that is allowed for' if clocks else ''}: the fitted {noun} "
            f"explains all {judged} recordings {kept} down to the "
            f"sensors' noise (mean square at most {found.baseline.worst.mean_square:.2f} in any signal); "
            f"{remainder(found)}."
        )
    if found.verdict == "sensor-fault" and not found.explaining:
        to = "down to the sensors' noise"
        if not found.baseline.complete:
            worst = number(found.baseline.worst.mean_square)
            to = f"but for what may be chance, at most {worst} times the noise power in any signal"
        return (
            f"A sensor fails: {' and '.join(named(found, cause) for cause in found.causes)}; without these "
            f"samples the fitted {noun} explains all {judged} recordings {kept} {to}."
        )
    seen = "".join(f" Besides, {named(found, cause)}." for cause in found.causes)  # if none explains it
    if found.unexplained and found.doubted:
        options = {
            " and ".join(_at(found, one) for one in hypotheses): share
            for cause in found.doubted
            for hypotheses, share, _ in [((cause.hypothesis,), cause.credibility, 0.0), *cause.rivals]
            if share >= AS_GOOD
        }
        listed = "; ".join(f"{name} ({share:.2f})" for name, share in options.items())
        return (
            f"Something is missing, and several explanations fit the recordings {kept} about as well "
            f"(credibility): {listed}.{seen}"
        )
    if found.unexplained:
        assert found.location
        place = found.machine.words.equation(found.location.equation)
        return (
            f"Something is missing that no hypothesis explains: it acts on {place}{_part(found)}"
            f"{_alone(found)}; {found.location.region}.{seen}"
        )
    causes = in_one(
        [
            f"{'' if cause.credibility >= LIKELY else 'perhaps '}{named(found, cause)}"
            for cause in found.causes
        ]
    )
    if found.selection.curve and not any(cause.curve for cause in found.causes):
        causes += ", perhaps by another law than the catalogue's"
    if any(cause.beyond for cause in found.causes):
        causes += ", or something that acts alike"
    return f"{causes[:1].upper()}{causes[1:]}{_gained(found)}; {_left(found)}."


def _alone(found: Outcome) -> str:
    """In which recordings alone it shows, where these are few, or none of them was held out."""
    files = shown_alone(found.baseline)
    if files:
        return f", and shows in {' and '.join(files)} alone"
    if found.baseline.fitted_alone:
        shown = len(found.baseline.shown_in)
        return f", and shows in {shown} of the recordings that were fitted and in none held out"
    return ""


def shown_alone(refit: Refit) -> tuple[str, ...]:
    """The recordings in which something is left over clearly, if they are few, and few among all."""
    every = {one.file for one in refit.judged}
    return refit.shown_in if len(refit.shown_in) <= min(FEW, len(every) // 2) else ()


def look_at(files: Sequence[str], noun: str) -> str:
    """What to do about recordings that alone show something."""
    return (
        f"look at what happened in {' and '.join(files)}: nothing else shows what is left over; if it was no "
        f"{noun}'s doing, leave {'them' if len(files) > 1 else 'it'} out and diagnose again"
    )


def _left(found: Outcome) -> str:
    if found.final.complete:
        return remainder(found)
    worst = number(found.final.worst.mean_square)
    if beside(found):
        signals = " and ".join(map(found.machine.words.signal, beside(found)))
        return f"apart from that up to {worst} times the noise power is left over in the {signals}, as before"
    return f"it is not the whole story: up to {worst} times the noise power is left over in a signal"


def beside(found: Outcome) -> list[str]:
    """The channels that are not explained, where what was found touches none of them: each is left with as
    much as before. Empty where it does, or nothing is left."""
    before = {(one.file, one.channel): one.mean_square for one in found.baseline.held_out}
    over = [one for one in found.final.held_out if not one.explained]
    same = all(
        abs(one.mean_square - before.get((one.file, one.channel), 0.0)) <= AS_BEFORE * one.mean_square
        for one in over
    )
    return list(dict.fromkeys(one.channel for one in over)) if same else []


def in_one(causes: Sequence[str]) -> str:
    """Causes with where they act; what acts in several places is said once."""
    places: dict[str, list[str]] = {}
    for cause in causes:
        what, _, where = cause.rpartition(" (") if cause.endswith(")") else (cause, "", "")
        places.setdefault(what, []).append(where.removesuffix(")"))
    each = (f"{what} ({' and '.join(where)})" if any(where) else what for what, where in places.items())
    return " and ".join(each)


def remainder(found: Outcome) -> str:
    """What the final model leaves over where it explains every signal: its size, and whether it is random."""
    tested = found.deficiency[1]
    if not tested.failures:
        return "nothing but the sensors' noise is left over"
    return (
        "what is left over is no larger than the sensors' noise, but not quite random "
        f"({len(tested.failures)} of {len(tested.tests)} tests fail)"
    )


def with_it(found: Outcome) -> str:
    """What is left over with the cause, or with all of several."""
    return f"{'With it' if len(found.causes) == 1 else 'With all that was found'} {remainder(found)}"


def named(found: Outcome, cause: Cause) -> str:
    """A cause with where it acts."""
    law = f", by another law than the catalogue's, a curve over {cause.curve.over}" if cause.curve else ""
    places = as_well(found, cause)
    tie = f", or equally on {' or '.join(places)}" if places else ""
    return f"{as_found(found, cause.hypothesis) or _at(found, cause.hypothesis)}{law}{tie}"


def as_well(found: Outcome, cause: Cause) -> list[str]:
    """Where the same curve would do as much to these recordings, in words."""
    return [
        found.machine.words.equation(one.other.equation)
        for one in found.confounded
        if one.accepted is cause.hypothesis and one.other.kind == "unknown"
    ]


def as_found(found: Outcome, one: Hypothesis) -> str:
    """How a sensor or a condition is off, with direction and size; empty of all else."""
    return told_as(found, one).clause


def told_as(found: Outcome, one: Hypothesis) -> Found:
    """The same with its interval. Recordings count where there is something that could be entered wrongly:
    not those that have none of it, as forks without a load, and are right."""
    rows = [row.to_dict() for row in of_hypothesis(found.final, one)]
    none = (
        {
            recording.file
            for recording in found.recordings
            for name, value in found.machine.conditions(recording, {}).items()
            if value == 0.0 and name.startswith(one.doubts) and found.machine.words.condition(name).is_amount
        }
        if one.doubts
        else set()
    )
    furthest = max((abs(row["value"]) for row in rows), default=0.0)
    kept = [
        row
        for row in rows
        if row["name"].partition(OF)[2] not in none or abs(row["value"]) > HARDLY * furthest
    ]
    return found.machine.words.found(one, kept)


def _at(found: Outcome, one: Hypothesis) -> str:
    return found.machine.words.at(one.name, one.where)


def in_all_alone(found: Outcome) -> bool:
    """Whether what was found shows in no recording by itself, so that all of them together decided."""
    return found.baseline.complete and bool(found.final.loo_log_score)


def _gained(found: Outcome) -> str:
    if not found.final.loo_log_score:
        return _less(found)
    said = f"; {by_all(found)}"
    return said if in_all_alone(found) else f"{_less(found)}{said}"


def by_all(found: Outcome) -> str:
    """That all recordings together decided, and by how much."""
    small = "is too small to see in one recording"
    effect = f"the effect {small}" if in_all_alone(found) else f"the last effect {small}"
    if len(found.causes) == 1 and not in_all_alone(found):
        effect = "it hardly shows in any one recording"
    return (
        f"{effect}, but across all recordings it improves the "
        f"leave-one-out log score by {found.final.loo_log_score or 0.0:.0f}"
    )


def _less(found: Outcome) -> str:
    told, kept = gain(found), judged_on(found)
    if told is None or not told.shows:
        before, after = told.printed if told else ("", "")
        same = after.partition(" ")[0] == before
        if strained(found):
            fits = f" ({told.what} stays at {after})" if told and same else ""
            return (
                f"; the {found.machine.words.noun} fits no better for it{fits}, but otherwise other "
                "conditions would have to lie further from those entered than is plausible"
            )
        course = f"stays at {after}" if same else f"goes from {before} to {after}"
        return (
            f"; what is left over of the recordings {kept} falls from "
            f"{number(found.baseline.worst.mean_square)} to {number(found.final.worst.mean_square)} times "
            f"the noise power in the worst signal{f', while {told.what} {course}' if told else ''}"
        )
    before, after = told.printed
    return f"; {told.what} on recordings {kept} {told.better} from {before} to {after}"


def strained(found: Outcome) -> bool:
    """Whether nothing but implausible conditions spoke against the machine before anything was added."""
    return (
        found.baseline.strained
        and all(one.mean_square - one.strain / one.samples <= one.bound for one in found.baseline.held_out)
        and found.final.complete
    )


def judged_on(found: Outcome) -> str:
    """Which recordings a gain is told of."""
    if found.judged_on != "validate":
        return "it was fitted on"
    return "held out, and fitted in the end," if led(found) else "held out"


def gain(found: Outcome) -> Gain | None:
    """By what the machine is told: the fit of its headline, or its outputs' error, if these have one unit.

    None where a sensor reads wrongly, which may not touch the headline, and of outputs in several units.
    """
    if any(cause.hypothesis.kind == "sensor" for cause in found.causes):
        return None
    headline = found.machine.headline
    sides = [_headline(one, headline) for one in (found.before, found.after)]
    if headline:
        before, after = (_mean(side["nrmse_percent"]) for side in sides)
        if np.isfinite([before, after]).all():
            return Gain(f"the {headline}'s fit", before, after, "%", "rises")
        return None
    units = set(sides[0]["unit"])
    if len(units) != 1:
        return None
    before, after = map(together, sides)
    return Gain("the root mean square error", before, after, units.pop(), "falls")


def _headline(one: Agreement, headline: str) -> pl.DataFrame:
    return one.held_out.filter(pl.col("channel").str.starts_with(headline))


def _mean(column: pl.Series) -> float:
    mean = column.drop_nulls().mean()
    return float("nan") if mean is None else float(mean)  # type: ignore[arg-type]


def _part(found: Outcome) -> str:
    assert found.location
    part = found.machine.words.part(found.location.part).removeprefix("the ")
    return f" ({part})" if part else ""


def region(words: Words, seen: Sequence[Dependence], part: str) -> str:
    """Where the unknown input acts, in words and numbers, if that is a function of something."""
    telling = [shape for shape in seen if shape.explained >= TOLD_REGION][:2]
    if not telling:
        return "less than half of it is a function of anything that was measured"
    first = telling[0]
    if np.ptp(first.curve) <= FLAT * np.abs(first.curve).max():
        return f"{100.0 * first.explained:.0f} % of it is about {first.curve.mean():+.3g} throughout"
    return "; ".join(
        f"{100.0 * shape.explained:.0f} % of it is a function of {_where(words, shape, part)}"
        for shape in telling
    )


def _where(words: Words, shape: Dependence, part: str) -> str:
    """The variable, where the input acts most, and how it goes from there to there."""
    name, unit, scale = words.variable(shape.variable, part)
    low, high = shape.region
    ends = np.interp([low, high], shape.at, shape.curve)
    said = [f"{scale * at:.3g} {unit}".rstrip() for at in (low, high)]
    return f"{name}, {ends[0]:+.3g} at {said[0]} and {ends[1]:+.3g} at {said[1]}"


def text(found: Outcome) -> str:
    """For a terminal: the sentence first, then the evidence."""
    return "\n".join([sentence(found), "", *_lines(found)])


def led(found: Outcome) -> str:
    """That recordings held out led the numbers too, so that none is left to bear them out; else empty."""
    if not (found.causes and found.final.pooled):
        return ""
    return (
        "recordings held out were fitted in the end as well, as the others say too little of what was found: "
        "no recording is left that bears its size out"
    )


def doubt(cause: Cause) -> str:
    """Why a law that leaves nothing over is uncertain: a number that no such part has, its own or of a cause
    beside it; a rival that removes nearly as much; a cause beside it that may make up for its shape, as what
    has no name may; or that no recording shows it alone. Empty, if it is not for these."""
    if cause.mending:
        others = _quoted(cause.mending)
        bent = (
            f"{others} may make up for the shape of its law"
            if cause.hypothesis.kind == "physics"
            else f"it may make up for the shape of the law of {others}"
        )
        return f"{bent}: one of both shows in no recording alone"
    if not cause.beyond:
        if cause.nearly:
            names, share = cause.nearly
            return (
                f"{_quoted(names)} removes {_percent(share)} of what it removes: with a law a little unlike "
                "the catalogue's that would be as good"
            )
        if cause.beside:
            others = _quoted(cause.beside)
            return f"only beside {others}, with a number that no such part has: something else may act alike"
        if cause.unnamed:
            effect = cause.hypothesis.kind == "physics"
            law = "the shape of the law" if effect else "some of what is told as this"
            return f"only beside {_quoted(cause.unnamed)}, which has no name: it may make up for {law}"
        if cause.by_all and cause.hypothesis.kind == "physics":
            return "it shows in no recording alone, so that these recordings tell little of its law"
        return ""
    each = (
        f"its {one.number.name.rpartition('.')[2].replace('_', ' ')} is "
        f"{amount(one.number.value, one.number.unit)} ({number(one.number.lower)} to "
        f"{number(one.number.upper)}), where such a part has {number(one.least)} to {number(one.most)}"
        for one in cause.beyond
    )
    return f"{'; '.join(each)}: something else may act alike"


def _percent(share: float) -> str:
    """No more than all of it."""
    return "all" if share >= 0.9995 else f"{100.0 * share:.1f} %"


def _quoted(others: Sequence[Hypothesis]) -> str:
    return " and ".join(f"“{one.name}”" for one in others)


def _lines(found: Outcome) -> Iterator[str]:
    words = found.machine.words
    if found.location:
        entered = found.location.equation == "operating-point"  # acts in many places, as no one input does
        inputs = "" if entered else f" Of an unknown input there, {found.location.region}."
        yield (
            f"Where: {words.equation(found.location.equation)}{_part(found)}, seen most in "
            f"{found.location.signal}.{inputs}"
        )
        for one in found.inputs[:4]:
            yield f"  unknown input at {one.port}: ln evidence {one.evidence:.0f}, leaves {one.noise**2:.2f}"
    for cause in (*found.causes, *found.doubted):
        sure = "no recording was held out to say how sure that is"
        if found.judged_on == "validate":
            sure = f"credibility {cause.credibility:.3f}" if cause.rivals else uncontested(found)
        yield f"Cause: {named(found, cause)}; {sure}, form {cause.form}"
        for row in [
            row for one in (cause.hypothesis, *cause.curves) for row in of_hypothesis(found.final, one)
        ]:
            untold = "" if row.identifiable else ", not told by these recordings"
            between = f"95 %: {row.lower:.5g} to {row.upper:.5g}{untold}"
            yield f"  {row.name} = {row.value:.5g} {row.unit} ({between})"
        if doubt(cause):
            yield f"  {doubt(cause)}"
        if cause.not_separable_from:
            yield f"  Not separable from {', '.join(one.label for one in cause.not_separable_from)}."
        if cause.alone is not None:
            yield f"  by the catalogue's law alone: leaves {cause.alone:.3g}"
        for hypotheses, share, left in cause.rivals:
            names = " and ".join(hypothesis.label for hypothesis in hypotheses) or "nothing added"
            yield f"  rival {names}: credibility {share:.3f}, leaves {left:.3g}"
    yield (
        f"Held out: mean square {found.baseline.reduced_chi2:.3g} before, "
        f"{found.final.reduced_chi2:.3g} after; "
        f"worst channel {found.baseline.worst.mean_square:.3g} before, "
        f"{found.final.worst.mean_square:.3g} after."
    )
    if led(found):
        yield f"{capital(led(found))}."
    if found.untestable:
        yield f"Untestable here: {', '.join(dict.fromkeys(one.label for one in found.untestable))}."
    yield from (caution.sentence for caution in found.findings.cautions)
    yield found.deficiency[1].sentence
    yield from (one.sentence for one in found.regimes if one.agree is False)
    for group in found.groups:
        if not group.asked:
            yield f"Left out {group.group}: not asked, the others do not tell what it depends on."
            continue
        verb = "holds" if group.holds else "does not hold"
        yield (
            f"Left out {group.group}: {verb}, mean square {group.before:.3g} -> {group.after:.3g}, fitted "
            f"alone {group.alone:.3g}"
        )
    if found.outlying_groups:
        yield f"Fits no law that fits the others: {', '.join(found.outlying_groups)}."
    if found.next_recording:
        yield f"Next recording ({COMMAND}): {found.next_why}."
    yield "Seconds: " + ", ".join(f"{name} {seconds:.1f}" for name, seconds in found.seconds.items())
