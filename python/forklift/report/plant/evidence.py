"""The evidence for a plant's diagnosis, in pictures first and in numbers below."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from forklift.plant.diagnose import widening
from forklift.plant.shapes import over_variables, respond, variables, width_s
from forklift.report import charts, curves, parameters, rivals, traces
from forklift.report.blocks import Block, Drive, Explorer, Figure, Points, Replay, Section, Signal, Table
from forklift.report.plant import words
from forklift.report.words import Quantity, capital, number, printed

if TYPE_CHECKING:
    from forklift.plant.diagnose import PlantDiagnosis
    from forklift.plant.foreseen import Foreseen
    from forklift.plant.problem import PlantProblem

Floats = NDArray[np.float64]

TELLING = 0.05
"""A variable that explains less than this share of the input is not worth a drawing."""
MOST_PLACES = 3
"""At so many places what the recordings ask for is drawn."""
MANY = 12
"""A table with more rows is folded."""
ROLES = {"validate": "held out", "estimate": "fitted on"}


def evidence(found: PlantDiagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks for the verdict."""
    changed = bool(found.final.suspects)
    blocks: list[Block] = [
        explorer(found, changed),
        *_errors(found, changed),
        *_laws(found),
        *_added(found, told),
        *rivals.contests(list(_contests(found)), words.suspect, ""),
        *rivals.places(
            [(words.place(found.plant, one.port), one.evidence, one.noise**2) for one in found.inputs]
        ),
        _parameters(found, told, changed),
    ]
    held = (
        " Fitted on some of the recordings only; what counts are the others, held out."
        if found.judged_on == "validate"
        else " No recording was held out, so that all of this is on what was fitted."
    )
    lead = (
        "Before is the model with its parameters fitted to these recordings as well as can be; after is the "
        f"same with what was found, fitted anew.{held}"
        if changed
        else f"The model with its parameters fitted. Nothing was added to it.{held}"
    )
    return Section("evidence", "Evidence", lead, blocks)


def explorer(found: PlantDiagnosis, changed: bool) -> Explorer:
    """Every recording before and after, what was held out first, where it differs most first."""
    sides = {"before": found.before, "after": found.after} if changed else {"simulated": found.after}
    together = sorted(
        zip(*sides.values(), strict=True), key=lambda told: told[0].recording.role != "validate"
    )
    seen = [one.name for one in found.plant.outputs]
    columns = len(together) * (len(seen) * (2 + len(sides)) + len(found.plant.inputs))
    most = traces.points(columns)
    replays = [_replay(found, dict(zip(sides, told, strict=True)), most) for told in together]
    worst = max(
        (one for one in found.scores if one.role == found.judged_on),
        key=lambda one: one.rmse_before / found.sensors[one.output].noise,
    )
    return Explorer(
        "Measured, before and after" if changed else "Measured and simulated",
        f"{traces.READ.format('what drove it')} Grey band: what the sensor's noise alone would leave, 95 "
        f"times in 100.{_noise(found)}",
        list(sides),
        replays,
        next(
            (k, titles.index(_title(worst.output)))
            for k, one in enumerate(replays)
            for titles in [[shown.title for shown in one.signals]]
            if one.title == worst.file
        ),
    )


def _noise(found: PlantDiagnosis) -> str:
    told = [one.name for one in found.plant.outputs if one.sigma is None]
    return f" The noise of {', '.join(told)} was told from the samples." if told else ""


def _title(output: str) -> str:
    return output


def _replay(found: PlantDiagnosis, told: Mapping[str, Foreseen], most: int) -> Replay:
    first = next(iter(told.values()))
    recording, plant = first.recording, found.plant
    rows = {one.output: one for one in found.scores if one.file == recording.file}
    signals: list[Signal] = []
    for one in plant.outputs:
        measured = recording.y.get(one.name)
        if measured is None:
            continue
        row, note = rows.get(one.name), ""
        if row is not None:
            values = [row.rmse_before, row.rmse_after][-len(told) :]
            note = f"root mean square error {' → '.join(map(number, values))} {printed(one.unit)}".rstrip()
        signals.append(
            traces.drawn(
                Quantity(_title(one.name), printed(one.unit)),
                recording.time_s,
                measured,
                {side: seen.outputs[one.name] for side, seen in told.items()},
                note,
                most,
                traces.band(found.sensors[one.name]),
            )
        )
    drives = []
    for driver in plant.inputs:
        thin, kept = traces.decimate(most, recording.time_s, recording.u[driver.name])
        drawn = {"x": traces.numbers(thin), driver.name: traces.numbers(kept)}
        drives.append(Drive(driver.name, printed(driver.unit), drawn, driver.hold == "zero"))
    said = [f"{name} {value:g}" for name, value in recording.conditions.items()]
    said += [f"group {recording.group}"] if recording.group else []
    adjusted = [f"adjusted to it: {', '.join(first.adjusted)}"] if first.adjusted else []
    return Replay(
        recording.file, capital(ROLES[recording.role]), ", ".join([*said, *adjusted]), signals, drives
    )


def _errors(found: PlantDiagnosis, changed: bool) -> Iterator[Table]:
    """By recording and output, beside the sensor's noise: what was held out, then what was fitted on."""
    units = {one.name: one.unit for one in found.plant.outputs}
    for role in ("validate", "estimate"):
        rows = [one for one in found.scores if one.role == role]
        if not rows:
            continue
        head = [
            "Recording",
            "Output",
            *(["Before", "After"] if changed else ["Error"]),
            "Noise",
            "Unit",
            "Samples",
        ]
        yield Table(
            f"Root mean square errors, {ROLES[role]}",
            head,
            [
                [
                    one.file, one.output, *([number(one.rmse_before)] if changed else []),
                    number(one.rmse_after), number(found.sensors[one.output].noise),
                    printed(units[one.output]), str(one.samples),
                ]
                for one in rows
            ],
            [False, False, *[True] * (len(head) - 4), False, True],
            note="Noise: standard deviation of the sensor's, as given, or told from the samples: a little "
            "too much where the truth has kinks.",
            folded=len(rows) > MANY or role != found.judged_on,
        )  # fmt: skip


def _laws(found: PlantDiagnosis) -> Iterator[Figure]:
    """At the place of each cause, if an unknown input was looked for there, else where most is explained."""
    if not found.inputs:
        return
    named = dict.fromkeys(port for cause in found.causes for port in words.ports(found.plant, cause.suspect))
    own = [one for name in named for one in found.inputs if one.port == name][:MOST_PLACES]
    problem = cast("PlantProblem", found.baseline.early.problem)
    for one in own or found.inputs[:1]:
        shapes = found.shapes if one is found.inputs[0] else over_variables(found.baseline, one)
        given = variables(problem, found.baseline.early.x, one)
        final = curves.had_it_been(found.baseline, found.final, one.port, respond, width_s(problem))
        drawn = curves.against(one, shapes, given, final)
        drawn = [of for of in drawn if of.explained >= TELLING] or drawn[:1]
        said = partial(words.quantity, found.plant)
        where = Quantity(words.place(found.plant, one.port), said(one.port).unit)
        if drawn:
            yield charts.law(
                where, "model", [(of, said(of.variable)) for of in drawn], bool(own) or not found.causes
            )


def _added(found: PlantDiagnosis, told: Mapping[str, Any]) -> Iterator[Points]:
    """Each cause: where it enters, its numbers and where its law stands."""
    items = []
    for cause in found.causes:
        effect = words.effect(found.plant, cause.suspect)
        where = " and ".join(words.ports(found.plant, cause.suspect))
        size = "; ".join(words.sizes(told, cause.suspect))
        source = f" Source: {effect.source}." if effect and effect.source else ""
        items.append(
            f"{capital(words.suspect(cause.suspect))} — “{cause.suspect.label}”"
            f"{f', at {where}' if effect else ''}{f': {size}' if size else ''}.{source}"
        )
    if items:
        yield Points(items, "What was added to the model")


def _contests(found: PlantDiagnosis) -> Iterator[rivals.Contest]:
    """Each cause among the rivals of its round: beside what was found in rounds before."""
    known, before, without = set(), found.baseline.left_over, "nothing added: the fitted model"
    after = {}
    for step in found.selection.steps:
        if step.accepted is not None:
            for one in step.accepted.suspects:
                if one not in known:
                    after[one] = without, before, step.accepted.left_over
            known |= set(step.accepted.suspects)
            before = step.accepted.left_over
            without = f"with {' and '.join(map(words.suspect, step.accepted.suspects))} alone"
    last = without, before, found.final.left_over
    for cause in found.causes:
        yield rivals.Contest(cause, *after.get(cause.suspect, last))


def _parameters(found: PlantDiagnosis, told: Mapping[str, Any], changed: bool) -> Table:
    rows = [
        {
            "name": row["name"],
            "unit": row["unit"],
            "start": row["start"],
            "before": row["before"],
            "after": row,
        }
        for row in told["parameters"]
    ]
    wide = widening(found.baseline), widening(found.final)
    bars = parameters.changes(found.baseline if changed else None, found.final, wide)
    return parameters.table("Parameters", rows, bars, changed, folded=False)
