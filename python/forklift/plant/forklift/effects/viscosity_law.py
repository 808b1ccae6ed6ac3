"""A viscosity that follows Vogel's law instead of an exponential."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="viscosity_law",
    name="the oil's viscosity follows another law of temperature",
    equation="viscosity",
    signature=(
        "Near the reference temperature nothing differs; in cold oil the lift is slower than the model, and "
        "in hot oil as well, more than in proportion to the distance."
    ),
    confused_with=(
        "temperature_offset",
        "oil_temperature_at_valve",
        "friction_temperature",
    ),
    sentence=(
        "The {lift} lift's oil thickens in the cold faster than an exponential: the share {share} of the way "
        "to Vogel's law with its pole at {vogel}, and its density falls by {expansion} a kelvin."
    ),
    needs_two_of=("oil_temperature_degc",),
)
