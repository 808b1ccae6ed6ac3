"""The page of a comparison: how well a machine explains recordings, and where it does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from forklift.base.typeset import counted
from forklift.fitting.comparison_words import named
from forklift.report import page
from forklift.report.blocks import Explorer, Fact, Figure, Page, Panel, Section, Table
from forklift.report.fits import every_fit, operating_points, short
from forklift.report.provenance import provenance
from forklift.report.tables import percent, share
from forklift.report.traces import HOW_TO_READ, place, replays
from forklift.report.words import GLOSSARY, capital, number

if TYPE_CHECKING:
    from forklift.fitting.compare import Comparison


def comparison_page(comparison: Comparison) -> str:
    """The page of a comparison."""
    said, origin, machine = comparison.sentences, comparison.origin, comparison.machine
    channels = [channel for _, channel in comparison.headlines]
    return page.html(
        Page(
            f"{capital(origin.title)} compared with {machine.name}",
            f"{capital(origin.title)} compared with the {machine.words.noun} “{machine.name}”",
            said[0] if said else "No recording drives anything.",
            said[1:],
            [*(_fact(comparison, channel) for channel in channels), _next(comparison)],
            [
                Section(
                    "evidence",
                    "Measured and simulated",
                    "",
                    [
                        explorer(comparison),
                        *operating_points(machine, None, comparison.agreement, {}),
                        *(_where(comparison, channel) for channel in channels),
                        *(figure for channel in channels if (figure := _phases(comparison, channel))),
                        every_fit(short(comparison.fits), [""]),
                    ],
                ),
                provenance(
                    origin,
                    machine,
                    machine.facts(),
                    [one.recording for one in comparison.predictions],
                    origin.command(machine, "compare"),
                ),
            ],
            GLOSSARY,
        )
    )  # fmt: skip


def _next(comparison: Comparison) -> Fact:
    """What a reader does where the fit is poor."""
    fit, diagnose = (
        comparison.origin.command(comparison.machine, verb) or f"forklift.{verb}"
        for verb in ("fit", "diagnose")
    )
    return Fact(
        "What to do next?",
        "Where the fit is poor, fit the parameters.",
        [
            f"How much of the difference do other values of the parameters explain? {fit}",
            f"What may explain the rest? {diagnose}",
        ],
    )


def explorer(comparison: Comparison) -> Explorer:
    """Every recording, measured beside simulated."""
    known = {(row["file"], row["channel"]): row for row in comparison.fits.iter_rows(named=True)}
    words = comparison.machine.words

    def note(file: str, channel: str) -> str:
        row = known[file, channel]
        if row["nrmse_percent"] is None:
            return ""
        _, unit, scale = words.drawn(channel, row["unit"])
        return (
            f"fit {percent(row['nrmse_percent'])} % (NRMSE), {percent(row['nmse_percent'])} % (NMSE), "
            f"RMSE {number(row['rmse'] * scale)} {unit}".rstrip()
        )

    recordings = replays(comparison.machine, {"simulated": comparison.agreement}, note, {})
    file, channel = _worst(comparison)
    first = place(recordings, file, words.signal(channel))
    return Explorer("Every recording", HOW_TO_READ, ["simulated"], recordings, first)


def _worst(comparison: Comparison) -> tuple[str, str]:
    """The file and channel of the headline that fits worst, among those that are judged."""
    judged = [
        (row["nrmse_percent"], row["file"], channel)
        for _, channel in comparison.headlines
        for row in comparison.validation(channel).iter_rows(named=True)
        if row["nrmse_percent"] is not None
    ]
    return min(judged)[1:] if judged else ("", "")


def _fact(comparison: Comparison, channel: str) -> Fact:
    question = f"How well does {named(comparison.machine.words, channel).replace('The ', 'the ')} fit?"
    fits = comparison.validation(channel)["nrmse_percent"].drop_nulls().to_list()
    most = comparison.where(channel).row(0, named=True)
    if not fits:
        return Fact(question, "It cannot be judged.")
    return Fact(
        question,
        f"{sum(fits) / len(fits):.1f} % (NRMSE)",
        [
            f"Over {counted(len(fits), 'recording')}, from {min(fits):.1f} to {max(fits):.1f} %; "
            "100 % is perfect.",
            f"{share(most['share_of_misfit'])} % of the misfit lies in the phase “{most['phase']}”, "
            f"which takes {share(most['share_of_time'])} % of the time.",
        ],
    )


def _where(comparison: Comparison, channel: str) -> Table:
    return Table(
        f"Where the misfit of {comparison.machine.words.signal(channel)} lies",
        ["Phase", "Seconds", "Share of time [%]", "Share of misfit [%]"],
        [
            [
                row["phase"],
                f"{row['seconds']:.1f}",
                share(row["share_of_time"]),
                share(row["share_of_misfit"]),
            ]
            for row in comparison.where(channel).iter_rows(named=True)
        ],
        [False, True, True, True],
    )


def _phases(comparison: Comparison, channel: str) -> Figure | None:
    """Root mean square error of a headline, recording by phase."""
    own = comparison.phases.filter((pl.col("channel") == channel) & (pl.col("samples") > 0))
    if not len(own):
        return None
    words = comparison.machine.words
    name, unit, scale = words.fine(channel, _unit(comparison, channel))
    files, names = list(dict.fromkeys(own["file"])), list(dict.fromkeys(own["phase"]))
    cells = {
        (row["file"], row["phase"]): scale * (row["squared_error"] / row["samples"]) ** 0.5
        for row in own.iter_rows(named=True)
    }
    z = [
        [None if (v := cells.get((file, phase))) is None else float(f"{v:.4g}") for phase in names]
        for file in files
    ]
    trace = {
        "type": "heatmap", "x": names, "y": files, "z": z, "texttemplate": "%{z:.2g}",
        "textfont": {"size": 10}, "xgap": 1, "ygap": 1, "hoverongaps": False, "zmin": 0,
        "colorscale": [[0.0, "@cold"], [0.5, "@warm"], [1.0, "@hot"]],
        "hovertemplate": f"%{{y}}<br>%{{x}}: %{{z:.3g}} {unit}<extra></extra>",
        "colorbar": {"thickness": 10, "outlinewidth": 0, "title": {"text": unit}},
    }  # fmt: skip
    fixed = {"showgrid": False, "zeroline": False, "fixedrange": True, "type": "category"}
    layout = {
        "hovermode": "closest", "dragmode": False, "xaxis": fixed,
        "yaxis": fixed | {"autorange": "reversed", "dtick": 1, "tickfont": {"size": 10}},
    }  # fmt: skip
    said = f" [{unit}]" if unit else ""
    return Figure(
        f"{name if name == channel else capital(name)}: error by recording and phase",
        f"Root mean square of simulated less measured{said}. {comparison.machine.phase_note}",
        [Panel("", [trace], layout)],
        height=110 + 24 * len(files),
        least_px=540,
    )


def _unit(comparison: Comparison, channel: str) -> str:
    return str(comparison.fits.filter(pl.col("channel") == channel)["unit"][0])
