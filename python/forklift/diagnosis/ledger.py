"""Every hypothesis that a diagnosis considered, of any machine: what it promised, and what became of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from typing import TYPE_CHECKING, Any, Literal

from forklift.diagnosis.causes import Cause
from forklift.diagnosis.criteria import LEAST_FAULT, alarm
from forklift.diagnosis.screening import Screened, Screening
from forklift.diagnosis.selected import Selection
from forklift.plant.protocol import Hypothesis

if TYPE_CHECKING:
    from forklift.diagnosis.outcome import Outcome
    from forklift.diagnosis.refit import Refit

Untold = Literal["", "one-value", "no-trace", "any-size"]
"""Why these recordings tell nothing of a hypothesis: a condition has the same value in all of them; nothing
that was measured answers to it; so little does that its size may be anything plausible. Empty: they do
tell."""


@dataclass(frozen=True, eq=False)
class Considered:
    """One hypothesis, wherever it acts."""

    hypothesis: Hypothesis
    promised: float | None
    """How far −ln posterior would fall with it, by a linear step from the fitted truck; None if not asked."""
    unidentifiable: Untold
    fitted: Refit | None
    """The smallest set of hypotheses with it that was fitted to its end; if none was, that was begun."""
    named: bool
    skipped: bool = False
    """Whether it would have been tried, if the work that a diagnosis may do had lasted."""
    tried_from: tuple[float, str] | None = None
    """Where nothing is left over: the size of its amplitude from which on it would be tried; its unit."""

    @property
    def given_up(self) -> bool:
        """Whether every search with it was begun and given up, since it fell far behind."""
        return self.fitted is not None and not self.fitted.finished and not self.named

    def to_dict(self) -> dict[str, Any]:
        """For JSON; ``fitted``: to its end, ``left_over``: of what was given up, as it stood there;
        null where that is no number."""
        left = self.fitted.reduced_chi2 if self.fitted else None
        left = left if left is not None and isfinite(left) else None
        return {
            "id": self.hypothesis.id,
            "kind": self.hypothesis.kind,
            "name": self.hypothesis.name,
            "where": self.hypothesis.where,
            "promised": self.promised,
            "unidentifiable": self.unidentifiable,
            "fitted": self.fitted is not None and not self.given_up,
            "given_up": self.given_up,
            "left_over": left,
            "beside": [one.label for one in self.fitted.hypotheses if one.label != self.hypothesis.label]
            if self.fitted
            else [],
            "named": self.named,
            "skipped": self.skipped,
            "tried_from": self.tried_from
            and {
                "value": self.tried_from[0],
                "unit": self.tried_from[1],
                "promised": alarm(self.hypothesis),
            },
        }


def uncontested(found: Outcome) -> str:
    """Why a cause has no rival that was fitted to its end."""
    others = [one for one in considered(found) if one.fitted and not one.named]
    if others:
        return "no rival was fitted to its end"
    return "not contested: nothing else was fitted against it"


def considered(found: Outcome) -> list[Considered]:
    """Each once: those named first, then by what they promised, then those that could not be told."""
    unexcited = bool(found.findings.unexcited)
    nothing = found.verdict == "no-mismatch"
    each = [*_each(found.selection, found.screening, found.causes, found.unidentifiable, unexcited, nothing)]
    every = {one.hypothesis.label: one for one in reversed(each)}
    return sorted(
        every.values(), key=lambda one: (not one.named, bool(one.unidentifiable), -(one.promised or 0.0))
    )


def _each(
    selection: Selection,
    screening: Screening,
    causes: Sequence[Cause],
    one_value: Sequence[Hypothesis],
    unexcited: bool,
    nothing: bool,
) -> Iterator[Considered]:
    """The first of each label counts; `one_value`: what was not asked, for its condition never changes;
    `nothing`: whether nothing is left over."""
    refits = [refit for step in selection.steps for refit in step.refits]
    refits.sort(key=lambda refit: (not refit.finished, len(refit.hypotheses)))
    by_label: dict[str, Refit] = {}
    for refit in [*refits, *selection.unnamed]:
        for hypothesis in refit.hypotheses:
            by_label.setdefault(hypothesis.label, refit)
    named = {cause.hypothesis.label for cause in causes}
    missed = {one.label for several in selection.skipped for one in several} - set(by_label)

    def one(
        hypothesis: Hypothesis,
        promised: float | None,
        unidentifiable: Untold,
        tried_from: tuple[float, str] | None = None,
    ) -> Considered:
        return Considered(
            hypothesis,
            promised,
            unidentifiable,
            by_label.get(hypothesis.label),
            hypothesis.label in named,
            hypothesis.label in missed,
            tried_from,
        )

    def told(screened: Screened) -> Untold:
        return "any-size" if unexcited or not screened.testable else ""

    for screened in screening.singles:
        asked = nothing and not told(screened)
        yield one(
            screened.hypotheses[0], screened.gain, told(screened), _tried_from(screened) if asked else None
        )
    for hypothesis in screening.untestable:
        yield one(hypothesis, None, "no-trace")
    for hypothesis in one_value:
        yield one(hypothesis, None, "one-value")
    for cause in causes:  # what has no name, and what was seen before any fit
        yield one(cause.hypothesis, None, "")


def _tried_from(screened: Screened) -> tuple[float, str] | None:
    """Where a linear step promises what is asked for where nothing is left over; None of conditions.

    An amplitude a with the deviation σ beside all other unknowns promises a²/2σ².
    """
    hypothesis = screened.hypotheses[0]
    unknown = next((one for one in hypothesis.addition.free if one.name == hypothesis.amplitude), None)
    if unknown is None:
        return None
    step = screened.deviations[0] * sqrt(2.0 * alarm(hypothesis))
    if hypothesis.kind in ("sensor", "parameter"):
        step = max(step, LEAST_FAULT)
    if step > unknown.upper:
        return None
    return abs(float(unknown.values(step)[0]) - float(unknown.values(0.0)[0])), unknown.unit
