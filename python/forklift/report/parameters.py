"""Parameters with their intervals before and after, in numbers and as bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from forklift.diagnosis.numbers import half_widths
from forklift.fitting.fit_tables import PRIOR_QUANTILE
from forklift.fitting.intervals import QUANTILE
from forklift.fitting.widening import BIASED, widening
from forklift.report.blocks import Bar, Table
from forklift.report.tables import known, of_part, parameters_titled, parts_of
from forklift.report.words import capital, printed

if TYPE_CHECKING:
    from typing import Any

    from forklift.diagnosis.refit import Refit
    from forklift.diagnosis.result import Diagnosis
    from forklift.fitting.fit import Fit


BEFORE, AFTER = ["Before", "95 % before"], (["Fitted", "95 % interval"], ["After", "95 % after"])
"""Heads of columns; of what was fitted without a cause, and with one."""


def fitted(fit: Fit) -> list[Table]:
    """One table per part: what was known before the fit, and what is after it."""
    bars = dict(zip(fit.parameters["name"], _bars(fit), strict=True))
    tables, noun = [], fit.machine.words.noun
    for part in parts_of(fit):
        rows = [
            [
                row["name"], f"{row['start']:.5g}", f"{row['start_lower']:.3g} to {row['start_upper']:.3g}",
                f"{row['value']:.5g}", f"{row['lower']:.4g} to {row['upper']:.4g}", printed(row["unit"]),
                known(row), bars[row["name"]],
            ]
            for row in of_part(fit.parameters, part).iter_rows(named=True)
        ]  # fmt: skip
        if rows:
            tables.append(
                Table(
                    capital(parameters_titled(fit, part)),
                    ["Parameter", "Start", "95 % before", "Value", "95 % after", "Unit", "Identifiable", ""],
                    rows,
                    [False, True, True, True, True, False, False, False],
                    note="Bars: thin, 95 % before; thick, 95 % after; upright, the start."
                    + (
                        ""
                        if fit.complete
                        else f" Biased: the {noun} leaves something over; its interval is {BIASED}."
                    ),
                )
            )
    return tables


def _bars(fit: Fit) -> list[Bar]:
    """One per name, in the order of `Fit.parameters`."""
    bars = []
    for estimate, theta in zip(fit.knowledge.estimates, fit.found.x.tolist(), strict=False):
        half = QUANTILE * widening(fit.judged, estimate.name) * estimate.deviation
        bar = _bar(
            (-PRIOR_QUANTILE, PRIOR_QUANTILE),
            (theta - half, theta + half),
            f"{estimate.deviation:.2g} of the spread before",
        )
        bars += [bar] * len(estimate.unknown.names)
    return bars


def diagnosed(found: Diagnosis, rows: Sequence[Mapping[str, Any]]) -> list[Table]:
    """One table per part: the fitted machine's and the final one's; `rows` as the JSON has them."""
    changed, words = bool(found.final.hypotheses), found.machine.words
    parts = {one.part for one in found.machine.places if one.part}
    heads = [row["name"].partition(".")[0] if parts else "" for row in rows]
    order = [
        *(one for one in sorted(parts) if one in heads),
        *(one for one in dict.fromkeys(heads) if one not in parts),
    ]
    bars = changes(found.baseline if changed else None, found.final)
    return [
        table(
            f"Parameters of {words.part(head)}"
            if head in parts
            else f"Further: {head}"
            if head
            else "Parameters",
            [row for row, own in zip(rows, heads, strict=True) if own == head],
            bars,
            changed,
            folded=bool(head),
        )
        for head in order
    ]


def table(
    title: str,
    rows: Sequence[Mapping[str, Any]],
    bars: Mapping[str, Bar],
    changed: bool,
    *,
    folded: bool = True,
) -> Table:
    """Of any machine: start, before if `changed`, and after, with intervals."""
    return Table(
        title,
        ["Parameter", "Start", *BEFORE[: 2 * changed], *AFTER[changed], "Unit", ""],
        [[*_cells(row, changed), bars[row["name"]]] for row in rows],
        [False, True, *[True] * (4 if changed else 2), False, False],
        note="Intervals of 95 %. Upright: the start."
        if not changed
        else "Before: fitted without what was found; after: with it. Intervals of 95 %. They hold "
        "if the model is right, so those before do not if something was missing. Bars: thin, before; thick, "
        "after; upright, the start.",
        folded=folded,
    )


def _cells(row: Mapping[str, Any], changed: bool) -> list[str]:
    cells = [row["name"], f"{row['start']:.5g}"]
    for when in ("before", "after") if changed else ("after",):
        known = row[when]
        cells += (
            ["—", "—"]
            if known is None
            else [f"{known['value']:.5g}", f"{known['lower']:.4g} to {known['upper']:.4g}"]
        )
    return [*cells, printed(row["unit"])]


def changes(baseline: Refit | None, final: Refit) -> dict[str, Bar]:
    """By parameter, its intervals in the prior's deviations from the start."""
    sides: list[dict[str, tuple[float, float]]] = [{}, {}]
    for side, refit in zip(sides, (baseline, final), strict=True):
        if refit is None:
            continue
        widths, x = half_widths(refit).tolist(), refit.found.x.tolist()
        for estimate, half, theta in zip(refit.knowledge.estimates, widths, x, strict=False):
            side[estimate.name] = theta - half, theta + half
    before, after = sides
    return {
        name: _bar(before.get(name), after.get(name, before.get(name, (0.0, 0.0))), "")
        for name in {**before, **after}
    }


def _bar(before: tuple[float, float] | None, after: tuple[float, float], title: str) -> Bar:
    ends = [*(before or ()), *after, 0.0]
    least, most = min(ends), max(ends)
    width = (most - least) or 1.0

    def span(pair: tuple[float, float]) -> tuple[float, float]:
        return round(100.0 * (pair[0] - least) / width, 1), round(100.0 * (pair[1] - pair[0]) / width, 1)

    return Bar(title, before and span(before), span(after), round(100.0 * (0.0 - least) / width, 1))
