"""Friction that grows the longer the lift has rested."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="friction_dwell",
    name="friction grows with the time at rest",
    equation="friction",
    signature=(
        "A start after a long rest takes a deeper dip of the pressure, and is later, than one after a short "
        "rest; once the lift moves, nothing differs."
    ),
    confused_with=(
        "friction_position",
        "friction_pressure",
        "valve_delay",
    ),
    sentence=(
        "The {lift} lift's friction grows at rest by {growth} for each e-fold of seconds, and is renewed "
        "over a way of {way}."
    ),
)
