"""Suspects without a name: a free shape where the mismatch is, over what it depends on; what rings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forklift import operation
from forklift.diagnosis.inputs import UnknownInput, unknown_inputs
from forklift.diagnosis.region import Shape, shapes, telling
from forklift.diagnosis.suspect import Suspect
from forklift.diagnosis.trial import Trial
from forklift.effects import EFFECTS
from forklift.estimation.unknowns import unknown
from forklift.free_shape import COEFFICIENTS, FreeShape
from forklift.free_shape import variables as shape_variables
from forklift.names import Lift
from forklift.suspects import acting, with_truck_unknowns
from forklift.unknown_ports import equation, lift_of, ports, respond

Floats = NDArray[np.float64]

SMALL = 0.2
"""Share of a curve's largest absolute value below which it counts as nothing."""
RINGS = "hidden_resonance"


@dataclass(frozen=True)
class FreeSuspects:
    """Offers the free shapes for what a fitted model leaves over.

    Attributes
    ----------
    lifts
        Those that are fitted.
    known
        Unknown inputs that were estimated already, by trial.
    """

    lifts: tuple[Lift, ...]
    known: Mapping[Trial, Sequence[UnknownInput]]

    def __call__(self, trial: Trial) -> list[Suspect]:
        """The most promising shapes beside what the trial has; beside nothing also something that rings."""
        inputs = self.known.get(trial) or unknown_inputs(
            trial.early.problem, trial.early.x, ports(self.lifts), respond
        )
        found = self._shapes(trial, [one for one in inputs if equation(one.port) != "sensor"])
        if trial.suspects:
            return found
        lifts = [lift for lift in (lift_of(one.port) for one in inputs[:1]) if lift]
        return [*found, *(_ringing(lift) for lift in lifts)]

    def _shapes(self, trial: Trial, inputs: Sequence[UnknownInput]) -> list[Suspect]:
        def over(one: UnknownInput) -> list[Shape]:
            seen = over_variables(trial, one, _lift(one))
            return [shape for shape in seen if shape.variable in shape_variables()]

        return [
            _shaped(one.port.partition(".")[2], _lift(one), shape)
            for one, shape in telling(_places(trial, inputs), over)
        ]


def _lift(found: UnknownInput) -> Lift:
    lift = lift_of(found.port)
    assert lift
    return lift


def over_variables(trial: Trial, found: UnknownInput, lift: Lift) -> list[Shape]:
    """An unknown input as a function of each variable of operation, the best first."""
    problem = trial.early.problem
    runs = problem.linearise(trial.early.x)
    given = [
        operation.variables(sample, dict(run.model), lift, centres)
        for sample, run, centres in zip(problem.samples, runs, found.centres, strict=True)
    ]
    return shapes(found, given)


def _places(trial: Trial, inputs: Sequence[UnknownInput]) -> list[UnknownInput]:
    """Where shapes are tried: at the named suspect's own equation, and where the evidence is greatest."""
    own = [
        one
        for one in inputs
        for suspect in trial.suspects
        if equation(one.port) == suspect.equation and lift_of(one.port) == suspect.where
    ]
    return list(dict.fromkeys([*own[:1], *inputs]))


def _shaped(port: str, lift: Lift, shape: Shape) -> Suspect:
    """A free shape at a port over one variable, quiet."""
    law = FreeShape(lift, port, shape.variable, *_range(shape))
    names = [f"{lift}.free_shape.shape_{k}" for k in range(COEFFICIENTS)]
    meaning = operation.words(shape.variable, lift)[0]
    return Suspect(
        "unknown",
        "unknown",
        f"something acts on the {port.replace('_', ' ')} as a function of the {meaning}",
        lift,
        equation(f"{lift}.{port}"),
        names[0],
        lambda problem: with_truck_unknowns(
            problem, law.parameters(), lambda truck: [unknown(truck, name) for name in names]
        ),
    )


def _range(shape: Shape) -> tuple[float, float]:
    """Where the curve is not small, and a knot on either side: splines resolve a narrow place the better."""
    strong = np.flatnonzero(np.abs(shape.curve) >= SMALL * np.abs(shape.curve).max())
    first, last = max(strong[0] - 1, 0), min(strong[-1] + 1, len(shape.at) - 1)
    return float(shape.at[first]), float(shape.at[last])


def _ringing(lift: Lift) -> Suspect:
    effect = next(effect for effect in EFFECTS if effect.id == RINGS)
    return Suspect(
        "unknown", "unknown", effect.name, lift, effect.equation, f"{lift}.{RINGS}.mass", acting(RINGS, lift)
    )
