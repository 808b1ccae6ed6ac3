"""What each effect of a fitted machine adds, moment by moment, and of which variable that is a function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import dependences
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.refit import Refit
from forklift.fitting.criteria import CLOCK
from forklift.fitting.intervals import QUANTILE
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
    """(moments,) what the effect adds, in the port's unit; with a curve in it, less its mean: another
    parameter makes up for that, and only the shape is told."""
    band: Floats
    """(moments,) half of its 95 % interval."""

    @property
    def slope(self) -> float | None:
        """How much it rises per one of its variable [port's unit over the variable's], if it lies on a
        straight line."""
        if not self.variable or np.ptp(self.values) == 0.0:
            return None
        line = np.polynomial.Polynomial.fit(self.values, self.added, 1)
        left = np.square(self.added - line(self.values)).sum()
        straight = left <= (1.0 - STRAIGHT) * np.square(self.added - self.added.mean()).sum()
        return float(line.convert().coef[1]) if straight else None


STRAIGHT = 0.9999
"""Share of a law's square that a straight line explains where its slope is told: all but what a simulation is
off by. An exponential is no straight line."""


def laws(machine: Subject, refit: Refit) -> list[Law]:
    """Every effect of a refit at every port that it acts on, over the recordings that were fitted.

    None of a machine that does not say what its effects add.
    """
    problem, x = refit.found.problem, refit.found.x
    conditions = [problem.conditions(x, k) for k in range(len(problem.samples))]
    time = tuple(one.recording.time_s for one in problem.samples)
    draws = [problem.values(one) for one in _apart(refit)]
    found = []
    for part in dict.fromkeys(machine.part_of(one.name) for one in machine.places):
        seen = problem.moments(x, part)
        terms = machine.terms(draws, problem.samples, conditions, seen, part)
        found += [law(one, port, seen, time) for one in zip(*terms, strict=True) for port in one[0].added]
    return found


def _apart(refit: Refit) -> list[Floats]:
    """The unknown vector, and pairs either side of it: one standard deviation along each principal axis of
    what is known of the unknowns that the hypotheses brought."""
    problem, x = refit.found.problem, refit.found.x
    brought = {name for one in refit.hypotheses for free in one.addition.free for name in free.names}
    own = [k for k, unknown in enumerate(problem.unknowns) if brought & set(unknown.names)]
    if not own:
        return [x]
    squares, axes = np.linalg.eigh(refit.knowledge.covariance[np.ix_(own, own)])
    lower, upper = problem.bounds()
    found = [x]
    for square, axis in zip(squares.clip(0.0), axes.T, strict=True):
        for sign in (1.0, -1.0):
            moved = x.copy()
            moved[own] += sign * np.sqrt(square) * axis
            found.append(np.clip(moved, lower, upper))
    return found


def law(
    draws: Sequence[Term], port: str, seen: Sequence[Mapping[str, Floats]], time: tuple[Floats, ...]
) -> Law:
    """One term at a port, against its own variable, or the one that tells it best."""
    term = draws[0]
    added = term.added[port]
    every, *moved = (np.concatenate(one.added[port]) for one in draws)
    if term.over:
        every, *moved = (one - one.mean() for one in (every, *moved))
    pairs = zip(moved[::2], moved[1::2], strict=True)
    noise = QUANTILE * np.sqrt(sum((np.square(0.5 * (up - down)) for up, down in pairs), 0.0 * every))
    band = noise if term.over else np.hypot(noise, CLOCK * np.abs(every))
    variable, explained = term.over, 1.0
    if not variable and np.ptp(every) > 1e-9 * np.abs(every).max():
        alone = UnknownInput(port, 0.0, 0.0, 0.0, time, tuple(added), tuple(map(np.ones_like, added)))
        best = next(iter(dependences(alone, seen)), None)
        variable, explained = (best.variable, best.explained) if best else ("", 0.0)
    values = np.concatenate([one[variable] for one in seen] if variable else time)
    return Law(term.name, port, variable, explained if variable else 0.0, values, every, band)
