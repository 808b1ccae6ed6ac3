"""What Python has to say of an effect; its parameters, equation and source stand in the core's table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Equation = Literal[
    "force-balance",
    "friction",
    "cylinder-pressure",
    "bulk-modulus",
    "valve-dynamics",
    "valve-flow",
    "compensator",
    "control-volume",
    "viscosity",
    "tank",
    "mast-coupling",
    "chassis",
    "sensor",
    "operating-point",
    "any",
]
"""Where in the model something may be wrong, as a diagnosis names it; ``"any"``: where a port is."""


@dataclass(frozen=True)
class Effect:
    """How one effect of the core's catalogue is told from its traces in recordings.

    Attributes
    ----------
    id
        As in the core's effect table.
    name
        What is the matter, in a few words.
    equation
        Where it enters the model.
    signature
        How it shows itself: in which signal, when, and as a function of what.
    confused_with
        Ids of effects and of faults, in the catalogue or not, that leave traces alike.
    sentence
        For a report, with the effect's parameters and, for an effect on one lift, ``lift`` in braces.
    needs_two_of
        Conditions of which recordings with two values at least are needed to tell it, by their channels.
    also_in
        Further equations in which the same may be written.
    check
        What a workshop can look at to tell what no recording does; empty, if nothing.
    wear
        Whether a sound machine has next to none of it.
    general
        It has no physics of its own, and is there to say what physics must explain: no hypothesis by name.
    """

    id: str
    name: str
    equation: Equation
    signature: str
    confused_with: tuple[str, ...]
    sentence: str
    check: str = ""
    wear: bool = False
    general: bool = False
    needs_two_of: tuple[str, ...] = ()
    also_in: tuple[Equation, ...] = ()
