"""The score of many campaigns: rates with exact intervals, confusion, calibration, detection and time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import beta

from forklift.ensemble.proof.baselines import METHODS
from forklift.ensemble.proof.judge import NO_ANSWER, UNNAMED

Result = Mapping[str, Any]

BINS = (0.0, 0.5, 0.7, 0.9, 1.0)
"""Credibilities between which told causes are counted together."""
SIZE_BINS = (0.0, 1.0, 2.0, 4.0, 8.0, np.inf)
"""Sizes of what is concealed, in units of the sensors' noise."""
LEVEL = 0.95
GOALS: Mapping[str, tuple[float, float]] = {
    "kind of fault": (95.0, 100.0),
    "location, or a tie that holds it": (95.0, 100.0),
    "cause, or a tie that holds it": (90.0, 100.0),
    "unknown called unknown": (85.0, 100.0),
    "a wrong name called complete": (0.0, 1.0),
    "false alarms": (0.0, 1.0),
    "intervals hold the truth": (90.0, 98.0),
}
"""Between what the rates that matter are to lie [%]."""


def share(right: int, count: int) -> dict[str, Any]:
    """A rate with its exact interval of 95 % (Clopper and Pearson 1934)."""
    if not count:
        return {"right": 0, "of": 0, "share": None, "lower": None, "upper": None}
    tail = (1.0 - LEVEL) / 2.0
    lower = float(beta.ppf(tail, right, count - right + 1)) if right else 0.0
    upper = float(beta.ppf(1.0 - tail, right + 1, count - right)) if right < count else 1.0
    return {"right": right, "of": count, "share": right / count, "lower": lower, "upper": upper}


def _rate(values: Iterable[bool | None]) -> dict[str, Any]:
    """Of those that are asked."""
    asked = [bool(one) for one in values if one is not None]
    return share(sum(asked), len(asked))


def score(results: Sequence[Result]) -> dict[str, Any]:
    """Everything the proof tells, as data."""
    return {
        "rates": rates(results),
        "by_kind": {
            kind: rates([one for one in results if one["judged"]["kind"] == kind]) for kind in _kinds(results)
        },
        "by_cause": by_cause(results),
        "confusion": confusion(results),
        "reliability": reliability(results),
        "forms": forms(results),
        "detection": detection(results),
        "removed": removed(results),
        "seconds": seconds(results),
        "baselines": {name: _baseline(results, name) for name in METHODS},
    }


def _kinds(results: Sequence[Result]) -> list[str]:
    return sorted({one["judged"]["kind"] for one in results})


def rates(results: Sequence[Result]) -> dict[str, Any]:
    """Each line of the table: how many of how many, and between what."""
    judged = [one["judged"] for one in results]
    asked = [one for one in judged if one["asked"]]
    inside = [lower <= value <= upper for one in results for _, value, lower, upper in one["intervals"]]
    return {
        "all right": _rate(one["all"] for one in judged),
        "kind of fault": _rate(one["verdict"] for one in judged),
        "location": _rate(one["location"] for one in judged),
        "location, or a tie that holds it": _rate(one["place"] for one in judged),
        "cause, or a tie that holds it": _rate(one["cause"] for one in judged),
        "cause told first": _rate(one.get("first", False) for one in asked if one["cause"] is not None),
        "a wrong name": _rate(bool(one["spurious"]) for one in judged),
        "a wrong name called complete": _rate(bool(one["wrong_complete"]) for one in judged),
        "false alarms": _rate(one["false_alarm"] for one in judged),
        "false alarms that tell but a load within 1 %": _rate(
            set(one["told"]) == {"load_entered"} for one in judged if one["false_alarm"]
        ),
        "unknown called unknown": _rate(one["unknown"] for one in judged),
        "intervals hold the truth": share(sum(inside), len(inside)),
        "no answer": _rate(one["verdict_told"] == "timeout" for one in judged),
        "hidden, by the rule": _rate(bool(one["hidden"]) for one in judged if one["asked"] or one["hidden"]),
    }


def by_cause(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Of each concealed thing: how often, and how often all was right."""
    found: dict[str, list[bool]] = {}
    for one in results:
        for cause in one["answer"]["causes"]:
            if not cause["hidden"]:
                found.setdefault(cause["id"], []).append(bool(one["judged"]["all"]))
    return [
        {"id": name, "kind": _kind_of(results, name), **share(sum(right), len(right))}
        for name, right in sorted(found.items())
    ]


def _kind_of(results: Sequence[Result], name: str) -> str:
    return next(
        str(cause["kind"]) for one in results for cause in one["answer"]["causes"] if cause["id"] == name
    )


def confusion(results: Sequence[Result]) -> list[dict[str, Any]]:
    """What was concealed, and what was told: itself if it is among the causes, else the first. Counts."""
    pairs: Counter[tuple[str, str]] = Counter()
    for one in results:
        shown = [cause["id"] for cause in one["answer"]["causes"] if not cause["hidden"]]
        told = one["judged"]["told"]
        said = told[0] if told else one["judged"]["verdict_told"]
        for name in shown or ["nothing"]:
            own = name if name in told or name.partition("__")[0] in told else said
            pairs[name, own] += 1
    return [{"concealed": a, "told": b, "count": n} for (a, b), n in sorted(pairs.items())]


def reliability(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Of the named causes told with a credibility in each bin: how many were right; and of the others, how
    many named a stranger's place, with their form uncertain (`by_another_law`)."""
    told = _named(results)
    rows = []
    for low, high in pairwise(BINS):
        inside = [one for one in told if low <= one.credibility < high or (one.credibility == high == 1.0)]
        rows.append({"from": low, "to": high, **_rightly(inside)})
    return rows


def forms(results: Sequence[Result]) -> list[dict[str, Any]]:
    """The same of the named causes of each form: `forklift.diagnosis.criteria.NAMED_RIGHTLY` is that of
    uncertain ones."""
    told = _named(results)
    return [
        {"form": form, **_rightly([one for one in told if one.form == form])}
        for form in ("complete", "uncertain")
    ]


class _Named(NamedTuple):
    """A cause that was told by name."""

    credibility: float
    form: str
    right: bool
    by_another_law: bool


def _named(results: Sequence[Result]) -> list[_Named]:
    """Those with a credibility, without what may be told beside all else."""
    told: list[_Named] = []
    for one in results:
        wanted = {name for cause in one["answer"]["causes"] for name in cause["names"]}
        for cause in one["told"]["causes"]:
            beside = cause["id"] in UNNAMED or cause["id"] in one["answer"]["tolerated"]
            if cause["kind"] == "unknown" or beside or cause["credibility"] is None:
                continue
            right = cause["id"] in wanted
            related = cause["form"] != "complete" and bool(one["judged"]["unknown"]) and not right
            told.append(_Named(float(cause["credibility"]), cause["form"], right, related))
    return told


def _rightly(told: Sequence[_Named]) -> dict[str, Any]:
    right = sum(one.right for one in told)
    return {**share(right, len(told)), "by_another_law": sum(one.by_another_law for one in told)}


def detection(results: Sequence[Result]) -> list[dict[str, Any]]:
    """Over the size of a single concealed law: how often anything was said, and how often all was right."""
    rows = []
    for low, high in pairwise(SIZE_BINS):
        inside = [
            one
            for one in results
            if len(one["answer"]["causes"]) == 1
            and (size := one["answer"]["causes"][0]["size"]) is not None
            and low <= size < high
        ]
        silent = ("no-mismatch", *NO_ANSWER)
        seen = [one["judged"]["verdict_told"] not in silent for one in inside]
        right = [bool(one["judged"]["all"]) for one in inside]
        rows.append(
            {
                "from": low,
                "to": high if np.isfinite(high) else None,
                "hidden": sum(bool(one["judged"]["hidden"]) for one in inside),
                "detected": share(sum(seen), len(seen)),
                "right": share(sum(right), len(right)),
            }
        )
    return rows


def removed(results: Sequence[Result]) -> dict[str, Any]:
    """The share of the misfit to the noise-free velocity that is gone on held-out recordings, by kind."""
    out = {}
    for kind in _kinds(results):
        values = [
            one["removed"]
            for one in results
            if one["judged"]["kind"] == kind and one["removed"] is not None and one["judged"]["asked"]
        ]
        if values:
            out[kind] = {
                "campaigns": len(values),
                "median": float(np.median(values)),
                "quartiles": [float(np.quantile(values, q)) for q in (0.25, 0.75)],
            }
    return out


def seconds(results: Sequence[Result]) -> dict[str, Any]:
    """Wall time [s] of a diagnosis, of one lift and of both, and of making a campaign."""
    times: dict[str, list[float]] = {
        "one lift": [one["seconds"] for one in results if one["answer"]["lift"] != "both"],
        "both lifts": [one["seconds"] for one in results if one["answer"]["lift"] == "both"],
        "making a campaign": [one["made_s"] for one in results if "made_s" in one],
    }
    return {
        name: {
            "campaigns": len(values),
            "median": float(np.median(values)),
            "95 %": float(np.quantile(values, 0.95)),
            "longest": float(np.max(values)),
        }
        for name, values in times.items()
        if values
    }


def _baseline(results: Sequence[Result], name: str) -> dict[str, Any]:
    given = [(one["baselines"][name], one["judged"]) for one in results if one.get("baselines")]
    complete = [said for said, judged in given if judged["kind"] == "complete"]
    return {
        "kind of fault": _rate(said["verdict_right"] for said, _ in given),
        "location": _rate(said["location_right"] for said, _ in given),
        "cause told first": _rate(said["cause_right"] for said, _ in given),
        "false alarms": _rate(said["mismatch"] for said in complete),
    }
