"""A machine beside its recordings as data: fits by operating point, and where in the motion they are poor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import polars as pl

from forklift.fitting.agreement import FITS, Agreement, Prediction
from forklift.fitting.origin import Origin
from forklift.plant.subject import Subject

PHASE_COLUMNS = {
    "file": pl.String,
    "role": pl.String,
    "part": pl.String,
    "channel": pl.String,
    "phase": pl.String,
    "seconds": pl.Float64,
    "samples": pl.Int64,
    "squared_error": pl.Float64,
}


@dataclass(frozen=True, eq=False, repr=False)
class Compared:
    """A machine beside recordings.

    Attributes
    ----------
    machine
        That was run.
    origin
        What it was compared with.
    agreement
        Every recording with its simulation, and their fits.
    """

    machine: Subject
    origin: Origin
    agreement: Agreement

    @property
    def predictions(self) -> tuple[Prediction, ...]:
        """One per recording, in their order."""
        return self.agreement.predictions

    @property
    def fits(self) -> pl.DataFrame:
        """One row per recording and signal: both fits [%] and the RMSE in the signal's unit."""
        return self.agreement.fits

    @cached_property
    def headlines(self) -> tuple[tuple[str, str], ...]:
        """(part, channel) of the signals that the machine is told by: of a truck each lift's velocity."""
        own = self.fits.filter(
            pl.col("driven") & pl.col("channel").str.starts_with(self.machine.headline)
        ).select("part", "channel")
        return tuple(own.unique(maintain_order=True).sort("part", maintain_order=True).iter_rows())

    def validation(self, channel: str) -> pl.DataFrame:
        """One headline's fits by operating point, of validate recordings; without them, of all.

        Columns: the conditions, the fits, role and file. Of a truck's velocity it is laid out as Table 5.4
        or 5.5 of Fri & Fahlén (2017): oil temperature, load, both fits.
        """
        rows = self.fits.filter((pl.col("channel") == channel) & pl.col("driven"))
        judged = rows.filter(pl.col("role") == "validate")
        rows = judged if len(judged) else rows
        own = {one.recording.file: one.conditions for one in self.predictions}
        points = self.machine.operating_points([own[file] for file in rows["file"]])
        names = list(dict.fromkeys(name for point in points for name in point))
        columns = {name: pl.Series([point.get(name) for point in points], dtype=pl.Float64) for name in names}
        return (
            rows.select(*FITS, "role", "file")
            .with_columns(**columns)
            .sort(*names, "file")
            .select(*names, *FITS, "role", "file")
        )

    @cached_property
    def phases(self) -> pl.DataFrame:
        """One row per headline, recording and phase of its motion: seconds, and share of its misfit."""
        rows: list[tuple[Any, ...]] = []
        for one in self.predictions:
            labels = self.machine.labels(one.recording)
            seconds = np.diff(one.time_s, append=one.time_s[-1:])
            for signal in one.signals:
                if (signal.part, signal.channel) not in self.headlines or not signal.driven:
                    continue
                off = signal.measured - signal.simulated
                seen, squared = np.isfinite(off), np.nan_to_num(off**2)
                for place, phase in enumerate(self.machine.phases):
                    here = labels[signal.measured_from] == place
                    whose = (one.recording.file, one.recording.role, signal.part, signal.channel)
                    sums = (seconds[here].sum(), int(seen[here].sum()), squared[here].sum())
                    rows.append((*whose, phase, *sums))
        table = pl.DataFrame(rows, schema=PHASE_COLUMNS, orient="row")
        total = pl.col("squared_error").sum().over("file", "channel")
        return table.with_columns(share_of_misfit=pl.when(total > 0).then(pl.col("squared_error") / total))

    def where(self, channel: str) -> pl.DataFrame:
        """Phase by phase, the worst first: its share of the time and of the headline's squared error.

        Over the recordings of `validation`.
        """
        files = self.validation(channel)["file"].implode()
        sums = (
            self.phases.filter((pl.col("channel") == channel) & pl.col("file").is_in(files))
            .group_by("phase", maintain_order=True)
            .agg(pl.col("seconds").sum(), pl.col("squared_error").sum())
        )
        shares = {"share_of_time": "seconds", "share_of_misfit": "squared_error"}
        return (
            sums.with_columns(**{name: pl.col(of) / pl.col(of).sum() for name, of in shares.items()})
            .drop("squared_error")
            .sort("share_of_misfit", descending=True)
        )


def validation_change(before: Compared, after: Compared, channel: str) -> pl.DataFrame:
    """`Compared.validation` by two models: fits end with ``_before`` and ``_after``."""
    told = after.validation(channel).rename({name: f"{name}_after" for name in FITS})
    known = before.validation(channel).select("file", *FITS).rename({name: f"{name}_before" for name in FITS})
    return told.join(known, on="file", maintain_order="left")
