"""Results as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from io import StringIO
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.table import Table

from forklift.plant.forklift.tables import of_effect, outputs, parameters
from forklift.recordings.channels import LIFTS, Lift

if TYPE_CHECKING:
    import polars as pl

    from forklift.fitting.compare import Comparison
    from forklift.fitting.fit import Fit
    from forklift.plant.forklift.simulate import Simulation
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.campaign import Campaign
    from forklift.recordings.inspect import Log

WIDTH = 160
"""Columns of a table that is printed into a string."""


def plain(table: RenderableType) -> str:
    """A table as text without colours."""
    stream = StringIO()
    Console(file=stream, width=WIDTH, color_system=None).print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().rstrip().splitlines())


def truck_table(truck: Truck) -> Table:
    """Every parameter with value, unit and source."""
    title = f"Truck {truck.name} ({truck.origin}, sha256 {truck.sha256[:12]})"
    rows = (
        (name, parameters()[name]["symbol"], _value(value), parameters()[name]["unit"], truck.sources[name])
        for name, value in truck.values.items()
    )
    return _table(title, ["parameter", "symbol", ">value", "unit", "source"], rows)


def parameter_table() -> Table:
    """What a truck's file must give: every parameter of a lift with unit, bounds and meaning."""
    from forklift import _core

    rows = (
        (spec["name"], spec["unit"], f"{spec['lower']:g}", f"{spec['upper']:g}", spec["meaning"])
        for spec in _core.parameter_table()
    )
    title = "Parameters of each lift, in a truck's file below [free] and [main]"
    return _table(title, ["parameter", "unit", ">least", ">greatest", "meaning"], rows)


def effect_table() -> Table:
    """The effects that a truck's parameters may add to the thesis's model."""
    from forklift import _core

    rows = (
        (name, spec["unit"], f"{spec['lower']:g}", f"{spec['upper']:g}", effect["equation"])
        for effect in _core.effect_table()
        for name, spec in of_effect(effect).items()
    )
    title = "Effects, present if a truck's file gives their parameters"
    return _table(title, ["parameter", "unit", ">least", ">greatest", "equation"], rows)


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


def simulation_table(simulation: Simulation) -> Table:
    """Each output's first, last, least and greatest value."""
    rows = (
        (
            name,
            spec["unit"],
            *(f"{value:.5g}" for value in (found[0], found[-1], found.min(), found.max())),
        )
        for name, spec in outputs().items()
        for found in [simulation[name]]
        if np.isfinite(found).any()
    )
    title = (
        f"{simulation.truck.name}: {simulation.load_kg:g} kg, {simulation.oil_temperature_degc.mean():.1f} °C"
    )
    return _table(title, ["output", "unit", ">first", ">last", ">least", ">greatest"], rows)


def validation_table(comparison: Comparison, lift: Lift) -> Table:
    """Laid out as Table 5.4 or 5.5: both velocity fits for each temperature and load."""
    table = comparison.validation(lift)
    role = "" if (table["role"] == "validate").all() else " (there are no validate recordings: all of them)"
    title = f"Model fit of the velocity, {lift} lift, as Table {'5.4' if lift == 'free' else '5.5'}{role}"
    names = [">temperature [°C]", ">load [kg]", ">fit (NMSE) [%]", ">fit (NRMSE) [%]", "recording"]
    return _table(title, names, validation_rows(table))


def validation_rows(table: pl.DataFrame) -> list[tuple[str, ...]]:
    """The cells of `Comparison.validation`; a temperature is said once, as the thesis's tables do."""
    temperature = table["temperature_degc"].to_list()
    again = [before == here for before, here in pairwise([None, *temperature])]
    return [
        (
            "" if known else f"{row['temperature_degc']:.0f}",
            f"{row['load_kg']:g}",
            percent(row["nmse_percent"]),
            percent(row["nrmse_percent"]),
            row["file"],
        )
        for known, row in zip(again, table.iter_rows(named=True), strict=True)
    ]


def fit_table(comparison: Comparison) -> Table:
    """Every recording and signal."""
    rows = (
        (
            row["file"],
            row["role"],
            row["channel"] if row["commanded"] else f"{row['channel']} (at rest)",
            percent(row["nmse_percent"]),
            percent(row["nrmse_percent"]),
            "" if row["rmse"] is None else f"{row['rmse']:.3g}",
            row["unit"],
        )
        for row in comparison.fits.iter_rows(named=True)
    )
    names = ["recording", "role", "signal", ">fit (NMSE) [%]", ">fit (NRMSE) [%]", ">RMSE", "unit"]
    return _table("All signals", names, rows)


def phase_table(comparison: Comparison, lift: Lift) -> Table:
    """Where in the motion the velocity's misfit lies, over all recordings of one lift."""
    rows = (
        (
            row["phase"],
            f"{row['seconds']:.1f}",
            share(row["share_of_time"]),
            share(row["share_of_misfit"]),
        )
        for row in comparison.where(lift).iter_rows(named=True)
    )
    title = f"Where the misfit of the {lift} lift's velocity lies"
    return _table(title, ["phase", ">seconds", ">share of time [%]", ">share of misfit [%]"], rows)


def comparison_tables(comparison: Comparison) -> list[Table]:
    """The tables of a comparison that fit a page: validation and phases of each lift."""
    lifts = [lift for lift in LIFTS if len(comparison.validation(lift))]
    return [table(comparison, lift) for lift in lifts for table in (validation_table, phase_table)]


HOW_KNOWN = {"yes": "told", "together": "together", "no": "not told"}
"""By the column ``told`` of `fit_files.parameters`."""


def fit_tables(fit: Fit) -> list[Table]:
    """The tables of a fit: parameters and velocity of each lift, and what is left of every signal."""
    found = fit.parameters
    lifts: list[Lift | None] = [*LIFTS, None]
    tables = [parameters_table(found, lift) for lift in lifts if len(of_lift(found, lift))]
    tables += [change_table(fit, lift) for lift in LIFTS if len(fit.after.validation(lift))]
    return [*tables, mean_square_table(fit)]


def of_lift(found: pl.DataFrame, lift: Lift | None) -> pl.DataFrame:
    """The rows of `fit_files.parameters` of one lift; None: of neither."""
    return found.filter(found["lift"].eq_missing(lift))


def known(row: Mapping[str, Any]) -> str:
    """How a parameter is known."""
    biased = ", biased" if row["widening"] > 1.0 and row["told"] != "no" else ""
    return f"{HOW_KNOWN[row['told']]}{biased}"


def parameters_table(found: pl.DataFrame, lift: Lift | None) -> Table:
    """Laid out as Table 5.1 or 5.2: what was estimated of one lift, or of neither."""
    like = "" if lift is None else f", as Table {'5.1' if lift == 'free' else '5.2'}"
    title = f"Estimated parameters of {f'the {lift} lift' if lift else 'the truck'}{like}"
    rows = (
        (
            row["name"],
            f"{row['start']:.5g}",
            f"{row['value']:.5g}",
            f"{row['lower']:.4g} to {row['upper']:.4g}",
            row["unit"],
            known(row),
        )
        for row in of_lift(found, lift).iter_rows(named=True)
    )
    return _table(title, ["parameter", ">start", ">value", ">95 % interval", "unit", "known"], rows)


def change_table(fit: Fit, lift: Lift) -> Table:
    """Laid out as Table 5.4 or 5.5: both velocity fits for each temperature and load, before and after."""
    table = fit.validation(lift)
    role = "" if (table["role"] == "validate").all() else " (there are no validate recordings: all of them)"
    like = "5.4" if lift == "free" else "5.5"
    title = f"Model fit of the velocity, {lift} lift, before → after, as Table {like}{role}"
    names = [">temperature [°C]", ">load [kg]", ">fit (NMSE) [%]", ">fit (NRMSE) [%]", "recording"]
    return _table(title, names, change_rows(table))


def change_rows(table: pl.DataFrame) -> list[tuple[str, ...]]:
    """The cells of `Fit.validation`."""
    fits = ("nmse_percent", "nrmse_percent")
    before, after = (
        validation_rows(table.rename({f"{name}_{when}": name for name in fits}))
        for when in ("before", "after")
    )
    return [
        (*new[:2], *(f"{was} → {now}" for was, now in zip(old[2:4], new[2:4], strict=True)), new[4])
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


def _table(title: str, names: list[str], rows: Iterable[tuple[str, ...]]) -> Table:
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


def _value(value: float | tuple[float, ...]) -> str:
    return " ".join(f"{knot:.6g}" for knot in (value if isinstance(value, tuple) else (value,)))


def mean_square(value: float) -> str:
    """A mean square in units of noise, as a table shows it: hundreds without decimals."""
    return f"{value:.2f}" if value < 100.0 else f"{value:.0f}"


def percent(value: float | None) -> str:
    """A fit as a table shows it; a dash where it is not defined."""
    return "—" if value is None else f"{value:.1f}"


def share(value: float | None) -> str:
    """A share as a table shows it, in percent; a dash where there is nothing to share."""
    return "—" if value is None or not isfinite(value) else f"{100 * value:.0f}"
