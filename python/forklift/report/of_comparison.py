"""The page of a comparison: how well a truck explains recordings, and where it does not."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forklift.fitting.compare import command_line, temperature_option
from forklift.plant.forklift.vocabulary import SHOWN, ForkliftWords
from forklift.recordings.channels import LIFTS
from forklift.report import page
from forklift.report.blocks import Explorer, Fact, Figure, Page, Panel, Section, Table
from forklift.report.fits import every_fit
from forklift.report.gains import validation
from forklift.report.provenance import provenance
from forklift.report.tables import percent, share
from forklift.report.traces import HOW_TO_READ, place, replays
from forklift.report.words import GLOSSARY, capital

if TYPE_CHECKING:
    from forklift.fitting.compare import Comparison
    from forklift.recordings.channels import Lift


def comparison_page(comparison: Comparison) -> str:
    """The page of a comparison."""
    said, campaign, truck = comparison.verdict, comparison.campaign, comparison.truck
    again = command_line("compare", campaign, truck, temperature_option(comparison))
    lifts = [lift for lift in LIFTS if len(comparison.validation(lift))]
    return page.html(
        Page(
            f"{capital(campaign.title)} compared with {truck.name}",
            f"{capital(campaign.title)} compared with the truck “{truck.name}”",
            said[0] if said else "No recording commands a lift.",
            said[1:],
            [_fact(comparison, lift) for lift in lifts],
            [
                Section(
                    "evidence",
                    "Measured and simulated",
                    "",
                    [
                        explorer(comparison),
                        *validation(comparison),
                        *(_where(comparison, lift) for lift in lifts),
                        *(figure for lift in lifts if (figure := _phases(comparison, lift))),
                        every_fit(
                            [
                                {"file": row["file"], "role": row["role"], "channel": row["channel"],
                                 "nmse": row["nmse_percent"], "nrmse": row["nrmse_percent"],
                                 "rmse": row["rmse"], "unit": row["unit"]}
                                for row in comparison.fits.iter_rows(named=True)
                            ],
                            [""],
                        ),
                    ],
                ),
                provenance(campaign, {"Truck": truck}, again),
            ],
            GLOSSARY,
        )
    )  # fmt: skip


def explorer(comparison: Comparison) -> Explorer:
    """Every recording, measured beside simulated."""
    known = {(row["file"], row["channel"]): row for row in comparison.fits.iter_rows(named=True)}

    def note(file: str, channel: str) -> str:
        row = known[file, channel]
        if row["nrmse_percent"] is None:
            return ""
        _, unit, scale = SHOWN[row["unit"]]
        return (
            f"fit {percent(row['nrmse_percent'])} % (NRMSE), {percent(row['nmse_percent'])} % (NMSE), "
            f"RMSE {row['rmse'] * scale:.3g} {unit}"
        )

    recordings = replays({"simulated": comparison}, note)
    file, channel = _worst(comparison)
    return Explorer(
        "Every recording",
        HOW_TO_READ,
        ["simulated"],
        recordings,
        place(recordings, file, ForkliftWords().signal(channel)),
    )


def _worst(comparison: Comparison) -> tuple[str, str]:
    """The file and channel of the velocity that fits worst, among those that are judged."""
    judged = [
        (row["nrmse_percent"], row["file"], f"velocity_{lift}_m_s")
        for lift in LIFTS
        for row in comparison.validation(lift).iter_rows(named=True)
        if row["nrmse_percent"] is not None
    ]
    return min(judged)[1:] if judged else ("", "")


def _fact(comparison: Comparison, lift: Lift) -> Fact:
    table = comparison.validation(lift)
    fits = table["nrmse_percent"].drop_nulls().to_list()
    most = comparison.where(lift).row(0, named=True)
    if not fits:
        return Fact(f"How well does the {lift} lift fit?", "It cannot be judged.")
    return Fact(
        f"How well does the {lift} lift fit?",
        f"{sum(fits) / len(fits):.1f} % of the velocity (NRMSE)",
        [
            f"Over {len(fits)} recordings, from {min(fits):.1f} to {max(fits):.1f} %; 100 % is perfect.",
            f"{share(most['share_of_misfit'])} % of the misfit lies in the phase “{most['phase']}”, "
            f"which takes {share(most['share_of_time'])} % of the time.",
        ],
    )


def _where(comparison: Comparison, lift: Lift) -> Table:
    return Table(
        f"Where the misfit of the {lift} lift's velocity lies",
        ["Phase", "Seconds", "Share of time [%]", "Share of misfit [%]"],
        [
            [
                row["phase"],
                f"{row['seconds']:.1f}",
                share(row["share_of_time"]),
                share(row["share_of_misfit"]),
            ]
            for row in comparison.where(lift).iter_rows(named=True)
        ],
        [False, True, True, True],
    )


def _phases(comparison: Comparison, lift: Lift) -> Figure | None:
    """Root mean square error of the velocity, recording by phase."""
    import polars as pl

    own = comparison.phases.filter((pl.col("lift") == lift) & (pl.col("seconds") > 0.0))
    if not len(own):
        return None
    files, names = list(dict.fromkeys(own["file"])), list(dict.fromkeys(own["phase"]))
    rate = {one.file: one.sample_rate_hz for one in comparison.campaign.recordings}
    cells = {
        (row["file"], row["phase"]): (row["squared_error"] / (row["seconds"] * rate[row["file"]])) ** 0.5
        for row in own.iter_rows(named=True)
    }
    z = [
        [None if (v := cells.get((file, name))) is None else round(v, 5) for name in names] for file in files
    ]
    trace = {
        "type": "heatmap", "x": names, "y": files, "z": z, "texttemplate": "%{z:.2g}",
        "textfont": {"size": 10}, "xgap": 1, "ygap": 1, "hoverongaps": False, "zmin": 0,
        "colorscale": [[0.0, "@cold"], [0.5, "@warm"], [1.0, "@hot"]],
        "hovertemplate": "%{y}<br>%{x}: %{z:.3g} m/s<extra></extra>",
        "colorbar": {"thickness": 10, "outlinewidth": 0, "title": {"text": "m/s"}},
    }  # fmt: skip
    fixed = {"showgrid": False, "zeroline": False, "fixedrange": True, "type": "category"}
    layout = {
        "hovermode": "closest", "dragmode": False, "xaxis": fixed,
        "yaxis": fixed | {"autorange": "reversed", "dtick": 1, "tickfont": {"size": 10}},
    }  # fmt: skip
    return Figure(
        f"Velocity of the {lift} lift: error by recording and phase",
        "Root mean square of simulated less measured velocity [m/s].",
        [Panel("", [trace], layout)],
        height=110 + 24 * len(files),
        least_px=540,
    )
