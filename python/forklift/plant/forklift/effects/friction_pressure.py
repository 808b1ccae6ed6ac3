"""Seals that the oil's pressure presses against the rod."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="friction_pressure",
    name="seal friction grows with the pressure",
    equation="friction",
    signature=(
        "While lowering, the cylinder pressure is lower than the model's, and after a stop it stays off, the "
        "more so the heavier the load, at any speed. With one load it is more Coulomb friction."
    ),
    confused_with=(
        "friction_dwell",
        "friction_temperature",
        "load_entered",
        "pressure_gain",
    ),
    sentence=(
        "The {lift} lift's Coulomb friction grows with the pressure in its cylinder: {coefficient} for every "
        "pascal."
    ),
)
