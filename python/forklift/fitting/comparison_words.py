"""A comparison in one plain sentence per lift: how good the fit is and where it is poor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from forklift.base.derivative import WINDOW
from forklift.base.numbers import amount
from forklift.plant.forklift.phases import IN_WORDS
from forklift.recordings.channels import Lift, commanded

if TYPE_CHECKING:
    from forklift.fitting.compare import Comparison


def sentence(comparison: Comparison, lift: Lift) -> str | None:
    """The fit of the lift's velocity, its worst recording and phase, and its poorest other signal.

    Over the recordings of `Comparison.validation`. If none of them has a velocity that can be judged: why,
    and how well the other signals fit. None if no recording commands the lift.
    """
    table = comparison.validation(lift).drop_nulls("nrmse_percent")
    if not len(table):
        return _without_velocity(comparison, lift)
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


def _without_velocity(comparison: Comparison, lift: Lift) -> str | None:
    moved = [found for found in comparison.predictions if lift in commanded(found.recording.lift)]
    if not moved:
        return None
    channels = [f"position_{lift}_m"]
    if any(found.recording.lift == lift for found in moved):
        channels.insert(0, "fork_height_m")
    finite = [
        int(np.isfinite(values).sum())
        for found in moved
        for name in channels
        if (values := found.recording.channels.get(name)) is not None
    ]
    if len(comparison.validation(lift)):
        why = "it is measured as constant throughout"
    elif not any(finite):
        why = f"no recording of it has {' or '.join(channels)}"
    else:
        why = f"no recording of it has {WINDOW} samples of {' or '.join(channels)} without a gap"
    means = (
        comparison.fits.filter((pl.col("lift") == lift) & pl.col("commanded"))
        .filter(~pl.col("channel").str.starts_with("velocity"))
        .drop_nulls("nrmse_percent")
        .group_by("channel", maintain_order=True)
        .agg(pl.col("nrmse_percent").mean())
    )
    fits = ", ".join(f"{name} to {_fit(value)}" for name, value in means.iter_rows())
    others = f"the other signals fit on average (NRMSE): {fits}" if fits else "no other signal can be either"
    return f"{lift.capitalize()} lift: no velocity can be judged: {why}; {others}."


def _fit(percent: float) -> str:
    """A fit [%], and in words where it is negative."""
    return f"{percent:.1f} %{', worse than its mean' if percent < 0 else ''}"


def _phase(comparison: Comparison, lift: Lift) -> str:
    most = comparison.where(lift).row(0, named=True)
    if not np.isfinite(most["share_of_misfit"]):
        return ""
    return (
        f"; {100 * most['share_of_misfit']:.0f} % of its misfit lies in {IN_WORDS[most['phase']]} "
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
        f"; the poorest other signal is {poorest['channel']} in {poorest['file']}, with an NRMSE fit of "
        f"{_fit(poorest['nrmse_percent'])} (RMSE {amount(poorest['rmse'], poorest['unit'])})"
    )
