"""What the effects of a truck add where they act, moment by moment, as the core has it while it simulates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.forklift.curve_tables import IDS, ports
from forklift.plant.forklift.dither import DITHER
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.free_curve import FreeCurve
from forklift.plant.forklift.model import OWN
from forklift.plant.forklift.variables import PAST
from forklift.plant.protocol import Case
from forklift.plant.subject import Term
from forklift.recordings.channels import Lift

if TYPE_CHECKING:
    from forklift.plant.forklift.model import Forklift
    from forklift.plant.forklift.truck import Truck


def added(
    machine: Forklift,
    draws: Sequence[Mapping[str, float]],
    cases: Sequence[Case],
    conditions: Sequence[Floats],
    moments: Sequence[Mapping[str, Floats]],
    lift: Lift,
) -> list[list[Term]]:
    """Of each draw of values every effect at the ports of a lift, in the states that the first draw runs
    through; in a sum's unit, of a factor the relative change.

    What only couples the lifts, or delays a command, adds at no port, and has no term; nor has what rings
    with a lift, whose inertia and force there mean nothing one by one. An effect at several ports has one
    term with all of them. Where a curve acts at the port of another effect, only both together mean
    something.
    """
    trucks = [machine.at(values) for values in draws]
    if not trucks[0].effects:
        return [[] for _ in draws]
    first, *others = (truck.core for truck in trucks)
    dither_a = draws[0].get(DITHER, 0.0)
    runs = [
        {
            (effect, port): rows
            for effect, port, rows in first.added(case.prepared.case(dither_a), own[: len(OWN)], others)
            if port.startswith(f"{lift}.")
        }
        for case, own in zip(cases, conditions, strict=True)
    ]
    acting = list(dict.fromkeys(key for run in runs for key in run))
    ringing = {effect for effect, port in acting if port.endswith(".inertia")}
    groups: dict[tuple[str, str], list[str]] = {}
    for effect, port in acting:
        if effect not in ringing:
            bent = _is_curve(effect) or any(_is_curve(other) for other, at in acting if at == port)
            groups.setdefault((port if bent else effect, port), []).append(effect)
    none = [np.zeros(len(case.recording.time_s)) for case in cases]
    found: list[list[Term]] = []
    for draw in range(len(draws)):
        terms: dict[tuple[str, ...], dict[str, list[Floats]]] = {}
        for (_, port), effects in groups.items():
            each = [
                [run[one, port][draw] if (one, port) in run else rest for one in effects]
                for run, rest in zip(runs, none, strict=True)
            ]
            terms.setdefault(tuple(effects), {})[port] = [_together(port, rows) for rows in each]
        found.append(
            [
                Term(_name(effects), rows, _over(trucks[0], effects, lift, moments))
                for effects, rows in terms.items()
            ]
        )
    return found


def _is_curve(effect: str) -> bool:
    return effect.rpartition(".")[2] in IDS.values()


def _together(port: str, rows: Sequence[Floats]) -> Floats:
    """What several effects do at one port."""
    if ports()[port.partition(".")[2]]["join"] == "factor":
        return np.asarray(np.prod([1.0 + one for one in rows], axis=0) - 1.0)
    return np.asarray(np.sum(rows, axis=0))


def _name(effects: Sequence[str]) -> str:
    """In words, the curve last."""
    ids = [effect.rpartition(".")[2] for effect in effects]
    named = [one.name for one in EFFECTS if one.id in ids and one.id not in IDS.values()]
    if not named:
        return "the curve"
    return " and ".join(named) + (", with the curve that joined it" if len(named) < len(ids) else "")


def _over(truck: Truck, effects: Sequence[str], lift: Lift, moments: Sequence[Mapping[str, Floats]]) -> str:
    """The variable of a free curve that acts alone, if it is known at all moments."""
    curve = FreeCurve.of(truck, lift) if all(map(_is_curve, effects)) else None
    if curve is None:
        return ""
    past = [one.name for one in PAST.values() if (one.variable, one.lag_s, one.fades) == curve.over]
    name = next(iter(past), curve.variable)
    return name if all(name in one for one in moments) else ""
