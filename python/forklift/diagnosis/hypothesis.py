"""A problem with hypotheses added, and the same place in it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

import numpy as np

from forklift.base.arrays import Floats
from forklift.fitting.interface import Problem
from forklift.plant.protocol import Hypothesis

P = TypeVar("P", bound=Problem)


def with_hypotheses(problem: P, hypotheses: Iterable[Hypothesis]) -> P:
    """The problem with what each adds, at their null values: the model is as it was."""
    for one in hypotheses:
        problem = problem.with_addition(one.addition)
    return problem


def carry(x: Floats, before: Problem, after: Problem) -> Floats:
    """The same place in another problem: what is new is at its null value."""
    known = {unknown.name: float(at) for unknown, at in zip(before.unknowns, x, strict=False)}
    shared = [known.get(unknown.name, 0.0) for unknown in after.unknowns]
    own = []
    for k, (was, now) in enumerate(zip(before.samples, after.samples, strict=True)):
        offsets = np.zeros(len(was.width))
        offsets[was.free] = was.width[was.free] * before.nuisance(x, k)
        own.append(offsets[now.free] / now.width[now.free])
    return np.concatenate([shared, *own])
