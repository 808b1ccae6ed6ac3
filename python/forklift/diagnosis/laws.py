"""What each effect of a fitted machine adds, moment by moment, and of which variable that is a function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import dependences
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.refit import Refit
from forklift.plant.subject import Subject


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
    seen = problem.moments(x, "")
    time = tuple(one.recording.time_s for one in problem.samples)
    found = []
    for term in machine.terms(problem.values(x), problem.samples, conditions, seen):
        for port, added in term.added.items():
            every = np.concatenate(added)
            best = None
            if np.ptp(every) > 1e-9 * np.abs(every).max():
                alone = UnknownInput(port, 0.0, 0.0, 0.0, time, tuple(added), tuple(map(np.ones_like, added)))
                best = next(iter(dependences(alone, seen)), None)
            if best is None:
                found.append(Law(term.name, port, "", 0.0, np.concatenate(time), every))
            else:
                values = np.concatenate([one[best.variable] for one in seen])
                found.append(Law(term.name, port, best.variable, best.explained, values, every))
    return found
