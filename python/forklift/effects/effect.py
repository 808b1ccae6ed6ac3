"""What Python has to say of an effect; its parameters, equation and source stand in the core's table."""

from __future__ import annotations

from dataclasses import dataclass


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
        The equation of the model that it changes, by a diagnosis's word.
    signature
        How it shows itself: in which signal, when, and as a function of what.
    confused_with
        Ids of effects and of faults, in the catalogue or not, that leave traces alike.
    sentence
        For a report, with the effect's parameters and, for an effect on one lift, ``lift`` in braces.
    """

    id: str
    name: str
    equation: str
    signature: str
    confused_with: tuple[str, ...]
    sentence: str
