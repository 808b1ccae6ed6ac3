"""Hypotheses without a name: a free curve where the mismatch is, over what it depends on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import Shape, shapes, telling
from forklift.diagnosis.locate import UnknownInput, unknown_inputs
from forklift.diagnosis.refit import Refit
from forklift.fitting.interface import Problem
from forklift.plant.protocol import Hypothesis, Machine, Place

SMALL = 0.2
"""Share of a curve's largest absolute value below which it counts as nothing."""
STANDS = 1e-6
"""Share of its size by which a variable moves if it is one."""


@dataclass(frozen=True)
class FreeCurves:
    """Offers free curves for what a fitted model leaves over.

    Attributes
    ----------
    machine
        Whose places and variables there are.
    known
        Unknown inputs that were estimated already, by refit.
    """

    machine: Machine
    known: Mapping[Refit, Sequence[UnknownInput]]

    def __call__(self, refit: Refit) -> list[Hypothesis]:
        """The most promising beside what the refit has; beside nothing also what is no curve."""
        places = {one.name: one for one in self.machine.places}
        problem = refit.early.problem
        inputs = self.known.get(refit) or unknown_inputs(
            problem, refit.early.x, list(places), self.machine.hat_width_s(problem.samples)
        )
        found = self._curves(refit, [one for one in inputs if one.port in places])
        first = places.get(inputs[0].port) if inputs else None
        if refit.hypotheses or first is None:
            return found
        return [*found, *self.machine.unnamed(first, problem.samples)]

    def beside(self, refit: Refit) -> list[Hypothesis]:
        """A curve over every variable at each place where the refit's hypotheses act; and other curves that
        belong there."""
        acted_on = {name for one in refit.hypotheses for name in self.machine.acted_on(one)}
        places = [one for one in self.machine.places if one.name in acted_on]
        ranges = {part: _ranges(refit, part) for part in dict.fromkeys(one.part for one in places)}
        curves = [
            self.machine.curve(place, variable, *ends, place.size)
            for place in places
            for variable, ends in ranges[place.part].items()
        ]
        others = [
            one
            for place in places
            for one in self.machine.unnamed(place, refit.early.problem.samples)
            if one.over
        ]
        return [*(one for one in curves if one), *others]

    def _curves(self, refit: Refit, inputs: Sequence[UnknownInput]) -> list[Hypothesis]:
        places = {one.name: one for one in self.machine.places}

        def over(one: UnknownInput) -> list[Shape]:
            seen = over_variables(refit, one, places[one.port].part)
            return [shape for shape in seen if _offer(self.machine, places[one.port], one, shape)]

        offered = [
            _offer(self.machine, places[one.port], one, shape)
            for one, shape in telling(self._first(refit, inputs), over)
        ]
        return [one for one in offered if one]

    def _first(self, refit: Refit, inputs: Sequence[UnknownInput]) -> list[UnknownInput]:
        """Where curves are tried: where the named hypothesis acts, and where the evidence is greatest."""
        own = [
            one
            for one in inputs
            for hypothesis in refit.hypotheses
            if one.port in self.machine.acted_on(hypothesis)
        ]
        return list(dict.fromkeys([*own[:1], *inputs]))


def variables(problem: Problem, x: Floats, part: str, at: Sequence[Floats]) -> list[dict[str, Floats]]:
    """Of every recording the machine's variables for what acts on `part`, at these times."""
    moments = problem.moments(x, part)
    return [
        {name: np.interp(times, one.recording.time_s, values) for name, values in seen.items()}
        for one, seen, times in zip(problem.samples, moments, at, strict=True)
    ]


def over_variables(refit: Refit, found: UnknownInput, part: str) -> list[Shape]:
    """An unknown input as a function of each variable, the best first."""
    early = refit.early
    return shapes(found, variables(early.problem, early.x, part, found.centres))


def _offer(machine: Machine, place: Place, one: UnknownInput, shape: Shape) -> Hypothesis | None:
    """The curve where it is not small, and a knot on either side: it resolves a narrow stretch the better."""
    strong = np.flatnonzero(np.abs(shape.curve) >= SMALL * np.abs(shape.curve).max())
    first, last = max(strong[0] - 1, 0), min(strong[-1] + 1, len(shape.at) - 1)
    size = float(np.sqrt(np.mean(np.concatenate(one.values) ** 2)))
    return machine.curve(place, shape.variable, float(shape.at[first]), float(shape.at[last]), size)


def _ranges(refit: Refit, part: str) -> dict[str, tuple[float, float]]:
    """Between which values each variable moves in the recordings."""
    found = refit.told_from
    seen = found.problem.moments(found.x, part)
    ends = {
        name: (float(min(one[name].min() for one in seen)), float(max(one[name].max() for one in seen)))
        for name in seen[0]
        if all(name in one for one in seen)
    }
    return {
        name: (lower, upper)
        for name, (lower, upper) in ends.items()
        if upper - lower > STANDS * max(abs(lower), abs(upper))
    }
