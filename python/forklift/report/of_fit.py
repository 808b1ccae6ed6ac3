"""The page of a fit: how well the fitted truck explains recordings, and what is known of its parameters."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from forklift.fitting import files as fit_files
from forklift.fitting.comparison_words import named
from forklift.plant.parameter import SCALES
from forklift.report import charts, heat, page, parameters
from forklift.report.blocks import Block, Explorer, Fact, Figure, Page, Points, Section, Table
from forklift.report.fits import every_fit, operating_points, short
from forklift.report.provenance import provenance
from forklift.report.tables import percent
from forklift.report.traces import BAND, HOW_TO_READ, place, recording_of, replays
from forklift.report.words import GLOSSARY, NOISE, PARAMETERS, capital, mean_square, number

if TYPE_CHECKING:
    from forklift.fitting.fit import Fit
    from forklift.fitting.profile import Profile


def fit_page(fit: Fit) -> str:
    """The page of a fit."""
    said = fit.sentences
    return page.html(
        Page(
            f"{capital(fit.origin.title)} fitted from {fit.machine.name}",
            f"Fit of {fit.origin.title}, starting from the {fit.machine.words.noun} “{fit.machine.name}”",
            said[0],
            (),
            _facts(fit),
            [
                _evidence(fit),
                Section("parameters", "Parameters", "", parameters.fitted(fit)),
                _doubts(fit),
                _provenance(fit),
            ],
            GLOSSARY | PARAMETERS,
        )
    )


def _provenance(fit: Fit) -> Section:
    facts = {**fit.machine.facts(), **fit.machine.facts_of(fit.values, fit.sources, fit.title)}
    command = fit_files.command(fit)
    return provenance(fit.origin, fit.machine, facts, fit.recordings, command, [_search(fit)])


def _facts(fit: Fit) -> list[Fact]:
    told = fit.parameters["told"].to_list()
    worst = max(fit.held_out, key=lambda one: one.mean_square)
    bad = sum(not one.explained for one in fit.held_out)
    facts, words = [], fit.machine.words
    for _, channel in fit.after.headlines:
        before, after = (
            side.validation(channel)["nrmse_percent"].drop_nulls().to_numpy()
            for side in (fit.before, fit.after)
        )
        if len(after) and len(before):
            facts.append(
                Fact(
                    f"How well does {named(words, channel).replace('The ', 'the ')} fit?",
                    f"{before.mean():.1f} → {after.mean():.1f} % (NRMSE)",
                    [
                        f"Mean over {len(after)} recordings; at worst {before.min():.1f} → "
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
                f"At worst {number(worst.mean_square)} {NOISE}: the {words.signal(worst.channel)} in "
                f"{worst.file}.",
            ],
        ),
        Fact(
            "Which parameters are identifiable?",
            f"{told.count('yes')} of {len(told)}, each by itself",
            [
                f"{told.count('together')} are identifiable together with others only. The value of "
                f"{told.count('no')} comes from the prior alone. See Doubts."
            ],
        ),
        _next(fit),
    ]


def _next(fit: Fit) -> Fact:
    """What a reader does with the fit."""
    question, noun = "What to do next?", fit.machine.words.noun
    kept = f"{fit.machine.file}, beside this page, is the fitted {noun}."
    if fit.interrupted:
        return Fact(question, "Run it to its end.", [kept])
    if fit.complete:
        return Fact(question, f"Use the fitted {noun}.", [kept])
    command = fit.origin.command(fit.machine, "diagnose")
    return Fact(
        question,
        "Find what is missing.",
        [f"What may explain it? {command or 'forklift.diagnose'}", kept],
    )


def _evidence(fit: Fit) -> Section:
    blocks: list[Block] = [
        _explorer(fit),
        *heat.heat(fit.machine, fit.recordings, {"": fit.judged}, fit.sensors),
        *operating_points(fit.machine, fit.before.agreement, fit.after.agreement, fit.sensors),
        _mean_squares(fit),
        every_fit(short(fit.fits), ["_before", "_after"]),
    ]
    held = (
        "It was fitted on some of the recordings only; what counts are the others, held out."
        if any(one.role == "validate" for one in fit.recordings)
        else "No recording was held out, so that all of this is on what was fitted."
    )
    lead = f"Before is the {fit.machine.words.noun} the fit started from; after is the fitted one. {held}"
    return Section("evidence", "Evidence", lead, blocks)


def _explorer(fit: Fit) -> Explorer:
    known = {(row["file"], row["channel"]): row for row in fit.fits.iter_rows(named=True)}
    left = {(one.file, one.channel): one.mean_square for one in fit.judged}

    def note(file: str, channel: str) -> str:
        row = known[file, channel]
        said = []
        if None not in (row["nrmse_percent_before"], row["nrmse_percent_after"]):
            was, now = (percent(row[f"nrmse_percent_{when}"]) for when in ("before", "after"))
            said.append(f"fit {was} → {now} % (NRMSE)")
        if (file, channel) in left:
            said.append(f"left over {mean_square(left[file, channel])} times the noise")
        return "; ".join(said)

    sides = {"before": fit.before.agreement, "after": fit.after.agreement}
    recordings = replays(fit.machine, sides, note, fit.sensors)
    worst = max(fit.held_out, key=lambda one: one.mean_square)
    return Explorer(
        "Measured, before and after",
        f"{HOW_TO_READ} {BAND}",
        ["before", "after"],
        recordings,
        place(recordings, recording_of(worst.file), fit.machine.words.signal(worst.channel)),
    )


def _mean_squares(fit: Fit) -> Table:
    channels = list(fit.sensors)
    found = {(one.file, one.channel): one.mean_square for one in fit.judged}
    files = sorted({(one.role != "validate", one.file, one.role) for one in fit.judged})
    return Table(
        "What is left over of every recording and signal",
        ["Recording", "Role", *(fit.machine.words.signal(channel) for channel in channels)],
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
    blocks: list[Block] = [Points(fit.sentences[1:])] if fit.sentences[1:] else []
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
