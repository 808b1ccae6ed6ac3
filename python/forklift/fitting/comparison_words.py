"""A comparison in one plain sentence per headline: how good the fit is and where it is poor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from forklift.base.numbers import amount
from forklift.base.typeset import capital

if TYPE_CHECKING:
    from forklift.fitting.compared import Compared
    from forklift.plant.subject import Words


def sentences(comparison: Compared) -> tuple[str, ...]:
    """Of each part its headlines, or why there is none."""
    machine = comparison.machine
    driven = {part for one in comparison.predictions for part in machine.driven(one.recording)}
    said = []
    for part in sorted(driven):
        own = [channel for whose, channel in comparison.headlines if whose == part]
        told = [text for channel in own if (text := _sentence(comparison, part, channel))]
        said += told or [_without(comparison, part)]
    return tuple(said)


def named(words: Words, channel: str) -> str:
    """A channel at the start of a sentence."""
    name = words.signal(channel)
    return name if name == channel else f"The {name}"


def _sentence(comparison: Compared, part: str, channel: str) -> str:
    """The fit of a headline, its worst recording and phase, and the part's poorest other signal."""
    table = comparison.validation(channel).drop_nulls("nrmse_percent")
    if not len(table):
        return ""
    role = "validate" if (table["role"] == "validate").all() else "estimate"
    kind = "held-out " if role == "validate" else ""
    count = f"{len(table)} {kind}recording{'s' if len(table) > 1 else ''}"
    mean = float(np.mean(table["nrmse_percent"].to_numpy()))
    text = f"{named(comparison.machine.words, channel)} fits to {mean:.1f} %"
    if len(table) > 1:
        worst = table.sort("nrmse_percent").row(0, named=True)
        text += f" on average (NRMSE, {count}), worst to {worst['nrmse_percent']:.1f} % in {worst['file']}"
    else:
        text += f" (NRMSE, {count})"
    return f"{text}{_phase(comparison, channel)}{_other(comparison, part, table['file'])}."


def _without(comparison: Compared, part: str) -> str:
    """Why a part has no headline that can be judged, and how well its other signals fit."""
    machine = comparison.machine
    moved = [one.recording for one in comparison.predictions if part in machine.driven(one.recording)]
    own = {channel for whose, channel in comparison.headlines if whose == part}
    why = "it is measured as constant throughout" if own else machine.unjudged(moved, part)
    means = (
        _others(comparison, part).group_by("channel", maintain_order=True).agg(pl.col("nrmse_percent").mean())
    )
    fits = ", ".join(f"{name} to {_fit(value)}" for name, value in means.iter_rows())
    others = f"the other signals fit on average (NRMSE): {fits}" if fits else "no other signal can be either"
    what = f"no {machine.headline}" if machine.headline else "nothing"
    whose = f"{capital(machine.words.part(part))}: " if part else ""
    return capital(f"{whose}{what} can be judged: {why}; {others}.")


def _fit(percent: float) -> str:
    """A fit [%], and in words where it is negative."""
    return f"{percent:.1f} %{', worse than its mean' if percent < 0 else ''}"


def _phase(comparison: Compared, channel: str) -> str:
    most = comparison.where(channel).row(0, named=True)
    if not np.isfinite(most["share_of_misfit"]):
        return ""
    phase = comparison.machine.phase_words[most["phase"]]
    return (
        f". {100 * most['share_of_misfit']:.0f} % of its misfit lies in {phase} "
        f"({100 * most['share_of_time']:.0f} % of the time)"
    )


def _others(comparison: Compared, part: str) -> pl.DataFrame:
    told = [channel for _, channel in comparison.headlines]
    return comparison.fits.filter(
        (pl.col("part") == part)
        & pl.col("driven")
        & ~pl.col("channel").is_in(told)
        & pl.col("nrmse_percent").is_not_null()
    )


def _other(comparison: Compared, part: str, files: pl.Series) -> str:
    others = _others(comparison, part).filter(pl.col("file").is_in(files.implode())).sort("nrmse_percent")
    if not len(others):
        return ""
    poorest = others.row(0, named=True)
    name = comparison.machine.words.signal(poorest["channel"])
    return (
        f". The poorest other signal is the {name} in {poorest['file']}, with an NRMSE fit of "
        f"{_fit(poorest['nrmse_percent'])} (RMSE {amount(poorest['rmse'], poorest['unit'])})"
    )
