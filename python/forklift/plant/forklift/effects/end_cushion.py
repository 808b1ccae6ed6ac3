"""A cushion that brakes the last of the way down."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="end_cushion",
    name="the cylinder is cushioned at its lower end",
    equation="force-balance",
    signature=(
        "In the last centimetres before the lower stop the lift slows down, and its pressure falls, the more "
        "so the faster it comes; it meets the stop later and softer."
    ),
    confused_with=(
        "friction_position",
        "position_scale",
    ),
    sentence=(
        "The {lift} lift is braked over the last {length} before its lower stop, by the force {coefficient} "
        "times its speed squared."
    ),
)
