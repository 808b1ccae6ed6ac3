"""The evidence for a plant's diagnosis, in pictures first and in numbers below."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.curves import over_variables, variables
from forklift.diagnosis.dependence import TELLING
from forklift.diagnosis.plant_diagnose import widening
from forklift.diagnosis.plant_laws import laws
from forklift.report import charts, curves, parameters, rivals, traces
from forklift.report.blocks import Block, Drive, Explorer, Figure, Points, Replay, Section, Signal, Table
from forklift.report.plant import words
from forklift.report.words import Quantity, capital, number, printed

if TYPE_CHECKING:
    from forklift.diagnosis.locate import UnknownInput
    from forklift.diagnosis.plant_diagnose import PlantDiagnosis
    from forklift.diagnosis.plant_predict import Foreseen
    from forklift.fitting.interface import Problem
    from forklift.plant.protocol import Hypothesis


MOST_PLACES = 3
"""At so many places what the recordings ask for is drawn."""
BEYOND = 3.0
"""An unknown input that moves readings so many times as far as they are off is mostly made up for."""
MANY = 12
"""A table with more rows is folded."""
ROLES = {"validate": "held out", "estimate": "fitted on"}


def evidence(found: PlantDiagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks for the verdict."""
    changed = bool(found.final.hypotheses)
    blocks: list[Block] = [
        explorer(found, changed),
        *_errors(found, changed),
        *_asked_for(found),
        *_laws(found),
        *_added(found, told),
        *rivals.contests(list(_contests(found)), words.hypothesis, ""),
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


def _asked_for(found: PlantDiagnosis) -> Iterator[Figure]:
    """At the likeliest place, and where a cause acts, if something tells what is asked for there."""
    if not found.inputs:
        return
    named = dict.fromkeys(
        port for cause in found.causes for port in words.ports(found.plant, cause.hypothesis)
    )
    own = [one for name in named for one in found.inputs if one.port == name and one is not found.inputs[0]]
    problem = found.baseline.early.problem
    for one in [found.inputs[0], *own][:MOST_PLACES]:
        likeliest = one is found.inputs[0]
        shapes = found.shapes if likeliest else over_variables(found.baseline, one, "")
        telling = [of for of in shapes if of.explained >= TELLING] or (list(shapes[:1]) if likeliest else [])
        if not telling:
            continue
        given = variables(problem, found.baseline.early.x, "", one.centres)
        final = curves.had_it_been(found.baseline, found.final, one.port)
        drawn = curves.against(one, telling, given, final)
        said = partial(words.quantity, found.plant)
        where = Quantity(words.place(found.plant, one.port), said(one.port).unit)
        at = not found.causes or one.port in named
        beyond = _beyond(problem, found.baseline.early.x, one)
        more = (
            f" Beware of the scale: by itself this would move the readings {number(beyond, 2)} times as far "
            "as they lie off the fitted model; parameters of the model make up for most of it, so that a "
            "straight line here means little."
            if beyond > BEYOND
            else ""
        )
        yield charts.law(where, "model", [(of, said(of.variable)) for of in drawn], at, more)


def _beyond(problem: Problem, x: Floats, one: UnknownInput) -> float:
    """How many times as far as the readings are off the model an unknown input would move them by itself."""
    if one.port in problem.machine.outputs:
        return 0.0
    moved, off = 0.0, 0.0
    width_s = problem.machine.hat_width_s(problem.samples)
    for k, (sample, model) in enumerate(zip(problem.samples, problem.said(x), strict=True)):
        answers = problem.respond(x, k, one.port, one.centres[k], width_s) @ one.values[k]
        for seen in sample.observed:
            noise = seen.sensor.noise
            moved += float(np.sum((answers[seen.rows, seen.column] / noise) ** 2))
            off += float(np.sum((seen.left(model[seen.sensor.channel]) / noise) ** 2))
    return float(np.sqrt(moved / off)) if off else 0.0


def _laws(found: PlantDiagnosis) -> Iterator[Figure]:
    """What was found, as the final model has it."""
    panels = []
    for one in laws(found.final):
        x = words.quantity(found.plant, one.variable) if one.variable else Quantity("time", "s")
        y = words.quantity(found.plant, one.port)
        telling = f" ({100 * max(one.explained, 0.0):.0f} % told by it)" if one.variable else ", a constant"
        label = f"{one.effect.name}, against {x.name}{telling}"
        panels.append(charts.scattered(label, x, y, one.values, one.added))
    if panels:
        yield Figure(
            "The law that was found",
            "What each effect that was found adds, at every moment of the recordings fitted, against the "
            "variable that tells it best. Where dots do not lie on a line, it depends on more than that.",
            panels,
            choose="Effect",
        )


def _added(found: PlantDiagnosis, told: Mapping[str, Any]) -> Iterator[Points]:
    """Each cause: where it enters, its numbers and where its law stands."""
    items = []
    for cause in found.causes:
        effect = words.effect(found.plant, cause.hypothesis)
        where = " and ".join(words.ports(found.plant, cause.hypothesis))
        size = "; ".join(words.sizes(told, cause.hypothesis))
        source = f" Source: {effect.source}." if effect and effect.source else ""
        items.append(
            f"{capital(words.hypothesis(cause.hypothesis))} — “{cause.hypothesis.label}”"
            f"{f', at {where}' if effect else ''}{f': {size}' if size else ''}.{source}"
        )
    if items:
        yield Points(items, "What was added to the model")


def _contests(found: PlantDiagnosis) -> Iterator[rivals.Contest]:
    """Round by round: what was found in it, beside what was found in rounds before."""
    known: tuple[Hypothesis, ...] = ()
    before, rounds = found.baseline.reduced_chi2, []
    for step in found.selection.steps:
        if step.accepted is not None:
            new = [one for one in step.accepted.hypotheses if one not in known]
            rounds.append((known, before, step.accepted.reduced_chi2, new))
            known, before = step.accepted.hypotheses, step.accepted.reduced_chi2
    rounds.append((known, before, found.final.reduced_chi2, list(found.final.hypotheses)))
    told: set[Hypothesis] = set()
    for place, (without, left, after, new) in enumerate(rounds):
        if not set(without) <= set(found.final.hypotheses):  # given up again
            without, left = (), found.baseline.reduced_chi2
        causes = [one for one in found.causes if one.hypothesis in new and one.hypothesis not in told]
        told |= {one.hypothesis for one in causes}
        if causes:
            alone = " and ".join(map(words.hypothesis, without))
            yield rivals.Contest(
                causes,
                f"{alone}, and nothing else" if without else "nothing added: the fitted model",
                left,
                after,
                f"What each explanation leaves over{f', round {place + 1}' if len(rounds) > 2 else ''}",
            )


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
