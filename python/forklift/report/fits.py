"""How well each recording fits, operating point by operating point, and every signal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from forklift.base.typeset import capital, number, printed
from forklift.fitting.agreement import change
from forklift.report.blocks import Table
from forklift.report.tables import percent

if TYPE_CHECKING:
    from forklift.fitting.agreement import Agreement
    from forklift.plant.subject import Subject
    from forklift.recordings.noise import Sensor

FITS = (
    "100 % is perfect; 0 % is no better than the measured signal's mean. NMSE and NRMSE are (3.39) and "
    "(3.40) of Fri & Fahlén (2017)."
)
NEARLY = 0.1
"""A condition is printed as it was found, if within this."""
MANY = 14
"""A table with more rows is folded."""


def operating_points(
    machine: Subject,
    before: Agreement | None,
    after: Agreement,
    sensors: Mapping[str, Sensor],
) -> Iterator[Table]:
    """One table per channel that the machine is told by: each recording held out, by its conditions.

    `before`: what it is held against; None if there is nothing. `sensors`: by channel, as far as known.
    """
    words, changed = machine.words, before is not None
    points = machine.operating_points([one.conditions for one in after.predictions])
    own = {one.recording.file: at for one, at in zip(after.predictions, points, strict=True)}
    entered = machine.operating_points([machine.conditions(one.recording, {}) for one in after.predictions])
    given = {one.recording.file: at for one, at in zip(after.predictions, entered, strict=True)}
    shared = any(
        abs(at[name] - one.conditions[name]) > NEARLY
        for one, at in zip(after.predictions, points, strict=True)
        for name in at.keys() & one.conditions.keys()
    )
    rows = change(before or after, after).filter(
        pl.col("driven") & pl.col("channel").str.starts_with(machine.headline)
    )
    held = rows.filter(pl.col("role") == "validate")
    rows, which = (held, "") if len(held) else (rows, " (no recordings are held out, so all of them)")
    for channel, unit in rows.select("channel", "unit").unique(maintain_order=True).iter_rows():
        mine = rows.filter(pl.col("channel") == channel).to_dicts()
        names = list(dict.fromkeys(name for row in mine for name in own[row["file"]]))
        mine.sort(key=lambda row: [own[row["file"]].get(name, np.nan) for name in names])
        noise, like = sensors.get(channel), words.like(channel)
        fine = words.fine(channel, unit)
        columns = [
            _conditions([(given[row["file"]].get(name), own[row["file"]].get(name)) for row in mine])
            for name in names
        ]
        conditions = [words.condition(name) for name in names]
        when = ("before", "after") if changed else ("after",)
        yield Table(
            f"{fine.name if fine.name == channel else capital(fine.name)}"
            f"{', before → after' if changed else ''}{f', {like}' if like else ''}{which}",
            [
                *(
                    f"{capital(one.name)}{', entered / found' if both else ''}"
                    f"{f' [{one.unit}]' if one.unit else ''}"
                    for one, (both, _) in zip(conditions, columns, strict=True)
                ),
                "Fit (NRMSE) [%]",
                *(["Gain [points of NRMSE]"] if changed else []),
                f"Error{f' [{fine.unit}]' if fine.unit else ''}",
                "Recording",
            ],
            [
                [
                    *(cells[place] for _, cells in columns),
                    " → ".join(percent(row[f"nrmse_percent_{one}"]) for one in when),
                    *([_gain(row)] if changed else []),
                    " → ".join(_error(row[f"rmse_{one}"], fine.scale) for one in when),
                    row["file"],
                ]
                for place, row in enumerate(mine)
            ],
            [*[True] * (len(names) + 2 + changed), False],
            note=f"{FITS} Error: root mean square."
            + (
                " A condition that several recordings nearly share is printed as their mean."
                if shared
                else ""
            )
            + (
                f" The sensor's noise: {number(fine.scale * noise.noise)} {fine.unit}".rstrip() + "."
                if noise
                else ""
            ),
            folded=len(mine) > MANY,
        )


def _conditions(pairs: Sequence[tuple[float | None, float | None]]) -> tuple[bool, list[str]]:
    """A column of a condition as entered and as found: whether these differ as printed, and its cells."""
    largest = max((abs(one) for pair in pairs for one in pair if one is not None), default=0.0)
    digits = 0 if largest >= 100.0 else 1 if largest >= 10.0 else 3
    units = [10**digits * one for pair in pairs for one in pair if one is not None and np.isfinite(one)]
    while digits and all(round(one) % 10 == 0 for one in units):  # no digit that is zero everywhere
        digits, units = digits - 1, [one / 10 for one in units]
    said = [["—" if one is None else f"{one:.{digits}f}" for one in pair] for pair in pairs]
    both = any(given != found for given, found in said)
    return both, [" / ".join(pair) if both else pair[1] for pair in said]


def _gain(row: Mapping[str, Any]) -> str:
    pair = row["nrmse_percent_before"], row["nrmse_percent_after"]
    if None in pair:
        return "—"
    gain = f"{pair[1] - pair[0]:+.1f}"
    return gain if float(gain) else "0.0"


def _error(value: float | None, scale: float) -> str:
    """Always three digits, so that a column can be compared."""
    if value is None:
        return "—"
    shown = scale * value
    return f"{shown:#.3g}".rstrip(".") if 1e-3 <= abs(shown) < 1e3 else number(shown)


def short(rows: pl.DataFrame) -> list[dict[str, Any]]:
    """Rows of a table of fits as `every_fit` takes them."""
    return rows.rename(lambda name: name.replace("_percent", "")).to_dicts()


def every_fit(rows: Sequence[Mapping[str, Any]], sides: Sequence[str]) -> Table:
    """Every recording and signal; `sides` are the endings of the columns, ``""`` where there is one."""
    heads = {side: side.replace("_", " ") if len(sides) > 1 else "" for side in sides}
    return Table(
        "Every recording and signal",
        [
            "Recording", "Role", "Signal",
            *(f"{fit}{heads[side]} [%]" for fit in ("NMSE", "NRMSE") for side in sides),
            *(f"RMSE{heads[side]}" for side in sides),
            "Unit",
        ],
        [
            [
                row["file"], row["role"], row["channel"],
                *(percent(row[f"{fit}{side}"]) for fit in ("nmse", "nrmse") for side in sides),
                *(number(row[f"rmse{side}"]) for side in sides),
                printed(row["unit"]),
            ]
            for row in rows
        ],
        [False, False, False, *[True] * (3 * len(sides)), False],
        folded=True,
    )  # fmt: skip
