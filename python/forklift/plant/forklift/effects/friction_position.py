"""Friction that is higher, or lower, at one place of the stroke."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="friction_position",
    name="friction is higher or lower at one place of the stroke",
    equation="friction",
    signature=(
        "The cylinder pressure differs from the model's wherever the lift comes by the same place, whatever "
        "command, load or oil: lower there if friction is higher. Stops and starts at the place differ too; "
        "elsewhere nothing does."
    ),
    wear=True,
    confused_with=(
        "friction_dwell",
        "end_cushion",
        "position_scale",
    ),
    sentence=(
        "The {lift} lift's friction is higher by the factor {rise} around the cylinder position {centre}, "
        "over a width of {width}."
    ),
)
