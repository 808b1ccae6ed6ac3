"""What else was tried, and where else something may act: of any machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from forklift.base.typeset import mean_square
from forklift.report import charts, words
from forklift.report.blocks import Bars, Table

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.plant.protocol import Hypothesis


@dataclass(frozen=True)
class Contest:
    """Causes that were found together, among their rivals."""

    causes: Sequence[Cause]
    without: str
    """What the model without it is."""
    before: float
    """Mean square that is left over without it."""
    after: float
    """The same with it."""
    title: str = "What each explanation leaves over"


def contests(
    found: Sequence[Contest], said: Callable[[Hypothesis], str], rest: str = f"; {words.REST}"
) -> Iterator[Bars]:
    """Of each contest, what its causes and their rivals leave over.

    `said`: a hypothesis in words; `rest`: why an average may lie below 1.
    """
    for one in found:
        cause = one.causes[0]
        named = " and ".join(said(cause.hypothesis) for cause in one.causes)
        whole = f"{named} with a curve beside it" if cause.curve else named
        alone = (
            [] if cause.alone is None else [(f"{named} by the catalogue's law alone", cause.alone, "rival")]
        )
        bars = [
            (one.without, one.before, "before"),
            (
                f"{whole}: {f'credibility {cause.credibility:.2f}' if cause.rivals else 'no rival'}",
                one.after,
                "after",
            ),
            *alone,
            *(
                (f"{' and '.join(map(said, hypotheses))}: credibility {credible:.2f}", left, "rival")
                for hypotheses, credible, left in sorted(cause.rivals, key=lambda one: one[2])
            ),
        ]
        yield charts.reduced_chi2(
            one.title,
            bars,
            f"On average over all signals held out, {words.NOISE}{rest}."
            + (
                " Rivals that fell far behind on the way were stopped early, so that theirs may be a little "
                "too much."
                if cause.rivals
                else " No rival was fitted beside it."
            ),
        )


def places(rows: Sequence[tuple[str, float, float]]) -> list[Table]:
    """An unknown input at every place: the place in words, ln evidence, mean square left over."""
    if not rows:
        return []
    return [
        Table(
            "Where an unknown influence would explain most",
            ["Place", "ln evidence", "Left over"],
            [[place, f"{evidence:.0f}", mean_square(left)] for place, evidence, left in rows],
            [False, True, True],
            note="Without knowing any cause: an influence that may vary freely in time is put at each place "
            "in turn. The greater the evidence, the better the recordings are explained; a difference of 5 "
            "is strong. Left over: mean square in units of the sensors' noise.",
            folded=True,
        )
    ]
