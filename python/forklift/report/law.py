"""The unknown input that recordings ask of a truck: at which place, and against which of its variables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from forklift.diagnosis.curves import variables
from forklift.diagnosis.dependence import shapes
from forklift.plant.forklift import ports as unknown_ports
from forklift.report import curves

if TYPE_CHECKING:
    from forklift.diagnosis.diagnose import Diagnosis
    from forklift.diagnosis.locate import UnknownInput
    from forklift.plant.protocol import Hypothesis


def place_of(found: Diagnosis) -> UnknownInput | None:
    """The input to look at: at the first cause's own equation and lift, if an unknown input can act there;
    else the most credible of all."""
    if not found.causes:
        return next(iter(found.inputs), None)
    first = found.causes[0].hypothesis
    own = (one for one in found.inputs if is_at(one.port, first))
    return next(own, next(iter(found.inputs), None))


def is_at(port: str, hypothesis: Hypothesis) -> bool:
    """Whether the port stands in the equation that the hypothesis changes, where it acts."""
    if hypothesis.kind == "sensor":
        return port == hypothesis.where
    equation, lift = unknown_ports.equation(port), unknown_ports.lift_of(port)
    return equation == hypothesis.equation and lift == hypothesis.where


def against(found: Diagnosis, best: UnknownInput) -> list[curves.Against]:
    """An unknown input against the variables that explain most of it."""
    problem, x = found.baseline.early.problem, found.baseline.early.x
    given = variables(problem, x, problem.machine.part_of(best.port), best.centres)
    seen = found.shapes if best is found.inputs[0] else shapes(best, given)
    final = curves.had_it_been(found.baseline, found.final, best.port)
    return curves.against(best, seen, given, final)
