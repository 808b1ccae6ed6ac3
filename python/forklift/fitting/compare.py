"""A machine beside its recordings, free-running and as entered: how well every signal fits, and where not."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from os import cpu_count
from pathlib import Path
from typing import Any

from forklift.base import output, present
from forklift.base.plotted import Line, Plotted
from forklift.base.result_files import PAGE, earlier_files, json_rows
from forklift.fitting import comparison_words
from forklift.fitting.agreement import Agreement, Prediction, prediction_files
from forklift.fitting.compared import Compared
from forklift.fitting.lines import chosen, compared_lines
from forklift.fitting.origin import Origin, given
from forklift.plant.subject import Subject
from forklift.plant.subjects import CONDITIONS

MARK = "compare.json"


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Compared, Plotted):
    """What `compare` gives; `write` puts all of it into a folder."""

    @cached_property
    def sentences(self) -> tuple[str, ...]:
        """One plain sentence per headline: how good the fit is and where it is poor.

        Of a part without one the sentence says why, and how well the other signals fit.
        """
        return comparison_words.sentences(self)

    def write(self, out: str | Path) -> Path:
        """Write ``predictions/baseline/FILE.csv``, ``fit.csv``, ``compare.json`` and ``report.html``.

        The folder appears whole or not at all; an earlier result there is replaced.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` if `out` holds anything but an earlier result, ``"not-writable"``.
        """
        with output.folder(out, earlier_files(out, MARK, result_files), MARK) as temporary:
            self.agreement.write(temporary, "baseline")
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
        """The recording, and the machine."""
        words = self.machine.words
        return f"{chosen(self.predictions, file).recording.file}, by {words.noun} “{self.machine.name}”"

    def lines(self, file: str | None = None) -> Sequence[Line]:
        """See `plot`."""
        return compared_lines(self.predictions, dict(self.fits.select("channel", "unit").iter_rows()), file)

    def to_dict(self) -> dict[str, Any]:
        """Verdict, tables, and the version and hashes of what they were made from, for JSON."""
        from forklift import __version__

        return {
            "schema": 2,
            "forklift": __version__,
            "campaign": dict(self.origin.facts),
            **self.machine.facts(),
            "command": self.origin.command(self.machine, "compare"),
            "verdict": list(self.sentences),
            "validation": {channel: json_rows(self.validation(channel)) for _, channel in self.headlines},
            "fits": json_rows(self.fits),
            "phases": json_rows(self.phases),
        }

    def __str__(self) -> str:
        return "\n".join([*self.sentences, "", *present.tables(self)])

    def _repr_html_(self) -> str:
        return present.summary(self)

    def __repr__(self) -> str:
        return (
            f"Comparison({self.origin.name!r} with {self.machine.name!r}, "
            f"{len(self.predictions)} recordings, {len(self.fits)} fits)"
        )


def compare(
    machine: Any,
    recordings: Any,
    *,
    progress: Callable[[Prediction], None] | None = None,
    **options: Any,
) -> Comparison:
    """Replay every recording on a machine, free-running, and judge every signal.

    Nothing is adjusted to a recording: it starts where it says it starts, under the conditions that were
    entered. Velocities of a truck are compared as measured (`forklift.base.derivative.derivative`): the
    derivative of ``fork_height_m`` where it exists and a single lift is commanded, else of the lift's own
    encoder, measured and simulated through the same filter. All else is compared as it stands.

    Parameters
    ----------
    machine, recordings
        As `forklift.diagnose` takes them: what should explain the recordings, and what was measured.
    progress
        Called after each recording, from the calling thread.
    options
        Of a truck: ``oil_temperature_degc`` of recordings without one [°C], and what
        `forklift.plant.forklift.simulate.simulate` takes: ``solver``, ``tolerance``, ``substeps``.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``; what a run of the machine raises, see `forklift.simulate`.
    """
    conditions = {name: options.pop(name) for name in CONDITIONS if name in options}
    start, each, origin = given(machine, recordings, **conditions)
    return replayed(start, each, origin, progress=progress, **options)


def replayed(
    machine: Subject,
    recordings: Sequence[Any],
    origin: Origin,
    *,
    progress: Callable[[Prediction], None] | None = None,
    **settings: Any,
) -> Comparison:
    """See `compare`."""

    def one(recording: Any) -> Prediction:
        outputs = machine.replay(recording, **settings)
        signals = tuple(machine.signals(recording, outputs))
        return Prediction(recording, outputs, machine.conditions(recording, {}), (), signals)

    predictions: list[Prediction] = []
    with ThreadPoolExecutor(cpu_count()) as pool:
        try:
            for prediction in pool.map(one, recordings):
                predictions.append(prediction)
                if progress:
                    progress(prediction)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return Comparison(machine, origin, Agreement(machine, tuple(predictions)))


def result_files(recordings: Sequence[str]) -> frozenset[str]:
    """The files that `Comparison.write` makes of these recordings."""
    return frozenset({"fit.csv", PAGE, MARK, *prediction_files(recordings)})
