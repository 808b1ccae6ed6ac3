"""Compare a campaign with a truck: predictions, fits as in Tables 5.4 and 5.5, and where the misfit lies."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from os import cpu_count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from forklift.base import output, present
from forklift.base.numbers import defined
from forklift.base.plotted import Line, Plotted
from forklift.base.result_files import PAGE, earlier_files, json_rows
from forklift.fitting import metrics as fits
from forklift.fitting.agreement import prediction_files
from forklift.fitting.comparison_words import sentence
from forklift.fitting.lines import chosen, compared_lines
from forklift.plant.forklift.phases import PHASES, phases, shut_current
from forklift.plant.forklift.signals import Signal, signals
from forklift.plant.forklift.simulate import (
    Simulation,
    check_temperature,
    mean_temperature,
    predict,
)
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.recordings.campaign import Campaign, campaign_of
from forklift.recordings.channels import LIFTS, Lift, channels, commanded

if TYPE_CHECKING:
    from forklift.base.arrays import Floats
    from forklift.fitting.predict import Predicted
    from forklift.recordings.recording import Recording

PREDICTED = (
    "position_free_m",
    "position_main_m",
    "velocity_free_m_s",
    "velocity_main_m_s",
    "pressure_free_pa",
    "pressure_main_pa",
)
"""The columns of a prediction after ``time_s``."""

SAME_TEMPERATURE_K = 5.0
"""Recordings whose oil temperatures lie this closely above the coldest's count as one operating point."""

MARK = "compare.json"

CHANGES = ("nmse_percent", "nrmse_percent", "rmse")
"""The columns of a fit that differ before and after."""

FIT_COLUMNS = {
    "file": pl.String,
    "role": pl.String,
    "lift": pl.String,
    "load_kg": pl.Float64,
    "oil_temperature_degc": pl.Float64,
    "channel": pl.String,
    "unit": pl.String,
    "commanded": pl.Boolean,
    "measured_from": pl.String,
    "samples": pl.Int64,
    "nmse_percent": pl.Float64,
    "nrmse_percent": pl.Float64,
    "rmse": pl.Float64,
}

PHASE_COLUMNS = {
    "file": pl.String,
    "role": pl.String,
    "lift": pl.String,
    "phase": pl.String,
    "seconds": pl.Float64,
    "squared_error": pl.Float64,
}


@dataclass(frozen=True, eq=False)
class Outputs:
    """What a model says of a recording: ``outputs["pressure_free_pa"]`` at `time_s`."""

    time_s: Floats
    values: Mapping[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        return self.values[name]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A recording, its free-running simulation, and the signals that both have."""

    recording: Recording
    simulation: Simulation | Outputs
    oil_temperature_degc: float
    signals: tuple[Signal, ...]

    def signal(self, channel: str) -> Signal | None:
        """The signal of this name, if it was measured."""
        return next((signal for signal in self.signals if signal.channel == channel), None)

    def to_polars(self) -> pl.DataFrame:
        """``time_s`` and the columns `PREDICTED`, as the model has them, without noise or quantisation."""
        return pl.DataFrame(
            {"time_s": self.simulation.time_s} | {name: self.simulation[name] for name in PREDICTED}
        )


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Plotted):
    """What `compare` gives; `write` puts all of it into a folder."""

    campaign: Campaign
    truck: Truck
    predictions: tuple[Prediction, ...]
    fits: pl.DataFrame
    """One row per recording and signal: both fits [%] and the RMSE in the signal's unit."""
    phases: pl.DataFrame
    """One row per commanded lift, recording and phase: seconds, and share of the velocity's misfit."""

    @cached_property
    def verdict(self) -> tuple[str, ...]:
        """One plain sentence per commanded lift: how good the fit is and where it is poor.

        Where no velocity could be told, the sentence says why, and how well the other signals fit.
        """
        return tuple(said for lift in LIFTS if (said := sentence(self, lift)))

    def validation(self, lift: Lift) -> pl.DataFrame:
        """Table 5.4 (free) or 5.5 (main): temperature, load and both velocity fits of validate recordings.

        Without validate recordings of this lift: of all of them.
        """
        rows = self.fits.filter((pl.col("channel") == f"velocity_{lift}_m_s") & pl.col("commanded"))
        judged = rows.filter(pl.col("role") == "validate")
        rows = judged if len(judged) else rows
        return (
            rows.with_columns(
                temperature_degc=pl.Series(
                    _operating_points(rows["oil_temperature_degc"].to_numpy()), dtype=pl.Float64
                )
            )
            .sort("temperature_degc", "load_kg", "file")
            .select("temperature_degc", "load_kg", "nmse_percent", "nrmse_percent", "rmse", "role", "file")
        )

    def where(self, lift: Lift) -> pl.DataFrame:
        """Phase by phase, the worst first: its share of the time and of the velocity's squared error.

        Over the recordings of `validation`.
        """
        files = self.validation(lift)["file"].implode()
        sums = (
            self.phases.filter((pl.col("lift") == lift) & pl.col("file").is_in(files))
            .group_by("phase", maintain_order=True)
            .agg(pl.col("seconds").sum(), pl.col("squared_error").sum())
        )
        shares = {"share_of_time": "seconds", "share_of_misfit": "squared_error"}
        return (
            sums.with_columns(**{name: pl.col(of) / pl.col(of).sum() for name, of in shares.items()})
            .drop("squared_error")
            .sort("share_of_misfit", descending=True)
        )

    def write(self, out: str | Path) -> Path:
        """Write ``predictions/baseline/FILE.csv``, ``fit.csv``, ``compare.json`` and ``report.html``.

        The folder appears whole or not at all; an earlier result there is replaced.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `out` holds anything but an earlier result, ``"not-writable"``.
        """
        with output.folder(out, earlier_files(out, MARK, result_files), MARK) as temporary:
            self.write_predictions(temporary)
            self.fits.write_csv(temporary / "fit.csv")
            (temporary / MARK).write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")
            (temporary / PAGE).write_text(present.page(self), encoding="utf-8", newline="\n")
        return Path(out)

    def plot(self, file: str | None = None) -> Any:
        """Every signal of one recording, measured and simulated, as a `plotly.graph_objects.Figure`.

        Parameters
        ----------
        file
            The recording; by default the first that was held out.

        Raises
        ------
        ForkliftError
            ``"recording-unknown"``.
        """
        return present.figure(self, self.heading(file), self.lines(file))

    def heading(self, file: str | None = None) -> str:
        """The recording, and the truck."""
        one = chosen(self.predictions, file).recording
        return f"{one.heading()}, by truck “{self.truck.name}”"

    def lines(self, file: str | None = None) -> Sequence[Line]:
        """See `plot`."""
        return compared_lines(self.predictions, dict(self.fits.select("channel", "unit").iter_rows()), file)

    def write_predictions(self, folder: Path, model: str = "baseline") -> None:
        """Write ``predictions/MODEL/FILE.csv`` of every recording below `folder`."""
        files = prediction_files([prediction.recording.file for prediction in self.predictions], model)
        for prediction, file in zip(self.predictions, files, strict=True):
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            prediction.to_polars().write_csv(path)

    def to_dict(self) -> dict[str, Any]:
        """Verdict, tables, and the version and hashes of what they were made from, for JSON."""
        from forklift import __version__

        return {
            "schema": 1,
            "forklift": __version__,
            "campaign": self.campaign.facts(),
            "truck": self.truck.facts(),
            "verdict": list(self.verdict),
            "validation": {lift: json_rows(table) for lift in LIFTS if len(table := self.validation(lift))},
            "fits": json_rows(self.fits),
            "phases": json_rows(self.phases),
        }

    def __str__(self) -> str:
        return "\n".join([*self.verdict, "", *present.tables(self)])

    def _repr_html_(self) -> str:
        return present.summary(self)

    def __repr__(self) -> str:
        return (
            f"Comparison({self.campaign.name!r} with {self.truck.name!r}, "
            f"{len(self.predictions)} recordings, {len(self.fits)} fits)"
        )


def compare(
    campaign: Campaign | str | Path,
    truck: Truck | str | Path,
    *,
    oil_temperature_degc: float | None = None,
    progress: Callable[[Prediction], None] | None = None,
    **settings: Any,
) -> Comparison:
    """Replay every recording of a campaign on a truck, free-running, and judge every signal.

    Velocities are compared as measured (`forklift.base.derivative.derivative`): the derivative of
    ``fork_height_m`` where it exists and a single lift is commanded, else of the lift's own encoder, measured
    and simulated through the same filter. Positions, pressures and fork height are compared as they stand.

    Parameters
    ----------
    campaign, truck
        What was measured, and the truck that should explain it.
    oil_temperature_degc
        For recordings without an oil temperature [°C].
    progress
        Called after each recording, from the calling thread.
    settings
        `forklift.plant.forklift.simulate.simulate`'s ``solver``, ``tolerance`` and ``substeps``.

    Raises
    ------
    ForkliftError
        Those of `forklift.plant.forklift.simulate.predict`; ``"argument-invalid"`` for an impossible oil
        temperature.
    """
    campaign, truck = campaign_of(campaign), truck_of(truck)
    check_temperature(oil_temperature_degc)

    def one(recording: Recording) -> Prediction:
        simulation = predict(truck, recording, oil_temperature_degc=oil_temperature_degc, **settings)
        temperature = mean_temperature(recording, oil_temperature_degc)
        return Prediction(recording, simulation, temperature, tuple(signals(recording, simulation)))

    predictions: list[Prediction] = []
    with ThreadPoolExecutor(cpu_count()) as pool:
        try:
            for prediction in pool.map(one, campaign.recordings):
                predictions.append(prediction)
                if progress:
                    progress(prediction)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return _judged(campaign, truck, predictions)


def compare_fitted(
    campaign: Campaign,
    truck: Truck,
    predicted: Sequence[Predicted],
    oil_temperature_degc: float | None = None,
) -> Comparison:
    """The comparison of a campaign with a model as it was judged: see `forklift.fitting.predict`.

    Fits are of what the sensors read; predictions are the machine's own.
    """
    predictions = []
    for one in predicted:
        entered = mean_temperature(one.recording, oil_temperature_degc)
        temperature = entered + one.conditions["oil_temperature"]
        seen = tuple(signals(one.recording, Outputs(one.time_s, one.readings)))
        predictions.append(Prediction(one.recording, Outputs(one.time_s, one.outputs), temperature, seen))
    return _judged(campaign, truck, predictions)


def _judged(campaign: Campaign, truck: Truck, predictions: list[Prediction]) -> Comparison:
    table = pl.DataFrame(
        [row for found in predictions for row in _fit_rows(found)], schema=FIT_COLUMNS, orient="row"
    )
    return Comparison(campaign, truck, tuple(predictions), table, _phase_table(truck, predictions))


def result_files(recordings: Sequence[str]) -> frozenset[str]:
    """The files that `Comparison.write` makes of a campaign with these recordings."""
    return frozenset({"fit.csv", PAGE, MARK, *prediction_files(recordings)})


def validation_change(before: Comparison, after: Comparison, lift: Lift) -> pl.DataFrame:
    """`Comparison.validation` of one lift by two trucks: its fits end with ``_before`` and ``_after``."""
    names = {name: f"{name}_before" for name in CHANGES}
    told = after.validation(lift).rename({name: f"{name}_after" for name in CHANGES})
    known = before.validation(lift).select("file", *CHANGES).rename(names)
    return told.join(known, on="file", maintain_order="left")


def command_line(verb: str, campaign: Campaign, truck: Truck, options: Sequence[str] = ()) -> str | None:
    """The command that does the same; None if the campaign or the truck does not come from a file."""
    if campaign.folder is None or truck.origin == "Python":
        return None
    name = truck.name if truck.origin == "shipped" else truck.origin
    return shlex.join(["forklift", verb, str(campaign.folder), "--truck", name, *options, "--out", "result"])


def temperature_option(comparison: Comparison) -> list[str]:
    """The option that gave recordings without an oil temperature theirs."""
    given = [
        one.oil_temperature_degc
        for one in comparison.predictions
        if not np.isfinite(one.recording.channels.get("oil_temperature_degc", np.nan)).any()
    ]
    return ["--temperature", repr(given[0])] if given else []


def _fit_rows(prediction: Prediction) -> Iterator[tuple[Any, ...]]:
    recording = prediction.recording
    for signal in prediction.signals:
        pair = (signal.measured, signal.simulated)
        yield (
            recording.file,
            recording.role,
            signal.lift,
            recording.load_kg,
            prediction.oil_temperature_degc,
            signal.channel,
            (outputs() | channels())[signal.channel]["unit"],
            signal.commanded,
            signal.measured_from,
            int(np.isfinite(signal.measured).sum()),
            defined(fits.nmse(*pair)),
            defined(fits.nrmse(*pair)),
            defined(fits.rmse(*pair)),
        )


def _phase_table(truck: Truck, predictions: list[Prediction]) -> pl.DataFrame:
    rows = []
    for prediction in predictions:
        recording = prediction.recording
        for lift in commanded(recording.lift):
            velocity = prediction.signal(f"velocity_{lift}_m_s")
            if velocity is None:
                continue
            squared = np.nan_to_num((velocity.measured - velocity.simulated) ** 2)
            seconds = np.diff(recording.time_s, append=recording.time_s[-1:])
            found = phases(
                recording.time_s, recording.channels[f"current_{lift}_a"], shut_current(truck, lift)
            )
            for index, phase in enumerate(PHASES):
                here = found == index
                rows.append(
                    (recording.file, recording.role, lift, phase, seconds[here].sum(), squared[here].sum())
                )
    table = pl.DataFrame(rows, schema=PHASE_COLUMNS, orient="row")
    total = pl.col("squared_error").sum().over("file", "lift")
    return table.with_columns(share_of_misfit=pl.when(total > 0).then(pl.col("squared_error") / total))


def _operating_points(temperature: Floats) -> list[float]:
    """Each recording's operating temperature: the mean of those close above the coldest not yet grouped."""
    point = np.empty(len(temperature))
    left = np.argsort(temperature)
    while len(left):
        close = temperature[left] - temperature[left[0]] <= SAME_TEMPERATURE_K
        point[left[close]] = round(float(temperature[left[close]].mean()), 1)
        left = left[~close]
    return point.tolist()
