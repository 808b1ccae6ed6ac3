"""Results in a notebook: the verdict and a short table, not the whole page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forklift.base.typeset import capital
from forklift.diagnosis.sentences import told_as
from forklift.report.answers import sizes
from forklift.report.fits import operating_points
from forklift.report.instead import said
from forklift.report.page import fragment

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from forklift.base.cell import Celled
    from forklift.diagnosis.result import Diagnosis
    from forklift.fitting.compare import Comparison
    from forklift.fitting.fit import Fit
    from forklift.report.blocks import Table


def of_diagnosis(found: Diagnosis) -> str:
    """The sentence, and each cause with its size; a credibility where something was fitted against it."""
    rows = []
    for cause, row in zip(found.causes, found.to_dict()["causes"], strict=True):
        known = told_as(found, cause.hypothesis)
        rows.append(
            [
                capital(known.clause) if known.clause else said(found, cause.hypothesis),
                known.interval or "; ".join(sizes(row)) or "—",
                f"{cause.credibility:.2f}" if cause.rivals else "no rival",
                cause.form,
                ", ".join(said(found, one) for one in cause.not_separable_from) or "—",
            ]
        )
    head = ["Cause", "Size", "Credibility", "Form", "Not separable from"]
    return _summary([found.sentence], [(head, rows)] if rows else [])


def of_fit(fit: Fit) -> str:
    """The first sentence, and how well each operating point fits before and after."""
    sides = fit.before.agreement, fit.after.agreement
    return _summary(fit.sentences[:1], _tables(operating_points(fit.machine, *sides, fit.sensors)))


def of_comparison(comparison: Comparison) -> str:
    """The verdict, and how well each operating point fits."""
    tables = operating_points(comparison.machine, None, comparison.agreement, {})
    return _summary(comparison.sentences, _tables(tables))


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
