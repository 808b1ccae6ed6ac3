"""Is one diagnosis right? The rules of the score, for one campaign."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from forklift.base.arrays import Floats

Answer = Mapping[str, Any]
Told = Mapping[str, Any]
Place = tuple[str | None, str | None]

UNNAMED = ("unknown", "free_shape", "fine_shape", "free_response", "hidden_resonance")
"""Ids of terms that have no name."""
GAP = 0.5
"""A gap between the fitted truck's and the true velocity below this share of the slope noise is no gap."""
NO_ANSWER = ("refused", "timeout")
"""What stands in place of a verdict where a diagnosis gave none."""
SLOPE_NOISE_M_S = 2.4e-3
"""Of the velocity that is judged, see `forklift.ensemble.proof.amplitude`."""


def judged(answer: Answer, told: Told) -> dict[str, Any]:
    """What is right of a diagnosis, as data.

    ``verdict``, ``location``, ``cause`` are true, false or None where nothing is to be asked: of a complete
    truck there is no place and no cause, of a stranger no name, and of a law that no recording shows no false
    alarm, as its name is right as well.
    """
    causes = [cause for cause in answer["causes"] if not cause["hidden"]]
    hidden = [cause for cause in answer["causes"] if cause["hidden"]]
    refused = told["verdict"] in NO_ANSWER
    wanted = set().union(*(one["names"] for one in answer["causes"]), ())
    named = _beyond_tolerated(told.get("causes", ()), answer["tolerated"], wanted)
    wrong = [one for one in named if not _is_unnamed(one) and one["id"] not in wanted]
    strangers = [one for one in causes if one["kind"] == "stranger"]
    unseen = [one for one in hidden if one["kind"] == "stranger"]
    spurious = [
        one for one in wrong if one["form"] == "complete" or not (strangers or _right([_place(one)], unseen))
    ]
    out: dict[str, Any] = {
        "kind": answer["kind"],
        "hidden": len(hidden),
        "asked": len(causes),
        "told": [one["id"] for one in named],
        "verdict_told": told["verdict"],
        "spurious": [one["id"] for one in spurious],
        "wrong_complete": [one["id"] for one in wrong if one["form"] == "complete"],
        "refused": refused,
    }
    if refused:
        fine = any(code in told.get("said", "") for one in causes for code in one["refused"])
        asked = fine if causes else None
        return out | {
            "verdict": fine,
            "location": asked,
            "place": asked,
            "cause": None if strangers else asked,
            "false_alarm": None if answer["causes"] else True,
            "unknown": asked if strangers else None,
            "all": fine,
        }
    verdict = _verdict(told, named, answer)
    if not causes:  # nothing, or what the recordings hide
        fine = verdict == "no-mismatch" or (bool(hidden) and not spurious)
        return out | {
            "verdict": fine,
            "location": None,
            "place": None,
            "cause": None,
            "unknown": None,
            "false_alarm": None if hidden else verdict != "no-mismatch",
            "all": fine,
        }
    verdict_right = verdict in set().union(*(one["verdicts"] for one in causes))
    location = _right(_places(told), causes)
    place = location or _right(_tied(told), causes)
    out |= {"false_alarm": None, "verdict": verdict_right, "location": location, "place": place}
    if strangers:
        unknown = verdict == "unknown-effect" or any(
            _is_unnamed(one) or one["form"] != "complete" for one in named
        )
        out |= {"cause": None, "unknown": unknown and place and not out["wrong_complete"]}
    else:
        out |= {"cause": all(_named(one, named) for one in causes), "unknown": None}
    right = [out["verdict"], out["place"], out["cause"], out["unknown"]]
    out["first"] = bool(named) and _is_one(causes, named[0])
    out["all"] = all(one is not False for one in right) and not out["spurious"]
    return out


def _beyond_tolerated(told: Sequence[Told], tolerated: Sequence[str], wanted: Collection[str]) -> list[Told]:
    """What is told but for what may stand beside anything. Where that is concealed as well, the first of it
    is the spoilt recording's, and only what is told beyond it counts."""
    found, left = [], set(tolerated)
    for one in told:
        if one["id"] not in tolerated or (one["id"] in wanted and one["id"] not in left):
            found.append(one)
        left.discard(one["id"])
    return found


def _verdict(told: Told, named: Sequence[Told], answer: Answer) -> str:
    """The verdict; a tolerated fault alone is none."""
    only = told.get("causes", ()) and not named and answer["tolerated"]
    return "no-mismatch" if only and told["verdict"] == "sensor-fault" else str(told["verdict"])


def _is_unnamed(one: Told) -> bool:
    return one["kind"] == "unknown" or one["id"] in UNNAMED


def _ids(one: Told) -> set[str]:
    """The cause and what these recordings cannot part from it, without the place."""
    return {one["id"], *(label.rpartition(".")[2] for label in one.get("not_separable_from", ()))}


def _named(cause: Answer, named: Sequence[Told]) -> bool:
    """The cause is told, or a tie that holds it, or, of another form, no name at its place."""
    for one in named:
        if _ids(one) & set(cause["names"]):
            return True
        if cause["kind"] == "shape" and _is_unnamed(one) and one["equation"] in cause["equations"]:
            return True
    return False


def _is_one(causes: Sequence[Answer], first: Told) -> bool:
    return any(_named(one, [first]) for one in causes)


def _places(told: Told) -> list[Place]:
    """Equation and lift that are told: of the location, and of every cause."""
    location = told.get("location") or {}
    return [(location.get("equation"), location.get("lift")), *map(_place, told.get("causes", ()))]


def _place(one: Told) -> Place:
    return one["equation"], one["where"]


def _tied(told: Told) -> list[Place]:
    """Of the places told to stand for that of a curve without a name: a tie."""
    rows = told.get("confounded", ())
    return [_place(one) for one in rows if one["other"].rpartition(".")[2] == "unknown"]


def _right(places: Sequence[Place], causes: Sequence[Answer]) -> bool:
    """The equation is right of one cause, and the lift is its."""
    for cause in causes:
        for equation, where in places:
            lift = cause["where"] in ("both", where) or cause["where"] in str(where) or where in ("", "both")
            if equation in cause["equations"] and (lift or cause["kind"] == "condition"):
                return True
    return False


def intervals(answer: Answer, told: Told) -> list[tuple[str, float, float, float]]:
    """Of each concealed effect that is named with the catalogue's law: parameter, true value, and its
    interval."""
    found = []
    for cause in answer["causes"]:
        if cause["kind"] != "effect":
            continue
        for one in told.get("causes", ()):
            if one["id"] != cause["id"] or one["form"] != "complete":
                continue
            for ends in one["parameters"]:
                name = ends["name"].rpartition(".")[2]
                if name in cause["values"] and ends.get("lower") is not None:
                    found.append((ends["name"], float(cause["values"][name]), ends["lower"], ends["upper"]))
    return found


def removed(
    answer: Answer,
    truth: Mapping[str, Mapping[str, Floats]],
    before: Mapping[str, Mapping[str, Floats]],
    after: Mapping[str, Mapping[str, Floats]],
) -> float | None:
    """The share of the misfit to the noise-free velocity that is gone, on recordings held out.

    1 - sum (after - true)² / sum (before - true)², over the commanded lifts; None where there was no misfit
    to speak of, see `GAP`.
    """
    start, end, count = 0.0, 0.0, 0
    for plan in answer["recordings"]:
        file = plan["file"]
        if plan["role"] != "validate" or file not in before or file not in after:
            continue
        for lift in ("free", "main"):
            if plan["lift"] not in (lift, "both"):
                continue
            true = truth[file][f"velocity_{lift}_m_s"]
            n = min(len(true), len(before[file][f"velocity_{lift}_m_s"]))
            start += float(np.nansum((before[file][f"velocity_{lift}_m_s"][:n] - true[:n]) ** 2))
            end += float(np.nansum((after[file][f"velocity_{lift}_m_s"][:n] - true[:n]) ** 2))
            count += n
    if not count or start / count < (GAP * SLOPE_NOISE_M_S) ** 2:
        return None
    return 1.0 - end / start
