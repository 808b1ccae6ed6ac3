"""Hypotheses without a name: a free shape where the mismatch is, over what it depends on; what rings; a valve
that answers late by its own curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import Shape, shapes
from forklift.diagnosis.hypotheses import acting, starting_values, with_truck_unknowns
from forklift.diagnosis.hypothesis import Hypothesis
from forklift.diagnosis.locate import UnknownInput, unknown_inputs
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.screening import screen
from forklift.plant.forklift import variables as operation
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.free_curve import COEFFICIENTS, FINE, FreeCurve
from forklift.plant.forklift.free_curve import variables as shape_variables
from forklift.plant.forklift.ports import equation, lift_of, ports, respond
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.unknowns import unknown
from forklift.recordings.channels import Lift

MOST_PORTS, MOST = 4, 3
"""At how many ports curves are screened, and how many of them are tried."""
NEAR = 0.7
"""A curve is tried if its evidence is this share of the greatest: less is far behind, since all of them are
linear about the same place."""
STROKE = "position"
"""The variable along which something may repeat."""
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
    known: dict[Refit, Sequence[UnknownInput]]

    def __call__(self, refit: Refit) -> list[Hypothesis]:
        """The curves whose evidence is greatest beside what the refit has: at the most credible ports, over
        every variable of operation. Beside nothing also something that rings, and where the valve's dynamics
        are in doubt its answer."""
        inputs = [one for one in self._inputs(refit) if equation(one.port) != "sensor"]
        places = [one.port for one in _places(refit, inputs)[:MOST_PORTS]]
        offered = self._curves(refit, places)
        if not refit.hypotheses and inputs:
            lift = _lift_of(inputs[0].port)
            offered += _ringing(lift)
            if equation(inputs[0].port) == VALVE:
                offered.append(_answer(refit, lift))
        at = refit.told_from
        ranked = sorted(screen(at.problem, at.x, offered, 0).ranked, key=lambda one: -one.evidence)
        worth = [one for one in ranked if one.evidence >= NEAR * ranked[0].evidence > 0.0]
        return [one.hypotheses[0] for one in worth[:MOST]]

    def located(self, refit: Refit) -> list[tuple[str, str]]:
        """The lift and the equation of each port, the most credible first."""
        inputs = [one for one in self._inputs(refit) if equation(one.port) != "sensor"]
        return [(_lift_of(one.port), equation(one.port)) for one in inputs]

    def _inputs(self, refit: Refit) -> Sequence[UnknownInput]:
        if refit not in self.known:
            early = refit.early
            self.known[refit] = unknown_inputs(early.problem, early.x, ports(self.lifts), respond)
        return self.known[refit]

    def _curves(self, refit: Refit, places: Sequence[str]) -> list[Hypothesis]:
        """A curve over every variable of operation at each of these ports; over the stroke a fine one too."""
        ranges = {lift: _ranges(refit, lift) for lift in dict.fromkeys(map(_lift_of, places))}
        return [
            _curve(port.partition(".")[2], lift, variable, *ends, count=count)
            for port, lift in zip(places, map(_lift_of, places), strict=True)
            for variable, ends in ranges[lift].items()
            for count in ((COEFFICIENTS, FINE) if variable == STROKE else (COEFFICIENTS,))
        ]

    def beside(self, refit: Refit) -> list[Hypothesis]:
        """A curve over every variable of operation, at each port of the equations that the refit changes;
        beside what changes the valve's dynamics its answer too."""
        places = [
            port
            for port in ports(self.lifts)
            if any((equation(port), lift_of(port)) == (one.equation, one.where) for one in refit.hypotheses)
        ]
        curves = self._curves(refit, places)
        answers = {one.where for one in refit.hypotheses if one.equation == VALVE}
        return [*curves, *(_answer(refit, lift) for lift in self.lifts if lift in answers)]


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


def _curve(
    port: str, lift: Lift, variable: str, lower: float, upper: float, count: int = COEFFICIENTS
) -> Hypothesis:
    """A free shape of so many coefficients at a port over one variable, quiet."""
    meaning = operation.words(variable, lift)[0]
    shape = FreeCurve(lift, port, variable, lower, upper, coefficients=(0.0,) * count)
    return _quiet(
        f"something acts on the {port.replace('_', ' ')} as a function of the {meaning}",
        lift,
        equation(f"{lift}.{port}"),
        [f"{shape.head}shape_{k}" for k in range(count)],
        shape.parameters(),
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


def _ringing(lift: Lift) -> list[Hypothesis]:
    """Something that rings, from several frequencies: where its mass is zero, no derivative tells which."""
    effect = next(effect for effect in EFFECTS if effect.id == RINGS)
    return [
        Hypothesis(
            "unknown",
            "unknown",
            effect.name,
            lift,
            effect.equation,
            f"{lift}.{RINGS}.mass",
            acting(RINGS, lift, starts),
        )
        for starts in starting_values(RINGS, None)
    ]


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
