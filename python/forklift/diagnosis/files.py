"""What a diagnosis leaves behind: its sentence, its JSON as the schema lays down, and its folder."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl
from scipy.stats import norm

from forklift.base import output, present
from forklift.base.numbers import defined
from forklift.base.result_files import PAGE, earlier_files
from forklift.diagnosis.conditions import offsets
from forklift.diagnosis.criteria import AS_GOOD
from forklift.diagnosis.ledger import considered
from forklift.fitting.compare import (
    campaign_facts,
    command_line,
    prediction_files,
    temperature_option,
    truck_facts,
)
from forklift.plant.forklift import variables as operation
from forklift.plant.sensor_faults import SensorUnknown
from forklift.recordings.channels import LIFTS

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.dependence import Shape
    from forklift.diagnosis.diagnose import Diagnosis
    from forklift.plant.protocol import Hypothesis
    from forklift.recordings.channels import Lift

MARK = "diagnosis.json"
TRUCK = "truck.toml"
COMMAND = "next_recording.csv"
LEVEL = 0.99
"""Of the intervals of what was found missing."""
DRAWS = 2000
"""Of resampled sets of recordings, for the interval of the gain."""
SPOILT = ("sensor_stuck", "sensor_slip")
"""Causes that are seen before any fit."""
FLAT = 0.3
"""A curve that varies by no more than this share of its largest absolute value is a constant."""
TELLING = 0.2
"""A variable is worth naming if the input is this much a function of it."""


def sentence(found: Diagnosis) -> str:
    """The verdict in one sentence."""
    judged = {one.file for one in found.final.held_out}
    if found.unexcited:
        return f"No mismatch can be seen, and nothing be told of any effect: {found.unexcited}."
    if found.verdict == "no-mismatch":
        return (
            f"No mismatch: the fitted truck explains all {len(judged)} recordings held out to the sensors' "
            f"noise (mean square at most {found.final.worst.mean_square:.2f})."
        )
    if all(cause.hypothesis.id in SPOILT for cause in found.causes) and found.baseline.complete:
        return (
            f"A sensor fails: {' and '.join(_named(cause) for cause in found.causes)}; without these "
            f"samples the fitted truck explains all {len(judged)} recordings held out to the sensors' noise."
        )
    rose = _rise(found)
    if not found.causes and found.doubted:
        options = {
            " and ".join(one.name for one in hypotheses): share
            for cause in found.doubted
            for hypotheses, share, _ in [((cause.hypothesis,), cause.credibility, 0.0), *cause.rivals]
            if share >= AS_GOOD
        }
        listed = "; ".join(f"{name} ({share:.2f})" for name, share in options.items())
        return (
            "Something is missing, and several explanations fit the recordings held out about as well "
            f"(credibility): {listed}."
        )
    if not found.causes:
        assert found.location
        return (
            f"Something is missing that no hypothesis explains: it acts on the {found.location.equation} of "
            f"{_lifts(found.location.lift)}; {found.location.region}."
        )
    named = " and ".join(_named(cause) for cause in found.causes)
    if found.selection.curve and not any(cause.curve for cause in found.causes):
        named += ", perhaps by another law than the catalogue's"
    left = (
        "nothing is left over"
        if found.final.complete
        else "it is not the whole story: a mean square of up to "
        f"{found.final.worst.mean_square:.3g} times the noise's is left over"
    )
    return f"{named[:1].upper()}{named[1:]}{rose}, and {left}."


def _rise(found: Diagnosis) -> str:
    """What the causes gain: in the velocity, unless a sensor reads wrongly, which may not touch it."""
    if any(cause.hypothesis.kind == "sensor" for cause in found.causes):
        return (
            f"; what is left over falls from {found.baseline.worst.mean_square:.3g} to "
            f"{found.final.worst.mean_square:.3g} times the sensors' noise (mean square, worst signal)"
        )
    if found.final.loo_log_score:
        return (
            "; it shows in no recording alone, but all of them foretell each other better with it, by "
            f"{found.final.loo_log_score:.0f} in ln probability"
        )
    before, after = _velocity(found)
    return f"; the velocity's fit on recordings held out rises from {before:.1f} to {after:.1f} %"


def _named(cause: Cause) -> str:
    where = cause.hypothesis.where
    where = f"{where} lift" if where in LIFTS else where
    law = f", by another law than the catalogue's, a curve over {cause.curve.over}" if cause.curve else ""
    return f"{cause.hypothesis.name}{f' ({where})' if where else ''}{law}"


def region(seen: Sequence[Shape], lift: Lift) -> str:
    """Where the unknown input acts, in words and numbers."""
    telling = [shape for shape in seen if shape.explained >= TELLING][:2]
    if not telling:
        return "no more than a small share is a function of anything that was measured"
    first = telling[0]
    if np.ptp(first.curve) <= FLAT * np.abs(first.curve).max():
        return f"{100.0 * first.explained:.0f} % of it is about {first.curve.mean():+.3g} throughout"
    return "; ".join(
        f"{100.0 * shape.explained:.0f} % of it is a function of {_where(shape, lift)}" for shape in telling
    )


def _lifts(lift: str) -> str:
    return "both lifts" if lift == "both" else f"the {lift} lift"


def _where(shape: Shape, lift: Lift) -> str:
    """The variable, where the input acts most, and how it goes from there to there."""
    words, unit = operation.words(shape.variable, lift)
    low, high = shape.region
    ends = np.interp([low, high], shape.at, shape.curve)
    return f"the {words}, {ends[0]:+.3g} at {low:.3g} {unit} and {ends[1]:+.3g} at {high:.3g} {unit}"


def _velocity(found: Diagnosis) -> tuple[float, float]:
    sides = [
        comparison.fits.filter(pl.col("channel").str.starts_with("velocity") & (pl.col("role") == "validate"))
        for comparison in (found.before, found.after)
    ]
    means = [side["nrmse_percent"].drop_nulls().mean() for side in sides]
    return tuple(float("nan") if mean is None else float(mean) for mean in means)  # type: ignore[return-value, arg-type]


def text(found: Diagnosis) -> str:
    """For a terminal: the sentence first, then the evidence."""
    lines = [found.sentence, ""]
    if found.location:
        lines.append(
            f"Where: {found.location.equation} of {_lifts(found.location.lift)}, seen most in "
            f"{found.location.signal}. Of an unknown input there, {found.location.region}."
        )
        for one in found.inputs[:4]:
            lines.append(
                f"  an unknown input at {one.port}: ln evidence {one.evidence:.0f}, leaves {one.noise**2:.2f}"
            )
    for cause in found.causes:
        for row in [row for one in (cause.hypothesis, cause.curve) if one for row in _parameters(found, one)]:
            lines.append(
                f"  {row['name']} = {row['value']:.5g} {row['unit']} "
                f"({100 * LEVEL:g} %: {row['lower']:.5g} to {row['upper']:.5g})"
            )
        lines.append(f"  credibility {cause.credibility:.3f}, form {cause.form}")
        if cause.alone is not None:
            lines.append(f"  by the catalogue's law alone: leaves {cause.alone:.3g}")
        for hypotheses, share, left in cause.rivals:
            names = " and ".join(hypothesis.label for hypothesis in hypotheses)
            lines.append(f"  rival {names}: credibility {share:.3f}, leaves {left:.3g}")
    lines.append(
        f"Held out: mean square {found.baseline.reduced_chi2:.3g} before, "
        f"{found.final.reduced_chi2:.3g} after; "
        f"worst channel {found.baseline.worst.mean_square:.3g} before, "
        f"{found.final.worst.mean_square:.3g} after."
    )
    if found.untestable:
        lines.append(f"Untestable here: {', '.join(hypothesis.label for hypothesis in found.untestable)}.")
    lines += [caution.sentence for caution in found.cautions]
    lines.append(found.deficiency[1].sentence)
    lines += [one.sentence for one in found.regimes if one.agree is False]
    if found.next_recording:
        lines.append(f"Next recording ({COMMAND}): {found.next_why}.")
    lines.append("Seconds: " + ", ".join(f"{name} {seconds:.1f}" for name, seconds in found.seconds.items()))
    return "\n".join(lines)


def to_dict(found: Diagnosis) -> dict[str, Any]:
    """As the schema has it, and beside it what the evidence was."""
    from forklift import __version__

    return {
        "schema": 1,
        "forklift": __version__,
        "campaign": found.campaign.name,
        "campaign_facts": campaign_facts(found.campaign),
        "start": truck_facts(found.start),
        "truck": truck_facts(found.truck),
        "command": command_line("diagnose", found.campaign, found.start, temperature_option(found.before)),
        "verdict": found.verdict,
        "sentence": found.sentence,
        "location": None
        if found.location is None
        else {
            "lift": found.location.lift,
            "equation": found.location.equation,
            "signal": found.location.signal,
            "region": found.location.region,
            "share_of_misfit": found.location.share,
        },
        "causes": [_cause(found, cause) for cause in found.causes],
        "untestable": [hypothesis.label for hypothesis in found.untestable]
        + [caution.sentence for caution in found.cautions if caution.code.startswith("one-")],
        "not_separable": [
            [cause.hypothesis.label, *(one.label for one in cause.not_separable_from)]
            for cause in found.causes
            if cause.not_separable_from
        ]
        + [
            [cause.hypothesis.label, *("+".join(one.label for one in names) for names, *_ in cause.rivals)]
            for cause in found.doubted
        ],
        "next_recording": found.next_recording and found.next_recording.to_dict(COMMAND),
        "next_recording_why": found.next_why,
        "fit": _fit(found),
        "fit_summary": _summary(found),
        "errors": _errors(found),
        "left_over": {
            "before": found.baseline.reduced_chi2,
            "after": found.final.reduced_chi2,
            "worst_before": found.baseline.worst.mean_square,
            "worst_after": found.final.worst.mean_square,
            "gap_closed": defined(found.gap_closed),
        },
        "parameters": list(_changes(found)),
        "deficient": {
            "before": found.deficiency[0].to_dict(),
            "after": found.deficiency[1].to_dict(),
        },
        "misfit": [share.to_dict() for share in found.misfit],
        "regimes": [one.to_dict() for one in found.regimes],
        "hypotheses": [one.to_dict() for one in considered(found)],
        "unknown_inputs": [
            {"port": one.port, "ln_evidence": one.evidence, "left_over": one.noise**2} for one in found.inputs
        ],
        "functions_of": [
            {"variable": shape.variable, "explained": shape.explained} for shape in found.shapes
        ],
        "seconds": dict(found.seconds),
        "runtime_s": sum(found.seconds.values()),
    }


def _cause(found: Diagnosis, cause: Cause) -> dict[str, Any]:
    return {
        "id": cause.hypothesis.id,
        "kind": cause.hypothesis.kind,
        "name": cause.hypothesis.name,
        "where": cause.hypothesis.where,
        "equation": cause.hypothesis.equation,
        "credibility": cause.credibility,
        "form": cause.form,
        "parameters": list(_parameters(found, cause.hypothesis)),
        "curve": cause.curve
        and {
            "over": cause.curve.over,
            "parameters": list(_parameters(found, cause.curve)),
            "left_over_without": cause.alone,
        },
        "not_separable_from": [one.label for one in cause.not_separable_from],
        "rivals": [
            {"id": "+".join(one.id for one in hypotheses), "credibility": share, "left_over": left}
            for hypotheses, share, left in cause.rivals
        ],
    }


def _parameters(found: Diagnosis, hypothesis: Hypothesis) -> Iterator[dict[str, Any]]:
    """The hypothesis's parameters in the final model, with intervals widened by what is left over."""
    final = found.final
    if hypothesis.amplitude is None:
        if hypothesis in final.hypotheses:
            for one in offsets(final, hypothesis, LEVEL):
                yield {
                    "name": f"{hypothesis.id}.{one.name}{f' in {one.file}' if one.file else ''}",
                    "value": one.value,
                    "unit": one.unit,
                    "lower": one.lower,
                    "upper": one.upper,
                    "level": LEVEL,
                }
        return
    half = float(norm.ppf(0.5 + 0.5 * LEVEL)) * float(np.sqrt(max(1.0, final.reduced_chi2)))
    head = hypothesis.amplitude.rpartition(".")[0]
    for estimate, theta in zip(final.knowledge.estimates, final.found.x.tolist(), strict=False):
        unknown = estimate.unknown
        own = (
            unknown.name == hypothesis.amplitude
            if isinstance(unknown, SensorUnknown)
            else unknown.name.startswith(f"{head}.")
        )
        if own:
            ends = np.clip(
                [theta - half * estimate.deviation, theta + half * estimate.deviation],
                unknown.lower,
                unknown.upper,
            )
            lower, upper = sorted(float(unknown.values(float(end))[0]) for end in ends)
            yield {
                "name": unknown.name,
                "value": estimate.value,
                "unit": unknown.unit,
                "lower": lower,
                "upper": upper,
                "level": LEVEL,
            }


def _changes(found: Diagnosis) -> Iterator[dict[str, Any]]:
    """Every parameter that was estimated: by the fitted truck, and with what was found missing."""
    before, after = (
        {estimate.name: estimate for estimate in refit.knowledge.estimates}
        for refit in (found.baseline, found.final)
    )
    for name, estimate in {**before, **after}.items():
        row: dict[str, Any] = {
            "name": name,
            "unit": estimate.unknown.unit,
            "start": estimate.unknown.start[0],
            "level": 0.95,
        }
        for when, side in (("before", before), ("after", after)):
            known = side.get(name)
            row[when] = known and {
                "value": known.value,
                "lower": known.lower,
                "upper": known.upper,
                "told": known.identifiable,
            }
        yield row


def _fit(found: Diagnosis) -> list[dict[str, Any]]:
    keys = ["file", "role", "lift", "channel"]
    sides = [
        comparison.fits.select(
            *keys,
            pl.col("nrmse_percent").alias(f"nrmse_{when}"),
            pl.col("nmse_percent").alias(f"nmse_{when}"),
        )
        for when, comparison in (("before", found.before), ("after", found.after))
    ]
    joined = sides[0].join(sides[1].drop("role", "lift"), on=["file", "channel"], maintain_order="left")
    return [{key: defined(value) for key, value in row.items()} for row in joined.to_dicts()]


def _errors(found: Diagnosis) -> list[dict[str, Any]]:
    """Root mean square error of each commanded lift's signals, over the recordings held out together."""
    both = found.before.fits.join(
        found.after.fits, on=["file", "channel"], suffix="_after", maintain_order="left"
    ).filter(pl.col("rmse").is_not_null() & pl.col("rmse_after").is_not_null())
    own = both.filter(pl.col("commanded") | (pl.col("channel") == "fork_height_m"))
    held = own.filter(pl.col("role") == "validate")
    held = held if len(held) else own

    def together(column: str) -> pl.Expr:
        return ((pl.col(column) ** 2 * pl.col("samples")).sum() / pl.col("samples").sum()).sqrt()

    return (
        held.group_by("channel", "unit", maintain_order=True)
        .agg(before=together("rmse"), after=together("rmse_after"), recordings=pl.col("file").n_unique())
        .to_dicts()
    )


def _summary(found: Diagnosis) -> dict[str, Any]:
    """The velocity's fit on recordings held out, and the gain with an interval over whole recordings."""
    rows = [
        row
        for row in _fit(found)
        if row["role"] == "validate"
        and row["channel"].startswith("velocity")
        and row["nrmse_before"] is not None
    ]
    if not rows:
        return {}
    before, after = (np.array([row[f"nrmse_{when}"] for row in rows]) for when in ("before", "after"))
    random = np.random.default_rng(1)
    drawn = random.integers(len(rows), size=(DRAWS, len(rows)))
    lower, upper = np.quantile((after - before)[drawn].mean(axis=1), [0.025, 0.975])
    return {
        "validate": {
            "nrmse_before": float(before.mean()),
            "nrmse_after": float(after.mean()),
            "gain": float((after - before).mean()),
            "gain_lower": float(lower),
            "gain_upper": float(upper),
        }
    }


def write(found: Diagnosis, out: str | Path) -> Path:
    """See `Diagnosis.write`."""
    told = to_dict(found)
    with output.folder(out, earlier(out), MARK) as temporary:
        found.truck.write(temporary / TRUCK)
        found.before.write_predictions(temporary)
        found.after.write_predictions(temporary, "final")
        if found.next_recording:
            found.next_recording.write(temporary / COMMAND)
        text = json.dumps(told, indent=1, ensure_ascii=False, allow_nan=False)
        (temporary / MARK).write_text(text + "\n", encoding="utf-8", newline="\n")
        (temporary / PAGE).write_text(present.page(found, told), encoding="utf-8", newline="\n")
    return Path(out)


def earlier(out: str | Path) -> frozenset[str]:
    """The files of the earlier diagnosis that stands in `out`; none if there is none."""
    return earlier_files(out, MARK, files, "campaign_facts")


def files(recordings: Sequence[str]) -> frozenset[str]:
    """What a diagnosis of these recordings may hold."""
    before, after = prediction_files(recordings), prediction_files(recordings, "final")
    return frozenset({MARK, PAGE, TRUCK, COMMAND, *before, *after})
