"""The unknown input that recordings ask of a machine: at which place, and against which of its variables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forklift.diagnosis.curves import variables
from forklift.diagnosis.dependence import dependences
from forklift.report import curves

if TYPE_CHECKING:
    from forklift.diagnosis.locate import UnknownInput
    from forklift.diagnosis.result import Diagnosis
    from forklift.plant.protocol import Hypothesis
    from forklift.plant.subject import Subject


def place_of(found: Diagnosis) -> UnknownInput | None:
    """The input to look at: where the first cause acts, if an unknown input can act there; else the most
    credible of all."""
    best = next(iter(found.inputs), None)
    if not found.explaining:
        return best
    first = found.explaining[0].hypothesis
    own = (one for one in found.inputs if is_at(found.machine, one.port, first))
    return next(own, best)


def is_at(machine: Subject, port: str, hypothesis: Hypothesis) -> bool:
    """Whether the hypothesis acts at the port, or misreads that channel."""
    return port == hypothesis.where or port in machine.acted_on(hypothesis)


def against(found: Diagnosis, best: UnknownInput) -> list[curves.Against]:
    """An unknown input against the variables that explain most of it."""
    problem, x = found.baseline.early.problem, found.baseline.early.x
    given = variables(problem, x, problem.machine.part_of(best.port), best.centres)
    seen = found.dependences if best is found.inputs[0] else dependences(best, given, problem.machine.past)
    final = curves.had_it_been(found.baseline, found.final, best.port)
    return curves.against(best, seen, given, final)
