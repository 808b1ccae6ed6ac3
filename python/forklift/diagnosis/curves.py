"""Hypotheses without a name: a free shape where the mismatch is, over what it depends on; what rings; a valve
that answers late by its own curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import Shape, shapes, telling
from forklift.diagnosis.hypotheses import acting, with_truck_unknowns
from forklift.diagnosis.hypothesis import Hypothesis
from forklift.diagnosis.locate import UnknownInput, unknown_inputs
from forklift.diagnosis.refit import Refit
from forklift.plant.forklift import variables as operation
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.free_curve import COEFFICIENTS, FreeCurve
from forklift.plant.forklift.free_curve import variables as shape_variables
from forklift.plant.forklift.ports import equation, lift_of, ports, respond
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.unknowns import unknown
from forklift.recordings.channels import Lift

SMALL = 0.2
"""Share of a curve's largest absolute value below which it counts as nothing."""
RINGS, ANSWERS = "hidden_resonance", "free_response"
VALVE = "valve-dynamics"
SUDDEN_S = 0.1
"""A change of the command within this time is a step."""
STANDS = 1e-6
"""Share of its size by which a variable moves if it is one."""


@dataclass(frozen=True)
class FreeCurves:
    """Offers the free shapes for what a fitted model leaves over.

    Attributes
    ----------
    lifts
        Those that are fitted.
    known
        Unknown inputs that were estimated already, by refit.
    """

    lifts: tuple[Lift, ...]
    known: Mapping[Refit, Sequence[UnknownInput]]

    def __call__(self, refit: Refit) -> list[Hypothesis]:
        """The most promising shapes beside what the refit has; beside nothing also something that rings, and
        where the valve's dynamics are in doubt its answer."""
        inputs = self.known.get(refit) or unknown_inputs(
            refit.early.problem, refit.early.x, ports(self.lifts), respond
        )
        found = self._shapes(refit, [one for one in inputs if equation(one.port) != "sensor"])
        if refit.hypotheses:
            return found
        first = inputs[0].port if inputs else ""
        lift = lift_of(first) if first else None
        if not lift:
            return found
        return [*found, _ringing(lift), *([_answer(refit, lift)] if equation(first) == VALVE else [])]

    def beside(self, refit: Refit) -> list[Hypothesis]:
        """A curve over every variable of operation, at each port of the equations that the refit changes;
        beside what changes the valve's dynamics its answer too."""
        places = [
            port
            for port in ports(self.lifts)
            if any((equation(port), lift_of(port)) == (one.equation, one.where) for one in refit.hypotheses)
        ]
        ranges = {lift: _ranges(refit, lift) for lift in dict.fromkeys(map(_lift_of, places))}
        curves = [
            _curve(port.partition(".")[2], lift, variable, *ends)
            for port, lift in zip(places, map(_lift_of, places), strict=True)
            for variable, ends in ranges[lift].items()
        ]
        answers = {one.where for one in refit.hypotheses if one.equation == VALVE}
        return [*curves, *(_answer(refit, lift) for lift in self.lifts if lift in answers)]

    def _shapes(self, refit: Refit, inputs: Sequence[UnknownInput]) -> list[Hypothesis]:
        def over(one: UnknownInput) -> list[Shape]:
            seen = over_variables(refit, one, _lift_of(one.port))
            return [shape for shape in seen if shape.variable in shape_variables()]

        return [
            _curve(one.port.partition(".")[2], _lift_of(one.port), shape.variable, *_range(shape))
            for one, shape in telling(_places(refit, inputs), over)
        ]


def _lift_of(port: str) -> Lift:
    lift = lift_of(port)
    assert lift
    return lift


def over_variables(refit: Refit, found: UnknownInput, lift: Lift) -> list[Shape]:
    """An unknown input as a function of each variable of operation, the best first."""
    early = refit.early
    return shapes(found, operation.of_recordings(early.problem, early.x, lift, found.centres))


def _ranges(refit: Refit, lift: Lift) -> dict[str, tuple[float, float]]:
    """Between which values each variable of operation that a shape may have moves in the recordings."""
    found = refit.told_from
    times = [sample.recording.time_s for sample in found.problem.samples]
    seen = operation.of_recordings(found.problem, found.x, lift, times)
    ends = {
        name: (min(one[name].min() for one in seen), max(one[name].max() for one in seen))
        for name in shape_variables()
        if all(name in one for one in seen)
    }
    return {
        name: (float(lower), float(upper))
        for name, (lower, upper) in ends.items()
        if upper - lower > STANDS * max(abs(lower), abs(upper))
    }


def _places(refit: Refit, inputs: Sequence[UnknownInput]) -> list[UnknownInput]:
    """Where shapes are tried: at the named hypothesis's own equation, and where the evidence is greatest."""
    own = [
        one
        for one in inputs
        for hypothesis in refit.hypotheses
        if equation(one.port) == hypothesis.equation and lift_of(one.port) == hypothesis.where
    ]
    return list(dict.fromkeys([*own[:1], *inputs]))


def _curve(port: str, lift: Lift, variable: str, lower: float, upper: float) -> Hypothesis:
    """A free shape at a port over one variable, quiet."""
    meaning = operation.words(variable, lift)[0]
    return _quiet(
        f"something acts on the {port.replace('_', ' ')} as a function of the {meaning}",
        lift,
        equation(f"{lift}.{port}"),
        [f"{lift}.free_shape.shape_{k}" for k in range(COEFFICIENTS)],
        FreeCurve(lift, port, variable, lower, upper).parameters(),
        f"the {meaning}",
    )


def _quiet(
    name: str, lift: Lift, place: str, names: Sequence[str], values: Mapping[str, float], over: str
) -> Hypothesis:
    """A curve without a name, of these coefficients, where the truck has these values."""
    return Hypothesis(
        "unknown",
        "unknown",
        name,
        lift,
        place,
        names[0],
        lambda problem: with_truck_unknowns(
            problem, values, lambda truck: [unknown(truck, one) for one in names]
        ),
        further=tuple(names[1:]),
        over=over,
    )


def _range(shape: Shape) -> tuple[float, float]:
    """Where the curve is not small, and a knot on either side: splines resolve a narrow place the better."""
    strong = np.flatnonzero(np.abs(shape.curve) >= SMALL * np.abs(shape.curve).max())
    first, last = max(strong[0] - 1, 0), min(strong[-1] + 1, len(shape.at) - 1)
    return float(shape.at[first]), float(shape.at[last])


def _ringing(lift: Lift) -> Hypothesis:
    effect = next(effect for effect in EFFECTS if effect.id == RINGS)
    return Hypothesis(
        "unknown", "unknown", effect.name, lift, effect.equation, f"{lift}.{RINGS}.mass", acting(RINGS, lift)
    )


def _answer(refit: Refit, lift: Lift) -> Hypothesis:
    """The valve's time constant as a curve over what it has still to go, up to the widest step there is."""
    effect = next(effect for effect in EFFECTS if effect.id == ANSWERS)
    names = [f"{lift}.{ANSWERS}.time_{k}" for k in range(COEFFICIENTS)]
    widest = max(
        _step(sample.recording.time_s, sample.recording[f"current_{lift}_a"])
        for sample in refit.early.problem.samples
    )
    known = parameters()[f"{lift}.{ANSWERS}.range"]
    bounded = float(np.clip(widest, known["lower"], known["upper"]))
    return _quiet(
        effect.name,
        lift,
        effect.equation,
        names,
        dict.fromkeys(names, 0.0) | {f"{lift}.{ANSWERS}.range": bounded},
        "how far the valve has still to go",
    )


def _step(time: Floats, command: Floats) -> float:
    """The widest change of a command within `SUDDEN_S`."""
    return float(np.abs(np.interp(time + SUDDEN_S, time, command) - command).max())
