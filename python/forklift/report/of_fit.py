"""The page of a fit: how well the fitted truck explains recordings, and what is known of its parameters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from forklift.fitting import files as fit_files
from forklift.plant.forklift.vocabulary import ForkliftWords
from forklift.plant.parameter import SCALES
from forklift.plant.subjects import subject
from forklift.report import charts, heat, page, parameters
from forklift.report.blocks import Block, Explorer, Fact, Figure, Page, Points, Section, Table
from forklift.report.fits import every_fit
from forklift.report.gains import gains
from forklift.report.provenance import provenance
from forklift.report.tables import mean_square, percent
from forklift.report.traces import BAND, HOW_TO_READ, place, replays
from forklift.report.words import GLOSSARY, NOISE, capital, number

if TYPE_CHECKING:
    from forklift.fitting.fit import Fit
    from forklift.fitting.profile import Profile

WORDS = ForkliftWords()


def fit_page(fit: Fit) -> str:
    """The page of a fit."""
    said = fit.verdict
    return page.html(
        Page(
            f"{capital(fit.campaign.title)} fitted from {fit.start.name}",
            f"Fit of {fit.campaign.title}, starting from the truck “{fit.start.name}”",
            said[0],
            (),
            _facts(fit),
            [
                _evidence(fit),
                Section("parameters", "Parameters", "", parameters.fitted(fit)),
                _doubts(fit),
                provenance(
                    fit.campaign,
                    {"Start": fit.start, "Fitted truck, truck.toml": fit.truck},
                    fit_files.command(fit),
                    [_search(fit)],
                ),
            ],
            GLOSSARY,
        )
    )


def _facts(fit: Fit) -> list[Fact]:
    told = fit.parameters["told"].to_list()
    worst = max(fit.held_out, key=lambda one: one.mean_square)
    bad = sum(not one.explained for one in fit.held_out)
    facts = []
    for lift in fit.lifts:
        before, after = (
            table["nrmse_percent"].drop_nulls().to_numpy()
            for table in (fit.before.validation(lift), fit.after.validation(lift))
        )
        if len(after) and len(before):
            facts.append(
                Fact(
                    f"How well does the {lift} lift fit?",
                    f"Velocity fit {before.mean():.1f} → {after.mean():.1f} %",
                    [
                        f"NRMSE, mean over {len(after)} recordings; at worst {before.min():.1f} → "
                        f"{after.min():.1f} %. 100 % is perfect."
                    ],
                )
            )
    left = (
        "Nothing but the sensors' noise."
        if fit.complete
        else f"Something, in {bad} of {len(fit.held_out)} signals."
    )
    return [
        *facts,
        Fact(
            "What is left over?",
            left,
            [
                f"At worst {number(worst.mean_square)} {NOISE}: the {WORDS.signal(worst.channel)} in "
                f"{worst.file}.",
                *([] if fit.complete else ["forklift diagnose finds what is missing."]),
            ],
        ),
        Fact(
            "What is known?",
            f"{told.count('yes')} of {len(told)} parameters, each by itself",
            [
                f"{told.count('together')} are known together with others only; of {told.count('no')} these "
                "recordings tell nothing. See Doubts."
            ],
        ),
    ]


def _evidence(fit: Fit) -> Section:
    rows = [
        row | {f"{fit_}_{when}": row[f"{fit_}_percent_{when}"] for fit_ in ("nmse", "nrmse")
               for when in ("before", "after")}
        for row in fit.fits.iter_rows(named=True)
    ]  # fmt: skip
    blocks: list[Block] = [
        _explorer(fit),
        heat.heat(subject(fit.start), fit.campaign.recordings, {"": fit.judged}),
        *gains(fit.before, fit.after),
        _mean_squares(fit),
        every_fit(rows, ["_before", "_after"]),
    ]
    lead = (
        "Before is the truck the fit started from; after is the fitted one. It was fitted on some of the "
        "recordings only; what counts are the others, held out."
    )
    return Section("evidence", "Evidence", lead, blocks)


def _explorer(fit: Fit) -> Explorer:
    known = {(row["file"], row["channel"]): row for row in fit.fits.iter_rows(named=True)}
    left = {(one.file, one.channel): one.mean_square for one in fit.judged}

    def note(file: str, channel: str) -> str:
        row = known[file, channel]
        said = []
        if row["nrmse_percent_after"] is not None:
            was, now = (percent(row[f"nrmse_percent_{when}"]) for when in ("before", "after"))
            said.append(f"fit {was} → {now} % (NRMSE)")
        if (file, channel) in left:
            said.append(f"left over {mean_square(left[file, channel])} times the noise")
        return "; ".join(said)

    recordings = replays({"before": fit.before, "after": fit.after}, note, fit.sensors)
    worst = max(fit.held_out, key=lambda one: one.mean_square)
    return Explorer(
        "Measured, before and after",
        f"{HOW_TO_READ} {BAND}",
        ["before", "after"],
        recordings,
        place(recordings, worst.file, WORDS.signal(worst.channel)),
    )


def _mean_squares(fit: Fit) -> Table:
    channels = list(fit.sensors)
    found = {(one.file, one.channel): one.mean_square for one in fit.judged}
    files = sorted({(one.role != "validate", one.file, one.role) for one in fit.judged})
    return Table(
        "What is left over of every recording and signal",
        ["Recording", "Role", *(WORDS.signal(channel) for channel in channels)],
        [
            [
                file, role,
                *("—" if (value := found.get((file, channel))) is None else mean_square(value)
                  for channel in channels),
            ]
            for _, file, role in files
        ],
        [False, False, *[True] * len(channels)],
        note="Mean square in units of the sensors' noise.",
        folded=True,
    )  # fmt: skip


def _doubts(fit: Fit) -> Section:
    blocks: list[Block] = [Points(fit.verdict[1:])] if fit.verdict[1:] else []
    blocks += [*_profiles(fit), charts.correlations([one.name for one in fit.unknowns], fit.knowledge)]
    blocks += [_sensors(fit), *_starts(fit)]
    return Section(
        "doubts", "Doubts", "What these recordings do not tell, and what the fit leaves open.", blocks
    )


def _profiles(fit: Fit) -> Iterator[Figure]:
    for found in fit.profiles:
        k = [unknown.name for unknown in fit.unknowns].index(found.name)
        unknown, deviation = fit.unknowns[k], fit.knowledge.estimates[k].deviation
        forth = SCALES[unknown.scale].forth
        theta = np.array([forth(value) for value in found.values.tolist()]) - forth(unknown.start[0])
        normal = ((theta / unknown.width - fit.found.x[k]) / deviation) ** 2
        yield charts.profile(found.name, unknown.unit, found.values, found.rise, normal, _interval(found))


def _interval(found: Profile) -> str:
    ends = [f"{end:.4g}" if np.isfinite(end) else "beyond" for end in (found.lower, found.upper)]
    return f"95 % interval from the profile: {ends[0]} to {ends[1]}"


def _sensors(fit: Fit) -> Table:
    return Table(
        "Sensors, as the samples tell them",
        ["Signal", "Noise", "Encoder's count", "Weighted as", "Widened by"],
        [
            [
                name, f"{sensor.noise:.3g}", f"{sensor.count:.3g}" if sensor.count else "—",
                f"{fit.noise[name]:.3g}", f"{fit.knowledge.widening.get(name, 1.0):.2f}",
            ]
            for name, sensor in fit.sensors.items()
        ],
        [False, True, True, True, True],
        folded=True,
    )  # fmt: skip


def _starts(fit: Fit) -> list[Table]:
    if len(fit.ends) < 2:
        return []
    return [
        Table(
            "Where the starts ended",
            ["Start", "Above the best, −ln posterior", "Furthest parameter [deviations]", "Same"],
            [
                [
                    str(end.start + 1),
                    f"{end.cost:.3g}" if np.isfinite(end.cost) else "failed",
                    f"{end.distance:.3g}" if np.isfinite(end.distance) else "—",
                    "yes" if end.same else "no",
                ]
                for end in fit.ends
            ],
            [True, True, True, False],
            folded=True,
        )
    ]


def _search(fit: Fit) -> Table:
    return Table(
        "The search",
        ["What", "Value"],
        [
            ["Evaluations with derivatives in the best search", str(fit.found.evaluations)],
            ["Seconds in all", f"{fit.seconds:.1f}"],
        ],
        [False, True],
    )
