"""What the selection comes to: the causes, how credible each is, and what cannot be told from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Literal

from forklift.diagnosis.criteria import (
    ANOTHER_SHAPE,
    AS_GOOD,
    AS_NEAR,
    LIKELY,
    NAMED_RIGHTLY,
)
from forklift.diagnosis.numbers import Number, of_hypothesis
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.rules import credibility, labels, lost
from forklift.diagnosis.selected import Selection
from forklift.plant.protocol import Hypothesis

Form = Literal["complete", "uncertain"]


@dataclass(frozen=True)
class Beyond:
    """A number whose whole interval lies outside of what any such part has."""

    number: Number
    least: float
    most: float


@dataclass(frozen=True)
class Cause:
    """One accepted explanation."""

    hypothesis: Hypothesis
    share: float
    """Share of resampled sets of recordings in which this, or what cannot be told from it, explains best."""
    form: Form
    not_separable_from: tuple[Hypothesis, ...]
    rivals: tuple[tuple[tuple[Hypothesis, ...], float, float], ...]
    """What else was tried: hypotheses, their share, and the mean square they leave over."""
    curve: Hypothesis | None = None
    """A free shape that mends its law, as part of the final model."""
    twin: Hypothesis | None = None
    """Of what acts on the whole machine: the same shape on another part of it."""
    by_all: bool = False
    """Whether the share is of how all recordings foretell each other, as none shows it alone. With
    any law nothing is left over then, as without it: the form of an effect is uncertain."""
    alone: float | None = None
    """Mean square that it leaves over by the catalogue's law alone, where a curve mends it."""
    beyond: tuple[Beyond, ...] = ()
    """Its numbers that no such part has: then something else may act alike, and its form is uncertain."""
    beside: tuple[Hypothesis, ...] = ()
    """Other causes of which that is so: what explains everything only with them is not settled either."""
    mending: tuple[Hypothesis, ...] = ()
    """Other causes in the same equation, or conditions beside effects, where one of both shows in no
    recording alone: what hardly shows may make up for a law of another shape."""
    unnamed: tuple[Hypothesis, ...] = ()
    """What acts on the same part without a name: a law that nobody knows may bend its own."""
    nearly: tuple[tuple[Hypothesis, ...], float] | None = None
    """The rival that removes nearly all that it removes, with that share: a law a little unlike the
    catalogue's would make it as good."""

    @property
    def credibility(self) -> float:
        """How likely it is that its name is right: `share`; where its form is uncertain, less what is left
        for a law that was not tried. What has no name claims none."""
        named = self.hypothesis.kind != "unknown"
        return self.share * NAMED_RIGHTLY if named and self.form == "uncertain" else self.share

    @property
    def curves(self) -> tuple[Hypothesis, ...]:
        """All free shapes that mend its law."""
        return tuple(one for one in (self.curve, self.twin) if one)


def causes(selection: Selection) -> tuple[Cause, ...]:
    """The hypotheses of the final model in the order in which they were accepted."""
    found: list[Cause] = []
    final, before = selection.final, selection.baseline
    form: Form = "complete" if final.complete and selection.curve is None else "uncertain"
    for step in selection.steps:
        if step.accepted is None:
            continue
        accepted, known = step.accepted, {cause.hypothesis.label for cause in found}
        own = labels(accepted)
        refits = _rivals(step.refits, accepted)
        shares = dict(zip(refits, credibility(refits), strict=True))
        rivals = tuple(
            (_new(refit, known), shares[refit], refit.reduced_chi2)
            for refit in refits
            if labels(refit) != own
        )
        all_lost = dict(zip(refits, (sum(one.values()) for one in lost(refits)), strict=True))
        alike = tuple(
            dict.fromkeys(
                hypothesis
                for refit in refits
                if refit is not accepted
                and (refit.complete or (refit.finished and not accepted.complete))
                and (shares[refit] > AS_GOOD or all_lost[refit] - all_lost[accepted] < AS_NEAR)
                for hypothesis in _new(refit, known)
                if hypothesis.label not in own
            )
        )
        tied = {hypothesis.label for hypothesis in alike}
        credible = shares[accepted] + sum(
            shares[refit]
            for refit in refits
            if refit is not accepted
            and (own <= labels(refit) or {one.label for one in _new(refit, known)} <= tied)
        )
        for hypothesis in _new(accepted, known):
            if hypothesis in final.hypotheses and hypothesis.kind != "unknown":
                by_all = all(refit.foretold is not None for refit in refits)
                outside = beyond(final, hypothesis)
                nearly = _nearly(hypothesis, step.refits, accepted, before)
                untested = by_all and hypothesis.kind == "physics"
                own_form: Form = "uncertain" if outside or nearly or untested else form
                cause = Cause(
                    hypothesis, credible, own_form, alike, rivals,
                    by_all=by_all, beyond=outside, nearly=nearly,
                )  # fmt: skip
                curve = _curve(hypothesis, selection)
                if curve:
                    twin = _twin(hypothesis, curve, selection)
                    cause = replace(
                        cause, form="uncertain", curve=curve, twin=twin, alone=accepted.reduced_chi2
                    )
                found.append(cause)
        before = accepted
    doubtful = tuple(cause.hypothesis for cause in found if cause.beyond)
    if doubtful:
        found = [
            cause if cause.beyond else replace(cause, form="uncertain", beside=doubtful) for cause in found
        ]
    found = [_beside_its_like(cause, found) for cause in found]
    curves = {one for cause in found for one in cause.curves}
    unnamed = [one for one in final.hypotheses if one.kind == "unknown" and one not in curves]
    found = [_beside_unnamed(cause, unnamed) for cause in found]
    return (*found, *(_unnamed(hypothesis, selection) for hypothesis in unnamed))


def _nearly(
    own: Hypothesis, refits: Sequence[Refit], accepted: Refit, before: Refit
) -> tuple[tuple[Hypothesis, ...], float] | None:
    """The rival without it that removes most, if that is `ANOTHER_SHAPE` of what was removed with it. What
    has a freedom in every recording follows anything, and has no law that could be another."""
    gained = before.reduced_chi2 - accepted.reduced_chi2
    known = labels(before)
    near = [
        (names, (before.reduced_chi2 - refit.reduced_chi2) / gained)
        for refit in _rivals(refits, accepted)
        if gained > 0.0 and (names := _new(refit, known)) and own.label not in labels(refit)
        if all(one.amplitude is not None and one.kind != "unknown" for one in names)
    ]
    best = max(near, key=lambda one: one[1], default=None)
    return best if best and best[1] >= ANOTHER_SHAPE else None


def _beside_its_like(cause: Cause, found: Sequence[Cause]) -> Cause:
    """The same; uncertain, if one of it and another may make up for the shape of the other's law: two effects
    in one equation, or an effect and a condition, on which any law may depend, if one of both shows in no
    recording alone."""
    own = cause.hypothesis

    def mends(other: Cause) -> bool:
        one = other.hypothesis
        kinds = {own.kind, one.kind}
        alike = kinds == {"physics"} and (one.where, one.equation) == (own.where, own.equation)
        return (alike or kinds == {"physics", "parameter"}) and (cause.by_all or other.by_all)

    others = tuple(other.hypothesis for other in found if other is not cause and mends(other))
    return replace(cause, form="uncertain", mending=others) if others else cause


def _beside_unnamed(cause: Cause, unnamed: Sequence[Hypothesis]) -> Cause:
    """The same; uncertain, if it is complete only with what acts unnamed on its part. A sensor has no law."""
    own = cause.hypothesis
    others = tuple(one for one in unnamed if not one.where or own.where in (one.where, ""))
    return replace(cause, form="uncertain", unnamed=others) if others and own.kind != "sensor" else cause


def beyond(final: Refit, hypothesis: Hypothesis) -> tuple[Beyond, ...]:
    """Of the numbers that it brings, those beyond what is plausible of them, with all of their interval. The
    amplitude only if it has gone to its bound: a part that fails may leak more than any other does, but a
    leak that the recordings would have greater than any leak is something else."""
    ends = {
        name: (least, most)
        for name, least, most in hypothesis.plausible
        if name != hypothesis.amplitude or name in final.at_bounds
    }
    if not ends:
        return ()
    return tuple(
        Beyond(one, *ends[one.name])
        for one in of_hypothesis(final, hypothesis)
        if one.name in ends and (one.upper < ends[one.name][0] or one.lower > ends[one.name][1])
    )


def told(found: Sequence[Cause]) -> tuple[Cause, ...]:
    """Those that are more likely than not, with all that cannot be told from them."""
    return tuple(cause for cause in found if cause.credibility >= LIKELY)


def _curve(named: Hypothesis, selection: Selection) -> Hypothesis | None:
    """The curve of the final model that mends the law of a name: put to its test, or at the same place. What
    acts on the whole machine acts on each part of it."""
    tested = selection.curve.hypotheses if selection.curve else ()

    def at_its_place(one: Hypothesis) -> bool:
        return bool(one.over) and one.equation in named.equations and named.where in (one.where, "")

    return next((one for one in selection.final.hypotheses if one in tested or at_its_place(one)), None)


def _twin(named: Hypothesis, curve: Hypothesis, selection: Selection) -> Hypothesis | None:
    """The same curve on another part, if the name acts on the whole machine."""
    alike = [
        one
        for one in selection.final.hypotheses
        if one is not curve and (one.kind, one.name, one.equation) == (curve.kind, curve.name, curve.equation)
    ]
    return alike[0] if alike and not named.where else None


def _unnamed(hypothesis: Hypothesis, selection: Selection) -> Cause:
    """What has no name has no form of its own: nobody knows its law. A name whose amplitude came to nothing
    when it was fitted is no rival, whatever a linear step promises of it."""
    final = selection.final
    others = [*selection.steps[0].refits, *selection.unnamed]
    told = [one for one in others if one.finished and isfinite(one.reduced_chi2) and one.identifiable]
    refits = [final, *(one for one in told if not labels(final) <= labels(one))]
    shares = credibility(refits)
    rivals = tuple(
        (_new(refit, set()), share, refit.reduced_chi2) for refit, share in zip(refits, shares, strict=True)
    )
    return Cause(hypothesis, shares[0], "uncertain", (), rivals[1:])


def _rivals(refits: Sequence[Refit], accepted: Refit) -> list[Refit]:
    """Those that were fitted to the end as it was: who was stopped on the way has lost already, and what it
    leaves over there tells nothing; nor does one that ended in no number. What contains a complete
    explanation and more is no rival of it."""

    def rival(refit: Refit) -> bool:
        more = accepted.complete and labels(accepted) < labels(refit)
        return refit.finished and isfinite(refit.reduced_chi2) and not more

    return [refit for refit in refits if refit is accepted or rival(refit)]


def _new(refit: Refit, known: set[str]) -> tuple[Hypothesis, ...]:
    return tuple(hypothesis for hypothesis in refit.hypotheses if hypothesis.label not in known)
