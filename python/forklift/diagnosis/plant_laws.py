"""What each effect of a fitted plant adds, moment by moment, and of which variable that is a function."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import shapes
from forklift.diagnosis.locate import UnknownInput
from forklift.diagnosis.refit import Refit
from forklift.fitting.interface import Problem
from forklift.plant.machine import NumpyMachine
from forklift.plant.parts import Effect


@dataclass(frozen=True, eq=False)
class Law:
    """One effect at one port."""

    effect: Effect
    port: str
    variable: str
    """What tells it best; empty if it is the same at all moments."""
    explained: float
    """Share of its square that a curve over the variable explains in recordings it was not drawn from."""
    values: Floats
    """(moments,) of the variable; of a constant the time [s]."""
    added: Floats
    """(moments,) what the effect adds, in the port's unit."""


def laws(refit: Refit) -> list[Law]:
    """Every effect of a refit at every port that it acts on, over the recordings that were fitted."""
    problem = refit.found.problem
    machine = cast(NumpyMachine, problem.machine)
    effects = machine.present(problem.values(refit.found.x)).effects
    moments = [*_moments(problem, refit.found.x)]
    found = []
    for effect, at in zip(effects, zip(*(said for _, said in moments), strict=True), strict=True):
        for port in effect.ports:
            found.append(
                _law(problem, effect, port, [seen for seen, _ in moments], [one[port] for one in at])
            )
    return found


def _moments(problem: Problem, x: Floats) -> Iterator[tuple[Mapping[str, Floats], list[dict[str, Floats]]]]:
    """Of every recording its variables, and what each effect adds by port."""
    machine = cast(NumpyMachine, problem.machine)
    values = problem.values(x)
    present = machine.present(values)
    for k, (sample, seen) in enumerate(zip(problem.samples, problem.moments(x, ""), strict=True)):
        conditions: list[float] = problem.conditions(x, k).tolist()
        p = {**machine.parameters(values), **dict(zip(sample.names, conditions, strict=True))}
        said = []
        for effect, own in zip(present.effects, present.own(p), strict=True):
            terms = effect.term(seen, seen, own, seen)
            length = len(sample.recording)
            said.append(
                {
                    port: np.broadcast_to(np.asarray(terms.get(port, 0.0), float), length)
                    for port in effect.ports
                }
            )
        yield seen, said


def _law(
    problem: Problem, effect: Effect, port: str, seen: list[Mapping[str, Floats]], added: list[Floats]
) -> Law:
    time = tuple(one.recording.time_s for one in problem.samples)
    every = np.concatenate(added)
    if np.ptp(every) > 1e-9 * np.abs(every).max():
        alone = UnknownInput(port, 0.0, 0.0, 0.0, time, tuple(added), tuple(map(np.ones_like, added)))
        best = next(iter(shapes(alone, seen)), None)
        if best is not None:
            values = np.concatenate([one[best.variable] for one in seen])
            return Law(effect, port, best.variable, best.explained, values, every)
    return Law(effect, port, "", 0.0, np.concatenate(time), every)
