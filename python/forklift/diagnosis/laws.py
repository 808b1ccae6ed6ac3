"""What each effect of a fitted machine adds, moment by moment, and of which variable that is a function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import dependences
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.refit import Refit
from forklift.plant.subject import Subject, Term


@dataclass(frozen=True, eq=False)
class Law:
    """One effect at one port."""

    name: str
    port: str
    variable: str
    """What tells it best; empty if it is the same at all moments."""
    explained: float
    """Share of its square that a curve over the variable explains in recordings it was not drawn from."""
    values: Floats
    """(moments,) of the variable; of a constant the time [s]."""
    added: Floats
    """(moments,) what the effect adds, in the port's unit."""


def laws(machine: Subject, refit: Refit) -> list[Law]:
    """Every effect of a refit at every port that it acts on, over the recordings that were fitted.

    None of a machine that does not say what its effects add.
    """
    problem, x = refit.found.problem, refit.found.x
    conditions = [problem.conditions(x, k) for k in range(len(problem.samples))]
    time = tuple(one.recording.time_s for one in problem.samples)
    found = []
    for part in dict.fromkeys(machine.part_of(one.name) for one in machine.places):
        seen = problem.moments(x, part)
        terms = machine.terms(problem.values(x), problem.samples, conditions, seen, part)
        found += [_law(term, port, seen, time) for term in terms for port in term.added]
    return found


def _law(term: Term, port: str, seen: Sequence[Mapping[str, Floats]], time: tuple[Floats, ...]) -> Law:
    """One term at a port, against its own variable, or the one that tells it best."""
    added = term.added[port]
    every = np.concatenate(added)
    variable, explained = term.over, 1.0
    if not variable and np.ptp(every) > 1e-9 * np.abs(every).max():
        alone = UnknownInput(port, 0.0, 0.0, 0.0, time, tuple(added), tuple(map(np.ones_like, added)))
        best = next(iter(dependences(alone, seen)), None)
        variable, explained = (best.variable, best.explained) if best else ("", 0.0)
    if not variable:
        return Law(term.name, port, "", 0.0, np.concatenate(time), every)
    return Law(term.name, port, variable, explained, np.concatenate([one[variable] for one in seen]), every)
