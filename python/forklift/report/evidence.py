"""The evidence for a diagnosis, in pictures first and in numbers below."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from forklift.base.typeset import capital, number, printed
from forklift.diagnosis.conditions import offsets
from forklift.diagnosis.criteria import TOLD_REGION
from forklift.diagnosis.laws import Law, laws
from forklift.report import charts, heat, law, parameters, rivals
from forklift.report.blocks import Block, Explorer, Figure, Points, Section, Sketch, Table
from forklift.report.entered import entered
from forklift.report.fits import every_fit, operating_points
from forklift.report.instead import said
from forklift.report.tables import percent, share
from forklift.report.traces import BAND, HOW_TO_READ, place, recording_of, replays
from forklift.report.unseen import beyond
from forklift.report.words import REST, Quantity, left_over, mean_square, noise_power

if TYPE_CHECKING:
    from forklift.diagnosis.result import Diagnosis
    from forklift.fitting.residuals import ChannelResidual
    from forklift.plant.protocol import Hypothesis

HELD = {"validate": "held out", "estimate": "fitted on"}
ON_A_LINE = 0.995
"""Share of a law's square that its variable tells where all of it lies on one line."""
BEYOND = 3.0
"""An unknown input that moves readings so many times as far as they are off is mostly made up for."""


def evidence(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks for the verdict."""
    changed = bool(found.final.hypotheses)
    noun, drawn = found.machine.words.noun, laws(found.machine, found.final)
    blocks: list[Block] = [
        explorer(found, told, changed=changed),
        *_heat(found, changed=changed),
        *_circuit(found),
        *_laws(found, drawn),
        *(_asked_for(found, drawn) if told["verdict"] != "no-mismatch" else ()),
        *_conditions(found),
        *_added(found),
        *rivals.contests(list(_contests(found)), lambda one: said(found, one), f"; {REST}"),
        *rivals.places(
            [
                (found.machine.words.place(one["port"]).name, one["ln_evidence"], one["left_over"])
                for one in told["unknown_inputs"]
            ]
        ),
        *operating_points(found.machine, found.before if changed else None, found.after, found.sensors),
        _shares(found, told),
        every_fit(told["fit"], ["_before", "_after"] if changed else ["_after"]),
        *parameters.diagnosed(found, told["parameters"]),
    ]
    held = (
        " Fitted on some of the recordings only; what counts are the others, held out."
        if found.judged_on == "validate"
        else " No recording was held out, so that all of this is on what was fitted."
    )
    lead = (
        f"Before is the {noun} with its parameters fitted to these recordings as well as can be; after is "
        f"the same with what was found, fitted anew.{held}"
        if changed
        else f"The {noun} with its parameters fitted. Nothing was added to it.{held}"
    )
    return Section("evidence", "Evidence", lead, blocks)


def explorer(found: Diagnosis, told: Mapping[str, Any], *, changed: bool) -> Explorer:
    """Every recording before and after, what was held out first, where it differs most first."""
    words = found.machine.words
    rows = {(row["file"], row["channel"]): row for row in told["fit"]}
    left = [{(one.file, one.channel): one for one in refit.judged} for refit in (found.baseline, found.final)]

    def note(file: str, channel: str) -> str:
        row, notes = rows.get((file, channel)), []
        when = ("before", "after") if changed else ("after",)
        if row and not row["driven"]:
            notes.append("fit: not defined (the signal stands still)")
        elif row and row["nrmse_after"] is not None and row["nrmse_before"] is not None:
            notes.append(f"fit {' → '.join(percent(row[f'nrmse_{one}']) for one in when)} % (NRMSE)")
        if row and row["rmse_after"] is not None and row["rmse_before"] is not None:
            _, unit, scale = words.fine(channel, row["unit"])
            errors = " → ".join(number(scale * row[f"rmse_{one}"]) for one in when)
            notes.append(f"root mean square error {errors} {unit}".rstrip())
            powers = [noise_power(row[f"rmse_{one}"], found.sensors.get(channel)) for one in when]
            if None not in powers:
                notes.append(f"squared {' → '.join(map(number, powers))} times the noise power")
        judged = [side[file, channel] for side in left if (file, channel) in side]
        if judged:
            notes.append(left_over(judged if changed else judged[:1]))
        return "; ".join(notes)

    sides = {"before": found.before, "after": found.after} if changed else {"simulated": found.after}
    recordings = replays(found.machine, sides, note, found.sensors)
    worst = _first(found)
    return Explorer(
        "Measured, before and after" if changed else "Measured and simulated",
        f"{HOW_TO_READ} {BAND}",
        list(sides),
        recordings,
        place(recordings, recording_of(worst.file), words.signal(worst.channel)),
    )


def _first(found: Diagnosis) -> ChannelResidual:
    """The worst signal held out; where none is left over, of those that move; where what is left over shows
    in recordings that were fitted alone, of these."""
    if found.baseline.fitted_alone:
        return max(found.baseline.judged, key=lambda one: one.mean_square)
    driven = {(row["file"], row["channel"]) for row in found.before.held_out.iter_rows(named=True)}
    held = found.baseline.held_out
    seen = [one for one in held if not one.explained or (recording_of(one.file), one.channel) in driven]
    return max(seen or held, key=lambda one: one.mean_square)


def _heat(found: Diagnosis, *, changed: bool) -> Iterator[Figure]:
    both = {"before": found.baseline.judged, "after": found.final.judged}
    models = both if changed else {"": found.final.judged}
    yield from heat.heat(found.machine, found.recordings, models, found.sensors)


def _asked_for(found: Diagnosis, named: Sequence[Law]) -> Iterator[Figure]:
    """At the place of the cause, if an unknown input can act there, else where the recordings want one.

    Nothing where only bends tell, and what was found has none; nor of conditions that were entered wrongly,
    which act in many places.
    """
    if found.explaining and found.explaining[0].hypothesis.kind == "parameter":
        return
    one = law.place_of(found)
    drawn = law.against(found, one) if one else []
    telling = [of for of in drawn if of.explained >= TOLD_REGION]
    if one is None or not telling:
        return
    finest = max(len(of.at) for of in telling)
    if found.explaining and len(found.explaining[0].hypothesis.amplitudes) > finest:
        return  # a curve that is finer than what would be drawn here
    words, part = found.machine.words, found.machine.part_of(one.port)
    own = not found.explaining or law.is_at(found.machine, one.port, found.explaining[0].hypothesis)
    over = found.explaining[0].hypothesis.over.removeprefix("the ") if found.explaining else ""
    variables = [(of, Quantity(*words.variable(of.variable, part))) for of in telling]
    variables.sort(key=lambda one: one[1].name != over)  # that of the curve that was found first
    far = beyond(found.baseline, one)
    if far > BEYOND and named and all(of.slope is not None for of in named):
        return
    more = (
        " Its size is not to be trusted here: acting alone, it would move the readings "
        f"{number(far, 2)} times "
        "as far as they are from the fitted model. The fitted parameters cancel most of that, and could "
        "cancel a straight line altogether; only where it bends does it mean something."
        if far > BEYOND
        else ""
    )
    yield charts.law(Quantity(*words.place(one.port)), words.noun, variables, own, more)


def _circuit(found: Diagnosis) -> Iterator[Sketch]:
    """Where in the circuit something is wrong."""
    if found.location is None:
        return
    told = () if found.unexplained else found.causes
    marked = {cause.hypothesis.equation for cause in told} or {found.location.equation}
    alike = [one for cause in found.causes for one in cause.not_separable_from]
    tied = {one.equation for one in (*alike, *(row.other for row in found.confounded))} - marked
    words, part = found.machine.words, found.location.part
    drawn = words.circuit(marked, tied, part)
    if drawn:
        here, there = ("; ".join(sorted(map(words.equation, one))) for one in (marked, tied))
        dashed = f" Dashed, as these recordings do not part it from that: {there}." if tied else ""
        title = f"Where in the circuit: {words.part(part)}" if words.part(part) else "Where in the circuit"
        yield Sketch(title, f"Marked: {here}.{dashed}", drawn)


def _laws(found: Diagnosis, drawn: Sequence[Law]) -> Iterator[Figure]:
    """What was found, as the final model has it."""
    words, panels, slopes = found.machine.words, [], []
    for one in drawn:
        part = found.machine.part_of(one.port)
        x = Quantity(*words.variable(one.variable, part)) if one.variable else Quantity("time", "s")
        y = Quantity(*(words.place(one.port) if part else words.variable(one.port, "")))
        share = "" if one.explained > ON_A_LINE else f" ({100 * max(one.explained, 0.0):.0f} % told by it)"
        telling = share if one.variable else ", a constant"
        label = f"{one.name}, against {x.name}{telling}"
        values, added = x.scale * one.values, y.scale * one.added
        band = y.scale * one.band if one.explained > ON_A_LINE else None
        panels.append(charts.scattered(label, x, y, values, added, band))
        if one.slope is not None:
            rise = number(y.scale / x.scale * one.slope, 2)
            slopes.append(f"{one.name}: {rise} {printed(y.unit)} per {printed(x.unit) or 'one'}")
    if panels:
        straight = f" Slopes of straight lines: {'; '.join(slopes)}." if slopes else ""
        yield Figure(
            "The law that was found",
            "What each effect that was found adds, at every moment of the recordings fitted, against the "
            "variable that tells it best, with the 95 % interval of its own parameters as a band. Where dots "
            "do not lie on a line, it depends on more than that. Of a curve the mean is taken off: only its "
            f"shape is told.{straight}",
            panels,
            height=400,
            choose="Effect",
        )


def _conditions(found: Diagnosis) -> Iterator[Table]:
    """Of a condition that was entered wrongly, what was entered and what was found."""
    for cause in found.causes:
        own = list(offsets(found.final, cause.hypothesis))
        ends = {
            (row.file, row.name): (row.lower - row.value, row.upper - row.value)
            for row in own
            if row.file and not row.apart
        }
        apart = {(row.file, row.name): row for row in own if row.apart}
        rows = []
        for file, role, name, given, value in entered(found, cause.hypothesis):
            what, unit, _ = found.machine.words.condition(name)
            short = next((short for _, short in ends if name.startswith(short)), name)
            end, less = ends.get((file, short)), apart.get((file, short))
            row = [file, _tenth(given), _tenth(value)]
            row.append(f"{_tenth(value + end[0])} to {_tenth(value + end[1])}" if end else "—")
            if apart:
                span = f"{_tenth(less.lower)} to {_tenth(less.upper)}" if less else "—"
                row += [_tenth(less.value) if less else "—", span]
            rows.append([*row, f"{capital(what)} [{unit}]", HELD.get(role, role)])
        if rows:
            heads = ["Recording", "Entered or recorded", "Found", "95 % interval"]
            heads += ["Offset less their mean", "95 % interval"] if apart else []
            right = [0 < k < len(heads) for k in range(len(heads) + 2)]
            yield Table(
                "Conditions of the recordings, as entered and as found",
                [*heads, "Condition", "Role"],
                rows,
                right,
                note="Recordings fitted on have an interval; of those held out the condition was fitted "
                f"alone, with all else as it was found.{_untold(found) if apart else ''}"
                if ends
                else "",
            )


def _tenth(value: float) -> str:
    """To a tenth, and no zero with a minus."""
    return f"{round(value, 1) + 0.0:.1f}"


def _untold(found: Diagnosis) -> str:
    """What is told where a mean is not."""
    held = " and ".join(one.name for one in found.final.held)
    scale = f", as well as {held} is known, which was held as no recording tells it" if held else ""
    return (
        f" By how much their errors differ is told{scale}. How far all of them together are off is not, as "
        "other parameters make up for it."
    )


def _added(found: Diagnosis) -> Iterator[Points]:
    """The equation of each cause that the catalogue knows, how it shows itself, and where it comes from."""
    causes = dict.fromkeys(cause.hypothesis for cause in found.causes)
    items = [line for one in causes for line in found.machine.words.law(one)]
    if items:
        yield Points(items, "What was added to the model")


def _contests(found: Diagnosis) -> Iterator[rivals.Contest]:
    """Round by round: what was found in it, beside what was found in rounds before."""
    noun = found.machine.words.noun
    known: tuple[Hypothesis, ...] = ()
    before, rounds = found.baseline.reduced_chi2, []
    for step in found.selection.steps:
        if step.accepted is not None:
            new = [one for one in step.accepted.hypotheses if one not in known]
            rounds.append((known, before, step.accepted.reduced_chi2, new))
            known, before = step.accepted.hypotheses, step.accepted.reduced_chi2
    rounds.append((known, before, found.final.reduced_chi2, list(found.final.hypotheses)))
    seen: set[Hypothesis] = set()
    for count, (without, left, after, new) in enumerate(rounds):
        if not set(without) <= set(found.final.hypotheses):  # given up again
            without, left = (), found.baseline.reduced_chi2
        causes = [one for one in found.causes if one.hypothesis in new and one.hypothesis not in seen]
        seen |= {one.hypothesis for one in causes}
        if causes:
            alone = " and ".join(said(found, one) for one in without)
            yield rivals.Contest(
                causes,
                f"{alone}, and nothing else" if without else f"nothing added: the fitted {noun}",
                left,
                after,
                f"What each explanation leaves over{f', round {count + 1}' if len(rounds) > 2 else ''}",
            )


def _shares(found: Diagnosis, told: Mapping[str, Any]) -> Table:
    kinds = {
        "recording": "recording",
        "signal": "signal",
        "phase": "phase of the motion",
        "band": "frequency",
    }
    return Table(
        f"What the fitted {found.machine.words.noun} leaves over, by recording, signal, phase and frequency",
        ["By", "Name", "Mean square", "Share of misfit [%]"],
        [
            [kinds[one["by"]], one["name"], mean_square(one["mean_square"]), share(one["share"])]
            for one in told["misfit"]
        ],
        [False, False, True, True],
        note="Of all recordings, those fitted on too. Shares of each kind add up to 100 %; no share: no more "
        "than chance.",
        folded=True,
    )
