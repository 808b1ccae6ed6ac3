"""What a selection came to, round by round."""

from __future__ import annotations

from dataclasses import dataclass

from forklift.diagnosis.refit import Refit
from forklift.diagnosis.rules import explains
from forklift.diagnosis.screening import Screened, Screening
from forklift.plant.protocol import Hypothesis


@dataclass(frozen=True, eq=False)
class Step:
    """One round: what was screened, who was tried, who was accepted."""

    screening: Screening
    refits: tuple[Refit, ...]
    """Those that explain everything first, then by what they leave over."""
    accepted: Refit | None


@dataclass(frozen=True, eq=False)
class Selection:
    """All rounds."""

    baseline: Refit
    steps: tuple[Step, ...]
    final: Refit
    """The last that was accepted, without hypotheses that it does not need."""
    unnamed: tuple[Refit, ...] = ()
    """What was tried that has no name."""
    curve: Screened | None = None
    """Of one name that explains everything: a curve that promises to mend its law, whether or not recordings
    held out bear it out."""
    skipped: tuple[tuple[Hypothesis, ...], ...] = ()
    """What was not tried within the work that a diagnosis may do, see
    `forklift.diagnosis.criteria.BUDGET`."""

    @property
    def explains_most(self) -> bool:
        """Whether the last removes most of what the machine alone leaves over, or leaves next to nothing."""
        return self.final.quiet or explains(self.final, self.baseline)
