"""How far a model as it was judged and its recordings agree: every signal, of any machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from forklift.base.arrays import Floats
from forklift.base.numbers import defined
from forklift.fitting import metrics
from forklift.fitting.predict import Predicted
from forklift.plant.subject import Signal, Subject
from forklift.recordings.campaign import csv_name

COLUMNS = {
    "file": pl.String,
    "role": pl.String,
    "part": pl.String,
    "channel": pl.String,
    "unit": pl.String,
    "driven": pl.Boolean,
    "measured_from": pl.String,
    "samples": pl.Int64,
    "nmse_percent": pl.Float64,
    "nrmse_percent": pl.Float64,
    "rmse": pl.Float64,
}
"""Of a table of fits; NMSE and NRMSE as (3.39) and (3.40) of Fri & Fahlén (2017), RMSE in the unit."""

FITS = ("nmse_percent", "nrmse_percent", "rmse")
"""Those of the columns that differ from one model to another."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """One recording as a model has it.

    Attributes
    ----------
    recording
        What was recorded.
    outputs
        By name, (times,): the machine's own; NaN where it was not run.
    conditions
        By name, as entered and as far as they were found.
    adjusted
        What of the recording itself was adjusted: its start, numbers of its own.
    signals
        What was measured beside what the sensors read of the model.
    """

    recording: Any
    outputs: Mapping[str, Floats]
    conditions: Mapping[str, float]
    adjusted: tuple[str, ...]
    signals: tuple[Signal, ...]

    @property
    def time_s(self) -> Floats:
        """(times,) of the recording [s]."""
        return self.recording.time_s  # type: ignore[no-any-return]

    def signal(self, channel: str) -> Signal | None:
        """The signal of this name, if it was measured."""
        return next((one for one in self.signals if one.channel == channel), None)


@dataclass(frozen=True, eq=False)
class Agreement:
    """All recordings, in their order."""

    machine: Subject
    predictions: tuple[Prediction, ...]

    @cached_property
    def fits(self) -> pl.DataFrame:
        """One row per recording and signal: `COLUMNS`, with the recording's conditions after its part."""
        names = list(dict.fromkeys(name for one in self.predictions for name in one.conditions))
        head = list(COLUMNS)[:3]
        rows = [
            (row[:3] + tuple(one.conditions.get(name) for name in names) + row[3:])
            for one in self.predictions
            for row in _rows(one)
        ]
        own = dict.fromkeys(names, pl.Float64)
        schema = {name: COLUMNS[name] for name in head} | own | COLUMNS
        return pl.DataFrame(rows, schema=schema, orient="row")

    @property
    def held_out(self) -> pl.DataFrame:
        """The rows of driven signals of recordings held out; of all, if none was."""
        own = self.fits.filter(pl.col("driven"))
        held = own.filter(pl.col("role") == "validate")
        return held if len(held) else own

    @property
    def rmse(self) -> float:
        """The root mean square error over all samples of `held_out`."""
        return together(self.held_out)

    def write(self, folder: Path, model: str) -> None:
        """Write ``predictions/MODEL/FILE.csv`` of every recording: the machine's own outputs."""
        files = prediction_files([one.recording.file for one in self.predictions], model)
        for one, file in zip(self.predictions, files, strict=True):
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            columns = self.machine.states(one.recording, one.outputs)
            pl.DataFrame({"time_s": one.time_s, **columns}).write_csv(path)


def agreement(
    machine: Subject,
    recordings: Sequence[Any],
    predicted: Sequence[Predicted],
    adjusted: Sequence[Sequence[str]],
) -> Agreement:
    """Recordings with what a fitted model says of them, stretches of one recording joined.

    Parameters
    ----------
    predicted, adjusted
        By stretch, in the recordings' order: what the model says, and which conditions were unknown.
    """
    pairs = zip(predicted, adjusted, strict=True)
    stretches = iter([*pairs])
    found = []
    for recording in recordings:
        own = [next(stretches) for _ in machine.pieces(recording)]
        outputs, readings = (_joined(recording, own, what) for what in ("outputs", "readings"))
        names = tuple(dict.fromkeys(name for _, free in own for name in free))
        found.append(
            Prediction(
                recording,
                outputs,
                machine.conditions(recording, own[0][0].conditions),
                names,
                tuple(machine.signals(recording, readings)),
            )
        )
    return Agreement(machine, tuple(found))


def together(rows: pl.DataFrame) -> float:
    """The root mean square error over all samples of these rows; NaN if there are none."""
    known = rows.filter(pl.col("rmse").is_not_null())
    weight = known["samples"].to_numpy()
    return (
        float(np.sqrt(weight @ known["rmse"].to_numpy() ** 2 / weight.sum())) if len(known) else float("nan")
    )


def change(before: Agreement, after: Agreement) -> pl.DataFrame:
    """`Agreement.fits` of both: fits end with ``_before`` and ``_after``."""
    told = after.fits.select(*COLUMNS).rename({name: f"{name}_after" for name in FITS})
    known = before.fits.select("file", "channel", *FITS).rename({name: f"{name}_before" for name in FITS})
    return told.join(known, on=["file", "channel"], maintain_order="left")


def prediction_files(recordings: Sequence[str], model: str = "baseline") -> list[str]:
    """By recording, the file that its prediction is written to."""
    names = [csv_name(file) for file in recordings]
    # a.csv and a.mf4 are two recordings
    own = [
        name if names.count(name) == 1 else f"{file}.csv"
        for file, name in zip(recordings, names, strict=True)
    ]
    return [f"predictions/{model}/{name}" for name in own]


def _joined(recording: Any, own: Sequence[tuple[Predicted, Any]], what: str) -> dict[str, Floats]:
    found: dict[str, Floats] = {}
    for one, _ in own:
        first = int(np.searchsorted(recording.time_s, one.time_s[0]))
        for name, values in getattr(one, what).items():
            column = found.setdefault(name, np.full(len(recording.time_s), np.nan))
            column[first : first + len(values)] = values
    return found


def _rows(one: Prediction) -> Iterator[tuple[Any, ...]]:
    for signal in one.signals:
        pair = (signal.measured, signal.simulated)
        yield (
            one.recording.file,
            one.recording.role,
            signal.part,
            signal.channel,
            signal.unit,
            signal.driven,
            signal.measured_from,
            int((np.isfinite(signal.measured) & np.isfinite(signal.simulated)).sum()),
            defined(metrics.nmse(*pair)),
            defined(metrics.nrmse(*pair)),
            defined(metrics.rmse(*pair)),
        )
