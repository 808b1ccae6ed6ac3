"""Every suspect that a diagnosis considered, of any machine: what it promised, and what became of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from forklift.diagnosis.causes import Cause
from forklift.diagnosis.hypothesis import Suspect
from forklift.diagnosis.screening import Screened, Screening
from forklift.diagnosis.selection import Selection

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import Diagnosis
    from forklift.diagnosis.refit import Trial

Untold = Literal["", "one-value", "no-trace", "any-size"]
"""Why these recordings tell nothing of a suspect: a condition has the same value in all of them; nothing that
was measured answers to it; so little does that its size may be anything plausible. Empty: they do tell."""


@dataclass(frozen=True, eq=False)
class Considered:
    """One suspect, wherever it acts."""

    suspect: Suspect
    promised: float | None
    """How far −ln posterior would fall with it, by a linear step from the fitted truck; None if not asked."""
    untold: Untold
    fitted: Trial | None
    """The smallest set of suspects with it that was fitted."""
    named: bool

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "id": self.suspect.id,
            "kind": self.suspect.kind,
            "name": self.suspect.name,
            "where": self.suspect.where,
            "promised": self.promised,
            "untold": self.untold,
            "fitted": self.fitted is not None,
            "left_over": self.fitted.left_over if self.fitted else None,
            "beside": [one.label for one in self.fitted.suspects if one is not self.suspect]
            if self.fitted
            else [],
            "named": self.named,
        }


def considered(found: Diagnosis) -> list[Considered]:
    """Of a truck's diagnosis."""
    return collected(found.selection, found.screening, found.causes, found.untold, bool(found.unexcited))


def collected(
    selection: Selection,
    screening: Screening,
    causes: Sequence[Cause],
    one_value: Sequence[Suspect] = (),
    unexcited: bool = False,
) -> list[Considered]:
    """Each once: those named first, then by what they promised, then those that could not be told.

    `one_value`: what was not asked, for its condition never changes; `unexcited`: nothing moved at all.
    """
    found = [*_each(selection, screening, causes, one_value, unexcited)]
    every = {one.suspect.label: one for one in reversed(found)}
    return sorted(every.values(), key=lambda one: (not one.named, bool(one.untold), -(one.promised or 0.0)))


def _each(
    selection: Selection,
    screening: Screening,
    causes: Sequence[Cause],
    one_value: Sequence[Suspect],
    unexcited: bool,
) -> Iterator[Considered]:
    """The first of each label counts."""
    trials = [trial for step in selection.steps for trial in step.trials]
    trials.sort(key=lambda trial: len(trial.suspects))
    by_label: dict[str, Trial] = {}
    for trial in [*trials, *selection.unnamed]:
        for suspect in trial.suspects:
            by_label.setdefault(suspect.label, trial)
    named = {cause.suspect.label for cause in causes}

    def one(suspect: Suspect, promised: float | None, untold: Untold) -> Considered:
        return Considered(suspect, promised, untold, by_label.get(suspect.label), suspect.label in named)

    def told(screened: Screened) -> Untold:
        return "any-size" if unexcited or not screened.testable else ""

    for screened in screening.singles:
        yield one(screened.suspects[0], screened.gain, told(screened))
    for suspect in screening.untestable:
        yield one(suspect, None, "no-trace")
    for suspect in one_value:
        yield one(suspect, None, "one-value")
    for cause in causes:  # what has no name, and what was seen before any fit
        yield one(cause.suspect, None, "")
