"""What the selection comes to: the causes, how credible each is, and what cannot be told from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from forklift.diagnosis.hypothesis import Suspect
from forklift.diagnosis.refit import Trial
from forklift.diagnosis.selection import AS_NEAR, Selection, credibility

AS_GOOD = 0.05
"""Credibility from which on a rival that leaves nothing over cannot be told from the cause."""


Form = Literal["complete", "uncertain"]


@dataclass(frozen=True)
class Cause:
    """One accepted explanation."""

    suspect: Suspect
    credibility: float
    form: Form
    not_separable_from: tuple[Suspect, ...]
    rivals: tuple[tuple[tuple[Suspect, ...], float, float], ...]
    """What else was tried: suspects, credibility, and the mean square they leave over."""
    curve: Suspect | None = None
    """A free shape that mends its law, as part of the final model."""
    alone: float | None = None
    """Mean square that it leaves over by the catalogue's law alone, where a curve mends it."""


def causes(selection: Selection) -> tuple[Cause, ...]:
    """The suspects of the final model in the order in which they were accepted."""
    found: list[Cause] = []
    final = selection.final
    form: Form = "complete" if final.complete and selection.curve is None else "uncertain"
    for step in selection.steps:
        if step.accepted is None:
            continue
        accepted, known = step.accepted, {cause.suspect.label for cause in found}
        own = _labels(accepted)
        trials = _rivals(step.trials, accepted)
        shares = dict(zip(trials, credibility(trials), strict=True))
        rivals = tuple(
            (_new(trial, known), shares[trial], trial.left_over) for trial in trials if _labels(trial) != own
        )
        least = sum(accepted.by_recording().values())
        alike = tuple(
            dict.fromkeys(
                suspect
                for trial in trials
                if trial is not accepted
                and (trial.complete or (trial.finished and not accepted.complete))
                and (shares[trial] > AS_GOOD or sum(trial.by_recording().values()) - least < AS_NEAR)
                for suspect in _new(trial, known)
                if suspect.label not in own
            )
        )
        credible = shares[accepted] + sum(
            shares[trial] for trial in trials if trial is not accepted and own <= _labels(trial)
        )
        for suspect in _new(accepted, known):
            if suspect in final.suspects:
                cause = Cause(suspect, credible, form, alike, rivals)
                curve = _curve(suspect, selection)
                if curve:
                    cause = replace(cause, form="uncertain", curve=curve, alone=accepted.left_over)
                found.append(cause)
    curves = {cause.curve for cause in found}
    found += [
        _unnamed(suspect, selection)
        for suspect in final.suspects
        if suspect.kind == "unknown" and suspect not in curves
    ]
    return tuple(found)


def _curve(named: Suspect, selection: Selection) -> Suspect | None:
    """The curve of the final model that mends the law of a name: put to its test, or at the same place."""
    tested = selection.curve.suspects if selection.curve else ()
    place = named.where, named.equation
    return next(
        (
            one
            for one in selection.final.suspects
            if one in tested or (one.over and (one.where, one.equation) == place)
        ),
        None,
    )


def _unnamed(suspect: Suspect, selection: Selection) -> Cause:
    """What has no name has no form of its own: nobody knows its law."""
    final = selection.final
    others = [*selection.steps[0].trials, *selection.unnamed]
    trials = [final, *(one for one in others if not _labels(final) <= _labels(one))]
    shares = credibility(trials)
    rivals = tuple(
        (_new(trial, set()), share, trial.left_over) for trial, share in zip(trials, shares, strict=True)
    )
    return Cause(suspect, shares[0], "uncertain", (), rivals[1:])


def _rivals(trials: Sequence[Trial], accepted: Trial) -> list[Trial]:
    """What contains a complete explanation and more is no rival of it."""
    return [
        trial
        for trial in trials
        if trial is accepted or not (accepted.complete and _labels(accepted) < _labels(trial))
    ]


def _labels(trial: Trial) -> set[str]:
    """One suspect may have been tried from several places: they are one by their label."""
    return {suspect.label for suspect in trial.suspects}


def _new(trial: Trial, known: set[str]) -> tuple[Suspect, ...]:
    return tuple(suspect for suspect in trial.suspects if suspect.label not in known)
