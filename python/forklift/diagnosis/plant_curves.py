"""An unknown input of a plant as a function of what is known of each moment; free shapes as hypotheses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import KNOTS, Shape, shapes, telling
from forklift.diagnosis.hypothesis import Hypothesis
from forklift.diagnosis.locate import UnknownInput, unknown_inputs
from forklift.diagnosis.plant_hypotheses import acting
from forklift.diagnosis.refit import Refit
from forklift.fitting.plant_problem import PlantProblem
from forklift.plant.parts import Effect, Param, Port, Values

HATS = 60
"""Of an unknown input, over the longest recording."""
SAMPLES = 4
"""Fewest samples from one hat to the next."""


def width_s(problem: PlantProblem) -> float:
    """Distance of an unknown input's hats [s]."""
    longest = max(float(np.ptp(one.recording.time_s)) for one in problem.samples)
    usual = max(float(np.median(np.diff(one.recording.time_s))) for one in problem.samples)
    return max(longest / HATS, SAMPLES * usual)


def respond(problem: PlantProblem, x: Floats, k: int, port: str, centres: Floats) -> Floats:
    """(times, outputs, hats): how recording k answers hats at one port."""
    return problem.respond(x, k, port, centres, width_s(problem))


def over_variables(refit: Refit, found: UnknownInput) -> list[Shape]:
    """An unknown input as a function of every state, input and quantity of the bus, the best first."""
    problem = refit.early.problem
    assert isinstance(problem, PlantProblem)
    return shapes(found, variables(problem, refit.early.x, found))


def variables(problem: PlantProblem, x: Floats, found: UnknownInput) -> list[dict[str, Floats]]:
    """Of every recording each state, input and quantity of the bus at the times of the input's hats."""
    return [
        {name: np.interp(at, one.recording.time_s, column) for name, column in seen.items()}
        for one, (_, _, seen), at in zip(problem.samples, problem.simulated(x), found.centres, strict=True)
    ]


@dataclass(frozen=True)
class FreeCurves:
    """Offers free shapes for what a fitted plant leaves over.

    Attributes
    ----------
    places
        Every port, input and output.
    known
        Unknown inputs that were estimated already, by refit.
    """

    places: Sequence[str]
    known: dict[Refit, Sequence[UnknownInput]]

    def __call__(self, refit: Refit) -> list[Hypothesis]:
        """The most promising, beside what the refit has."""
        problem = refit.early.problem
        assert isinstance(problem, PlantProblem)
        ports = {port.name: port for port in problem.machine.plant.ports}
        inputs = [one for one in self._inputs(refit) if one.port in ports]
        return [
            _curve(
                ports[one.port],
                shape.variable,
                shape.at,
                float(np.sqrt(np.mean(np.concatenate(one.values) ** 2))),
            )
            for one, shape in telling(inputs, partial(over_variables, refit))
        ]

    def located(self, refit: Refit) -> list[tuple[str, str]]:
        """Each port and its equation, the most credible first."""
        problem = refit.early.problem
        assert isinstance(problem, PlantProblem)
        kinds = {port.name: port.kind for port in problem.machine.plant.ports}
        return [(one.port, kinds[one.port]) for one in self._inputs(refit) if one.port in kinds]

    def _inputs(self, refit: Refit) -> Sequence[UnknownInput]:
        if refit not in self.known:
            problem = refit.early.problem
            assert isinstance(problem, PlantProblem)
            self.known[refit] = unknown_inputs(problem, refit.early.x, self.places, respond, width_s(problem))
        return self.known[refit]

    def beside(self, refit: Refit) -> list[Hypothesis]:
        """A curve over every state, input and quantity of the bus, at each port that the refit's effects
        act on."""
        problem = refit.told_from.problem
        assert isinstance(problem, PlantProblem)
        acted_on = {port for effect in problem.machine.effects for port in effect.ports}
        seen = [variables for _, _, variables in problem.simulated(refit.told_from.x)]
        ends = {
            name: (min(one[name].min() for one in seen), max(one[name].max() for one in seen))
            for name in seen[0]
        }
        return [
            _curve(port, name, np.linspace(lower, upper, KNOTS), port.size)
            for port in problem.machine.plant.ports
            if port.name in acted_on
            for name, (lower, upper) in ends.items()
            if upper > lower
        ]


def _curve(port: Port, variable: str, at: Floats, size: float) -> Hypothesis:
    """A curve over one variable at a port, quiet: hats at the knots."""
    names = [f"knot_{k}" for k in range(len(at))]
    most = 10.0 * max(size, 1e-12)

    def term(x: Values, u: Values, p: Values, bus: Values) -> Mapping[str, Any]:
        value = np.clip({**x, **u, **bus}[variable], at[0], at[-1])
        gap = at[1] - at[0]
        return {
            port.name: sum(
                p[name] * np.maximum(0.0, 1.0 - np.abs(value - knot) / gap)
                for name, knot in zip(names, at, strict=True)
            )
        }

    number = [Param(name, port.unit, 0.0, -most, most) for name in names]
    name = f"something acts on the {port.name} as a function of {variable}"
    law = Effect(f"{port.name}.over.{variable}", name, tuple(number), (port.name,), term)
    further = tuple(law.full(one) for one in number[1:])
    return Hypothesis(
        "unknown",
        "unknown",
        name,
        port.name,
        port.kind,
        law.amplitude,
        acting(law),
        further=further,
        over=variable,
    )
