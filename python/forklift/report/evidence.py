"""The evidence for a diagnosis, in pictures first and in numbers below."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from forklift.plant.forklift import ports as unknown_ports
from forklift.plant.forklift import variables as operation
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.hypotheses import effect_specs
from forklift.report import charts, heat, law, parameters, rivals, words
from forklift.report.blocks import Block, Explorer, Figure, Points, Section, Table
from forklift.report.gains import every_fit, gains, validation
from forklift.report.tables import mean_square, percent, share
from forklift.report.traces import BAND, HOW_TO_READ, place, replays

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import Diagnosis
    from forklift.fitting.observed import Observed
    from forklift.recordings.channels import Lift

TELLING = 0.05
"""A variable that explains less than this share of the input is not worth a drawing."""


def evidence(found: Diagnosis, told: Mapping[str, Any]) -> Section:
    """Everything that speaks for the verdict."""
    changed = bool(found.final.hypotheses)
    blocks: list[Block] = [
        explorer(found, changed),
        _heat(found, changed),
        *_law(found),
        *_added(found),
        *rivals.contests(_contests(found, told["left_over"]), words.hypothesis),
        *_places(told),
        *(gains(found.before, found.after) if changed else validation(found.after)),
        _shares(told),
        every_fit(told["fit"], ["_before", "_after"] if changed else ["_after"]),
        *parameters.diagnosed(found, told["parameters"]),
    ]
    lead = (
        "Before is the truck with its parameters fitted to these recordings as well as can be; after is the "
        "same with what was found, fitted anew. Both were fitted on some of the recordings only; what counts "
        "are the others, held out."
        if changed
        else "The truck with its parameters fitted to some of the recordings; what counts are the others, "
        "held out. Nothing was added to it."
    )
    return Section("evidence", "Evidence", lead, blocks)


def explorer(found: Diagnosis, changed: bool) -> Explorer:
    """Every recording before and after, where it differs most first."""
    known = {(row["file"], row["channel"]): row for row in _fits(found)}
    left = [
        {(one.file, one.channel): one.mean_square for one in refit.judged}
        for refit in (found.baseline, found.final)
    ]

    def note(file: str, channel: str) -> str:
        row = known.get((file, channel))
        said = []
        if row and row["before"] is not None:
            both = [percent(row["before"]), *([percent(row["after"])] if changed else [])]
            said.append(f"fit {' → '.join(both)} % (NRMSE)")
        squares = [mean_square(side[file, channel]) for side in left if (file, channel) in side]
        if squares:
            said.append(f"left over {' → '.join(squares if changed else squares[:1])} times the noise")
        return "; ".join(said)

    sides = {"before": found.before, "after": found.after} if changed else {"simulated": found.after}
    recordings = replays(sides, note, {one.sensor.channel: one.sensor for one in _observed(found)})
    return Explorer(
        "Measured, before and after" if changed else "Measured and simulated",
        f"{HOW_TO_READ} {BAND}",
        list(sides),
        recordings,
        place(recordings, found.baseline.worst.file, found.baseline.worst.channel),
    )


def _observed(found: Diagnosis) -> Iterator[Observed]:
    for sample in found.final.found.problem.samples:
        yield from sample.observed


def _fits(found: Diagnosis) -> Iterator[dict[str, Any]]:
    after = {(r["file"], r["channel"]): r["nrmse_percent"] for r in found.after.fits.iter_rows(named=True)}
    for row in found.before.fits.iter_rows(named=True):
        key = row["file"], row["channel"]
        yield {"file": key[0], "channel": key[1], "before": row["nrmse_percent"], "after": after[key]}


def _heat(found: Diagnosis, changed: bool) -> Figure:
    models = {"before": found.baseline.judged, "after": found.final.judged}
    return heat.heat(
        found.campaign,
        found.start,
        models if changed else {"": found.final.judged},
        heat.note_on_noise(),
    )


def _law(found: Diagnosis) -> list[Figure]:
    """At the place of the cause, if an unknown input can act there, else where the recordings want one."""
    one = law.place_of(found)
    drawn = law.against(found, one) if one else []
    telling = [of for of in drawn if of.explained >= TELLING] or drawn[:1]
    own = not found.causes or (one is not None and law.is_at(one.port, found.causes[0].hypothesis))
    if one is None or not telling:
        return []
    lift = unknown_ports.lift_of(one.port) or "main"
    variables = [(of, _variable(of.variable, lift)) for of in telling]
    return [charts.law(words.Quantity(*words.place(one.port)), "truck", variables, own)]


def _variable(variable: str, lift: Lift) -> words.Quantity:
    name, unit = operation.words(variable, lift)
    return words.Quantity(name, *words.drawn(unit))


def _added(found: Diagnosis) -> list[Points]:
    """The equation of each cause that the catalogue knows, how it shows itself, and where it comes from."""
    effects = {effect.id: effect for effect in EFFECTS}
    said = []
    for hypothesis in dict.fromkeys(cause.hypothesis for cause in found.causes):
        if hypothesis.kind == "physics":
            spec = effect_specs()[hypothesis.id]
            said += [
                f"{words.capital(words.hypothesis(hypothesis))}: {spec['equation']}",
                f"How it shows itself: {effects[hypothesis.id].signature}",
                f"Source: {spec['source']}.",
            ]
    return [Points(said, "What was added to the model")] if said else []


def _contests(found: Diagnosis, left: Mapping[str, float]) -> list[rivals.Contest]:
    return [
        rivals.Contest([cause], "nothing added: the fitted truck", left["before"], left["after"])
        for cause in found.causes
        if cause.rivals or cause.hypothesis in found.final.hypotheses  # else seen before any fit
    ]


def _places(told: Mapping[str, Any]) -> list[Table]:
    return rivals.places(
        [
            (words.place(one["port"])[0], one["ln_evidence"], one["left_over"])
            for one in told["unknown_inputs"]
        ]
    )


def _shares(told: Mapping[str, Any]) -> Table:
    kinds = {
        "recording": "recording",
        "signal": "signal",
        "phase": "phase of the motion",
        "band": "frequency",
    }
    return Table(
        "What the fitted truck leaves over, by recording, signal, phase and frequency",
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
