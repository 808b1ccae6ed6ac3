"""How well each operating point fits, laid out as Tables 5.4 and 5.5 of the thesis that the model is from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forklift.fitting.compare import validation_change
from forklift.recordings.channels import LIFTS, Lift
from forklift.report.blocks import Table
from forklift.report.tables import change_rows, validation_rows

if TYPE_CHECKING:
    import polars as pl

    from forklift.fitting.compare import Comparison

THESIS = "Fri & Fahlén (2017)"
FITS = (
    "100 % is perfect; 0 % is no better than the measured velocity's mean. NMSE and NRMSE are (3.39) and "
    f"(3.40) of {THESIS}."
)
FOLDED = " NMSE, which the thesis gives too, stands below under “Every recording and signal”."


def gains(before: Comparison, after: Comparison) -> list[Table]:
    """One table per lift: each operating point's fit of the velocity, before and after."""
    return [
        _gain(validation_change(before, after, lift), lift) for lift in LIFTS if len(after.validation(lift))
    ]


def _gain(table: pl.DataFrame, lift: Lift) -> Table:
    gained = (table["nrmse_percent_after"] - table["nrmse_percent_before"]).to_list()
    rows = [
        [*cells[:2], cells[3], "—" if gain is None else f"{gain:+.1f}", cells[4]]
        for cells, gain in zip(change_rows(table), gained, strict=True)
    ]
    return Table(
        f"Velocity of the {lift} lift, before → after, {_like(lift)}{_judged(table)}",
        ["Oil [°C]", "Load [kg]", "Fit (NRMSE) [%]", "Gain (NRMSE)", "Recording"],
        rows,
        [True, True, True, True, False],
        note=FITS + FOLDED,
    )


def validation(comparison: Comparison) -> list[Table]:
    """One table per lift: each operating point's fit of the velocity."""
    return [
        Table(
            f"Velocity of the {lift} lift, {_like(lift)}{_judged(table)}",
            ["Oil [°C]", "Load [kg]", "Fit (NMSE) [%]", "Fit (NRMSE) [%]", "Recording"],
            validation_rows(table),
            [True, True, True, True, False],
            note=FITS,
        )
        for lift in LIFTS
        if len(table := comparison.validation(lift))
    ]


def _like(lift: Lift) -> str:
    return f"laid out as Table {'5.4' if lift == 'free' else '5.5'} of {THESIS}"


def _judged(table: pl.DataFrame) -> str:
    return "" if (table["role"] == "validate").all() else " (no recordings are held out, so all of them)"
