"""A diagnosis as ``diagnosis.json`` has it: schema 2, the same for every machine.

The schema itself is `diagnosis.schema.json`, beside this file.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from forklift.base.numbers import all_defined
from forklift.diagnosis import sentences
from forklift.diagnosis.ledger import considered
from forklift.diagnosis.numbers import numbers, of_hypothesis
from forklift.diagnosis.outcome import COMMAND
from forklift.fitting.agreement import change, together
from forklift.fitting.intervals import LEVEL

if TYPE_CHECKING:
    from forklift.diagnosis.causes import Cause
    from forklift.diagnosis.outcome import Outcome

SCHEMA = 2
DRAWS = 2000
"""Of resampled sets of recordings, for the interval of the gain."""


def to_dict(found: Outcome) -> dict[str, Any]:
    """Every fact of the page, and what the evidence was; what is not finite is null."""
    from forklift import __version__

    part = found.machine.part_word
    told = {
        "schema": SCHEMA,
        "forklift": __version__,
        "machine": found.machine.name,
        "campaign": found.origin.name,
        "campaign_facts": dict(found.origin.facts),
        **found.machine.facts(),
        **found.machine.facts_of(found.values, found.source, found.title),
        "command": found.origin.command(found.machine, "diagnose"),
        "verdict": found.verdict,
        "sentence": sentences.sentence(found),
        "location": None
        if found.location is None
        else {
            part: found.location.part,
            "equation": found.location.equation,
            "signal": found.location.signal,
            "region": found.location.region,
            "share_of_misfit": found.location.share,
        },
        "causes": [_cause(found, cause) for cause in found.causes],
        "doubted": [_cause(found, cause) for cause in found.doubted],
        "untestable": [hypothesis.label for hypothesis in found.untestable]
        + [one.sentence for one in found.findings.cautions if one.code.startswith("one-")],
        "cautions": [one.to_dict() for one in found.findings.cautions],
        "not_separable": [
            [cause.hypothesis.label, *(one.label for one in cause.not_separable_from)]
            for cause in found.causes
            if cause.not_separable_from
        ]
        + [
            [cause.hypothesis.label, *("+".join(one.label for one in names) for names, *_ in cause.rivals)]
            for cause in found.doubted
        ],
        "confounded": [
            {"cause": one.accepted.label, "other": one.other.label, "name": one.other.name,
             "where": one.other.where, "equation": one.other.equation, "share": one.share}
            for one in found.confounded
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
            "gap_closed": found.gap_closed,
        },
        "led_by_all": bool(found.causes) and found.final.pooled,
        "parameters": list(_changes(found)),
        "deficient": {
            "before": found.deficiency[0].to_dict(),
            "after": found.deficiency[1].to_dict(),
        },
        "misfit": [share.to_dict() for share in found.misfit],
        "regimes": [one.to_dict() for one in found.regimes],
        "groups": [one.to_dict() for one in found.groups],
        "outlying_groups": list(found.outlying_groups),
        "hypotheses": [one.to_dict() for one in considered(found)],
        "unknown_inputs": [
            {"port": one.port, "ln_evidence": one.evidence, "left_over": one.noise**2} for one in found.inputs
        ],
        "functions_of": [
            {"variable": one.variable, "explained": one.explained, "region": list(one.region)}
            for one in found.dependences
        ],
        "recordings": [
            {
                "file": one.recording.file,
                "role": one.recording.role,
                "group": one.recording.group,
                "samples": len(one.recording),
                "sha256": one.recording.sha256,
                "conditions": dict(one.conditions),
                "adjusted": list(one.adjusted),
            }
            for one in found.after.predictions
        ],
        "runtime_s": None,  # in times.json: the same call gives the same bytes here
    }  # fmt: skip
    finite: dict[str, Any] = all_defined(told)
    return finite


def _cause(found: Outcome, cause: Cause) -> dict[str, Any]:
    used = found.in_use.get(cause.hypothesis.label)
    return {
        "id": cause.hypothesis.id,
        "label": cause.hypothesis.label,
        "kind": cause.hypothesis.kind,
        "name": cause.hypothesis.name,
        "where": cause.hypothesis.where,
        "equation": cause.hypothesis.equation,
        "credibility": cause.credibility,
        "share": cause.share,
        "form": cause.form,
        "parameters": [one.to_dict() for one in of_hypothesis(found.final, cause.hypothesis)],
        "beyond": [{"name": one.number.name, "least": one.least, "most": one.most} for one in cause.beyond],
        "curve": cause.curve
        and {
            "over": cause.curve.over,
            "parameters": [row.to_dict() for one in cause.curves for row in of_hypothesis(found.final, one)],
            "left_over_without": cause.alone,
        },
        "not_separable_from": [one.label for one in cause.not_separable_from],
        "rivals": [
            {
                "id": "+".join(one.id for one in hypotheses),
                "labels": [one.label for one in hypotheses],
                "credibility": share,
                "left_over": left,
            }
            for hypotheses, share, left in cause.rivals
        ],
        "in_use": used and used.to_dict(),
    }


def _changes(found: Outcome) -> Iterator[dict[str, Any]]:
    """Every parameter that was estimated: by the fitted machine, and with what was found missing."""
    before, after = ({one.name: one for one in numbers(side)} for side in (found.baseline, found.final))
    for name, one in {**before, **after}.items():
        row: dict[str, Any] = {"name": name, "unit": one.unit, "start": one.start, "level": LEVEL}
        for when, side in (("before", before), ("after", after)):
            known = side.get(name)
            row[when] = known and {
                "value": known.value,
                "lower": known.lower,
                "upper": known.upper,
                "identifiable": known.identifiable,
            }
        yield row


def _fit(found: Outcome) -> list[dict[str, Any]]:
    """Every recording and signal, before and after."""
    short = {"nrmse_percent": "nrmse", "nmse_percent": "nmse", "rmse": "rmse"}
    names = {f"{name}_{when}": f"{to}_{when}" for name, to in short.items() for when in ("before", "after")}
    table = change(found.before, found.after).rename(names).rename({"part": found.machine.part_word})
    return table.to_dicts()


def _errors(found: Outcome) -> list[dict[str, Any]]:
    """Root mean square error of each driven signal, over the recordings held out together."""
    rows = []
    before, after = found.before.held_out, found.after.held_out
    for channel, unit in before.select("channel", "unit").unique(maintain_order=True).iter_rows():
        own = [side.filter(pl.col("channel") == channel) for side in (before, after)]
        if not len(own[0]["rmse"].drop_nulls()):
            continue
        rows.append(
            {
                "channel": channel,
                "unit": unit,
                "before": together(own[0]),
                "after": together(own[1]),
                "recordings": own[0].filter(pl.col("rmse").is_not_null())["file"].n_unique(),
            }
        )
    return rows


def _summary(found: Outcome) -> dict[str, Any]:
    """The headline's fit on recordings held out, and the gain with an interval over whole recordings."""
    headline = found.machine.headline
    rows = [
        row
        for row in _fit(found)
        if row["role"] == "validate"
        and row["channel"].startswith(headline)
        and row["nrmse_before"] is not None
        and row["nrmse_after"] is not None
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
