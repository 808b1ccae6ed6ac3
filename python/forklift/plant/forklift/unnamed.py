"""Hypotheses without a name: a free curve at a port, something that rings, a valve of its own curve."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.forklift import variables as operation
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.free_curve import COEFFICIENTS, FINE, FreeCurve
from forklift.plant.forklift.free_curve import variables as curve_variables
from forklift.plant.forklift.hypotheses import acting, added, starting_values
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck import Truck
from forklift.plant.protocol import Case, Hypothesis
from forklift.recordings.channels import Lift

RINGS, ANSWERS, LAG = "hidden_resonance", "free_response", "valve_lag"
STROKE = "position"
"""The variable along which something may repeat."""
FRICTION = ("friction", "viscous_friction", "dry_friction")
FLOW = ("opening", "viscosity", "preset_pressure", "return_pressure")
NATURAL = {
    "velocity": (*FLOW, *FRICTION, "force"),
    "speed": (*FLOW, *FRICTION, "force"),
    "position": ("cylinder_flow", *FRICTION, "force"),
    "command": ("current",),
    "other_command": ("current",),
    "time_since_command": ("current", "opening", "friction", "dry_friction"),
    "oil_temperature": ("viscosity", *FRICTION, "bulk_modulus"),
}
"""By variable: the ports at which something that depends on it may plausibly act; elsewhere it is unlikely.
What enters between the valve's current and its flow looks much the same, and a command acts by way of the
current. How fast the cylinder moves is how much flows and shears, and no current or stiffness of oil; where
it stands, what its rails and seals are like there. Variables that are not listed may act anywhere."""
SUDDEN_S = 0.1
"""A change of the command within this time is a step."""


def curves(
    truck: Truck, lift: Lift, port: str, equation: str, variable: str, lower: float, upper: float
) -> tuple[Hypothesis, ...]:
    """Free curves at a port over one variable of operation, of the moment or of the past: over the stroke a
    fine one too, as rollers and joints of rails repeat along it. None if the variable takes none."""
    past = operation.PAST.get(variable)
    of = past.variable if past else variable
    if of not in curve_variables():
        return ()
    lag, fades = (past.lag_s, past.fades) if past else (0.0, False)
    counts = (COEFFICIENTS, FINE) if variable == STROKE else (COEFFICIENTS,)
    meaning = operation.words(variable, lift)[0]
    shapes = [FreeCurve(lift, port, of, lower, upper, lag, (0.0,) * count, fades) for count in counts]
    return tuple(_curve(truck, shape, equation, meaning) for shape in shapes)


def _curve(truck: Truck, shape: FreeCurve, equation: str, over: str) -> Hypothesis:
    return _unnamed(
        truck,
        f"something acts on the {shape.port.replace('_', ' ')} as a function of the {over}",
        shape.lift,
        equation,
        [f"{shape.head}shape_{k}" for k in range(len(shape.coefficients))],
        shape.parameters(),
        f"the {over}",
        unlikely=shape.port not in NATURAL.get(shape.variable, (shape.port,)),
    )


def ringing(truck: Truck, lift: Lift) -> tuple[Hypothesis, ...]:
    """A mass on a spring that rides on the lift, from several frequencies: where the mass is zero, no
    derivative tells which."""
    effect = next(effect for effect in EFFECTS if effect.id == RINGS)
    return tuple(
        Hypothesis(
            "unknown",
            "unknown",
            effect.name,
            lift,
            effect.equation,
            f"{lift}.{RINGS}.mass",
            acting(truck, RINGS, lift, starts),
        )
        for starts in starting_values(RINGS, None)
    )


def answer(truck: Truck, lift: Lift, cases: Sequence[Case]) -> Hypothesis:
    """The valve's time constant as a curve over what it has still to go, up to the widest step there is."""
    effect = next(effect for effect in EFFECTS if effect.id == ANSWERS)
    names = [f"{lift}.{ANSWERS}.time_{k}" for k in range(COEFFICIENTS)]
    widest = max(_step(one.recording.time_s, one.recording[f"current_{lift}_a"]) for one in cases)
    known = parameters()[f"{lift}.{ANSWERS}.range"]
    bounded = float(np.clip(widest, known["lower"], known["upper"]))
    return _unnamed(
        truck,
        effect.name,
        lift,
        effect.equation,
        names,
        dict.fromkeys(names, 0.0) | {f"{lift}.{ANSWERS}.range": bounded},
        "how far the valve has still to go",
        law_of=LAG,
    )


def _unnamed(
    truck: Truck,
    name: str,
    lift: Lift,
    equation: str,
    names: Sequence[str],
    values: Mapping[str, float],
    over: str,
    *,
    unlikely: bool = False,
    law_of: str = "",
) -> Hypothesis:
    """A curve of these coefficients, where the truck has these values."""
    return Hypothesis(
        "unknown",
        "unknown",
        name,
        lift,
        equation,
        names[0],
        added(truck, values, names),
        unlikely=unlikely,
        further=tuple(names[1:]),
        over=over,
        law_of=law_of,
    )


def _step(time: Floats, command: Floats) -> float:
    """The widest change of a command within `SUDDEN_S`."""
    return float(np.abs(np.interp(time + SUDDEN_S, time, command) - command).max())
