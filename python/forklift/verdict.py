"""A comparison in one plain sentence per lift: how good the fit is and where it is poor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from forklift.names import Lift, amount

if TYPE_CHECKING:
    from forklift.compare import Comparison

_PHASES = {
    "start": "starts",
    "step change": "step changes",
    "steady": "steady lowering",
    "stop": "stops",
    "hold": "holding still",
}


def sentence(comparison: Comparison, lift: Lift) -> str | None:
    """The fit of the lift's velocity, its worst recording and phase, and its poorest other signal.

    Over the recordings of `Comparison.validation`; None if there are none.
    """
    table = comparison.validation(lift).drop_nulls("nrmse_percent")
    if not len(table):
        return None
    role = "validate" if (table["role"] == "validate").all() else "estimate"
    count = f"{len(table)} {role} recording{'s' if len(table) > 1 else ''}"
    mean = float(np.mean(table["nrmse_percent"].to_numpy()))
    if len(table) > 1:
        worst = table.sort("nrmse_percent").row(0, named=True)
        text = (
            f"{lift.capitalize()} lift: the velocity fits to {mean:.1f} % on average (NRMSE, {count}), "
            f"worst to {worst['nrmse_percent']:.1f} % in {worst['file']}"
        )
    else:
        text = f"{lift.capitalize()} lift: the velocity fits to {mean:.1f} % (NRMSE, {count})"
    return f"{text}{_phase(comparison, lift)}{_other(comparison, lift, table['file'])}."


def _phase(comparison: Comparison, lift: Lift) -> str:
    most = comparison.where(lift).row(0, named=True)
    if not np.isfinite(most["share_of_misfit"]):
        return ""
    return (
        f"; {100 * most['share_of_misfit']:.0f} % of its misfit lies in {_PHASES[most['phase']]} "
        f"({100 * most['share_of_time']:.0f} % of the time)"
    )


def _other(comparison: Comparison, lift: Lift, files: pl.Series) -> str:
    others = comparison.fits.filter(
        (pl.col("lift") == lift)
        & pl.col("commanded")
        & pl.col("file").is_in(files.implode())
        & ~pl.col("channel").str.starts_with("velocity")
        & pl.col("nrmse_percent").is_not_null()
    ).sort("nrmse_percent")
    if not len(others):
        return ""
    poorest = others.row(0, named=True)
    return (
        f"; the poorest other signal is {poorest['channel']} in {poorest['file']}, "
        f"{poorest['nrmse_percent']:.1f} % (RMSE {amount(poorest['rmse'], poorest['unit'])})"
    )
