"""Results as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

import polars as pl
from rich import box
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.table import Table

from forklift.base.sheet import Listing
from forklift.base.typeset import capital, mean_square

if TYPE_CHECKING:
    from forklift.fitting.compare import Comparison
    from forklift.fitting.compared import Compared
    from forklift.fitting.fit import Fit
    from forklift.recordings.campaign import Campaign
    from forklift.recordings.inspect import Log

WIDTH = 160
"""Columns of a table that is printed into a string."""


def plain(table: RenderableType) -> str:
    """A table as text without colours."""
    stream = StringIO()
    Console(file=stream, width=WIDTH, color_system=None).print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().rstrip().splitlines())


def listed(one: Listing) -> Table:
    """What a result says of itself, as a table."""
    return _table(one.title, list(one.heads), one.rows)


def campaign_table(campaign: Campaign) -> Table:
    """The recordings of a campaign."""
    rows = (
        (
            found.file,
            found.lift,
            f"{found.load_kg:g}",
            found.role,
            str(len(found.time_s)),
            f"{found.time_s[-1] - found.time_s[0]:.1f}",
            str(len(found.channels)),
        )
        for found in campaign.recordings
    )
    title = (
        f"Campaign {campaign.name} ({len(campaign.recordings)} recordings at {campaign.sample_rate_hz:g} Hz, "
        f"sha256 {campaign.sha256[:12]})"
    )
    return _table(title, ["file", "lift", ">load [kg]", "role", ">samples", ">seconds", ">channels"], rows)


def log_table(log: Log) -> Table:
    """The signals of a log, with the channels that are proposed for them."""
    rows = (
        (
            one.name,
            str(one.clock),
            one.unit,
            str(one.samples),
            "" if one.rate_hz is None else f"{one.rate_hz:g}",
            "" if one.least is None else f"{one.least:.4g}",
            "" if one.greatest is None else f"{one.greatest:.4g}",
            one.sketch,
            one.proposal.channel if one.proposal else "",
        )
        for one in log.signals
    )
    seconds = "" if log.duration_s is None else f", {log.duration_s:.1f} s"
    heads = ["signal", ">clock", "unit", ">samples", ">Hz", ">least", ">greatest", "course", "may be"]
    return _table(f"{log.file} ({log.format}{seconds})", heads, rows)


def titled(comparison: Compared, channel: str) -> str:
    """What a table of a headline's fits is called."""
    words = comparison.machine.words
    like = words.like(channel)
    held = (comparison.validation(channel)["role"] == "validate").all()
    name = words.signal(channel)
    return (
        f"{name if name == channel else capital(name)}{f', {like}' if like else ''}"
        f"{'' if held else ' (no recordings are held out, so all of them)'}"
    )


def validation_heads(comparison: Compared, table: pl.DataFrame, fits: Sequence[str]) -> list[str]:
    """The heads of `validation_rows`, those of numbers after ``>``."""
    words = comparison.machine.words
    conditions = [words.condition(name) for name in conditions_of(table)]
    return [
        *(f">{capital(one.name)}{f' [{one.unit}]' if one.unit else ''}" for one in conditions),
        *(f">{fit}" for fit in fits),
        "Recording",
    ]


def conditions_of(table: pl.DataFrame) -> list[str]:
    """The conditions of `Comparison.validation`."""
    return table.columns[: next(k for k, name in enumerate(table.columns) if name.startswith("nmse"))]


def validation_rows(table: pl.DataFrame) -> list[list[str]]:
    """The cells of `Comparison.validation`; what leads is said once, as the thesis's tables do."""
    names = conditions_of(table)
    columns = [table[name].to_list() for name in names]
    again = [before == here for before, here in pairwise([None, *columns[0]])] if columns else []
    rows = []
    for place, row in enumerate(table.iter_rows(named=True)):
        cells = ["—" if row[name] is None else f"{row[name]:.4g}" for name in names]
        if len(names) > 1 and again[place]:
            cells[0] = ""
        fits = [percent(row[name]) for name in ("nmse_percent", "nrmse_percent")]
        rows.append([*cells, *fits, row["file"]])
    return rows


def validation_table(comparison: Comparison, channel: str) -> Table:
    """Both fits of a headline, by operating point."""
    table = comparison.validation(channel)
    heads = validation_heads(comparison, table, ("Fit (NMSE) [%]", "Fit (NRMSE) [%]"))
    return _table(titled(comparison, channel), heads, validation_rows(table))


def phase_table(comparison: Comparison, channel: str) -> Table:
    """Where in the motion a headline's misfit lies, over all recordings."""
    rows = (
        (row["phase"], f"{row['seconds']:.1f}", share(row["share_of_time"]), share(row["share_of_misfit"]))
        for row in comparison.where(channel).iter_rows(named=True)
    )
    title = f"Where the misfit of {comparison.machine.words.signal(channel)} lies"
    return _table(title, ["phase", ">seconds", ">share of time [%]", ">share of misfit [%]"], rows)


def comparison_tables(comparison: Comparison) -> list[Table]:
    """The tables of a comparison that fit a page: each headline's operating points and phases."""
    return [
        table(comparison, channel)
        for _, channel in comparison.headlines
        for table in (validation_table, phase_table)
    ]


def fit_tables(fit: Fit) -> list[Table]:
    """The tables of a fit: parameters of each part, each headline, and what is left of every signal."""
    tables = [parameters_table(fit, part) for part in parts_of(fit)]
    tables += [change_table(fit, channel) for _, channel in fit.after.headlines]
    return [*tables, mean_square_table(fit)]


def parts_of(fit: Fit) -> list[str | None]:
    """The parts that have parameters, then None if some belong to none."""
    seen = fit.parameters["part"].unique().to_list()
    return [part for part in (*fit.parts, None) if part in seen]


def of_part(found: pl.DataFrame, part: str | None) -> pl.DataFrame:
    """The rows of `Fit.parameters` of one part; None: of none."""
    return found.filter(found["part"].eq_missing(part))


def parameters_titled(fit: Fit, part: str | None) -> str:
    """Whose parameters they are."""
    words = fit.machine.words
    return f"parameters of {words.part(part)}" if part else f"parameters of the {words.noun}"


def known(row: Mapping[str, Any]) -> str:
    """How a parameter is known."""
    biased = ", biased" if row["widening"] > 1.0 and row["told"] != "no" else ""
    return f"{row['told']}{biased}"


def parameters_table(fit: Fit, part: str | None) -> Table:
    """What was estimated of one part, or of none."""
    like = fit.machine.words.parameters_like(part or "")
    title = f"Estimated {parameters_titled(fit, part)}{f', {like}' if like else ''}"
    rows = (
        (
            row["name"],
            f"{row['start']:.5g}",
            f"{row['value']:.5g}",
            f"{row['lower']:.4g} to {row['upper']:.4g}",
            row["unit"],
            known(row),
        )
        for row in of_part(fit.parameters, part).iter_rows(named=True)
    )
    return _table(title, ["parameter", ">start", ">value", ">95 % interval", "unit", "identifiable"], rows)


def change_table(fit: Fit, channel: str) -> Table:
    """Both fits of a headline, before and after, by operating point."""
    table = fit.validation(channel)
    heads = validation_heads(fit.after, table, ("Fit (NMSE) [%]", "Fit (NRMSE) [%]"))
    return _table(f"{titled(fit.after, channel)}, before → after", heads, change_rows(table))


def change_rows(table: pl.DataFrame) -> list[list[str]]:
    """The cells of `Fit.validation`."""
    fits = ("nmse_percent", "nrmse_percent")
    kept = conditions_of(table)
    before, after = (
        validation_rows(table.select(*kept, *(pl.col(f"{name}_{when}").alias(name) for name in fits), "file"))
        for when in ("before", "after")
    )
    return [
        [*new[:-3], *(f"{was} → {now}" for was, now in zip(old[-3:-1], new[-3:-1], strict=True)), new[-1]]
        for old, new in zip(before, after, strict=True)
    ]


def mean_square_table(fit: Fit) -> Table:
    """What is left of each signal, in units of the sensors' noise: 1 is as good as can be."""
    rows = (
        (
            row["channel"],
            row["role"],
            mean_square(row["mean_square"]),
            mean_square(row["worst"]),
            f"{row['explained']} of {row['recordings']}",
            f"{row['white']} of {row['tested']}" if row["tested"] else "—",
            row["worst_file"],
        )
        for row in fit.signals.iter_rows(named=True)
    )
    title = "What is left over, as mean square in units of the sensors' noise (1: nothing but noise)"
    names = ["signal", "role", ">mean", ">worst", ">explained", ">white", "worst recording"]
    return _table(title, names, rows)


def _table(title: str, names: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    table = Table(
        title=escape(title), title_justify="left", box=box.SIMPLE_HEAD, title_style="bold", pad_edge=False
    )
    for place, name in enumerate(names):
        table.add_column(
            escape(name.lstrip(">").replace(" [", "\n[")),
            justify="right" if name.startswith(">") else "left",
            overflow="fold",
            no_wrap=place < len(names) - 1,
        )
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def percent(value: float | None) -> str:
    """A fit as a table shows it; a dash where it is not defined."""
    return "—" if value is None else f"{value:.1f}"


def share(value: float | None) -> str:
    """A share as a table shows it, in percent; a dash where there is nothing to share."""
    return "—" if value is None or not isfinite(value) else f"{100 * value:.0f}"
