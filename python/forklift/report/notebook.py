"""Results in a notebook: the verdict and a short table, not the whole page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forklift.diagnosis.numbers import of_hypothesis
from forklift.report import words
from forklift.report.answers import said
from forklift.report.fits import operating_points
from forklift.report.page import fragment

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from forklift.base.cell import Celled
    from forklift.diagnosis.result import Diagnosis
    from forklift.fitting.compare import Comparison
    from forklift.fitting.fit import Fit
    from forklift.report.blocks import Table


def of_diagnosis(found: Diagnosis) -> str:
    """The sentence, and each cause with its size and credibility."""
    rows = []
    for cause in found.causes:
        first = next(of_hypothesis(found.final, cause.hypothesis), None)
        size = "—"
        if first:
            value, lower, upper = words.size(first.value, first.lower, first.upper)
            size = f"{first.name} = {value} {words.printed(first.unit)} ({lower} to {upper})"
        rows.append(
            [said(found, cause.hypothesis), size, f"{cause.credibility:.2f}", cause.form,
             ", ".join(said(found, one) for one in cause.not_separable_from) or "—"]
        )  # fmt: skip
    head = ["Cause", "Size (95 % interval)", "Credibility", "Form", "Not separable from"]
    return _summary([found.sentence], [(head, rows)] if rows else [])


def of_fit(fit: Fit) -> str:
    """The first sentence, and how well each operating point fits before and after."""
    sides = fit.before.agreement, fit.after.agreement
    return _summary(fit.verdict[:1], _tables(operating_points(fit.machine, *sides, fit.sensors)))


def of_comparison(comparison: Comparison) -> str:
    """The verdict, and how well each operating point fits."""
    tables = operating_points(comparison.machine, None, comparison.agreement, {})
    return _summary(comparison.verdict, _tables(tables))


def of_cell(one: Celled) -> str:
    """Its own sentences and table."""
    told = one.cell()
    return _summary(told.sentences, [(told.heads, told.rows)] if told.rows else [])


def _tables(tables: Iterable[Table]) -> list[tuple[Sequence[str], Sequence[Sequence[object]]]]:
    return [(table.head, table.rows) for table in tables]


def _summary(
    sentences: Sequence[str], tables: Sequence[tuple[Sequence[str], Sequence[Sequence[object]]]]
) -> str:
    return fragment("summary.html", sentences=sentences, tables=tables)
