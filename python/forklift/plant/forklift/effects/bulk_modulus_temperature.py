"""A bulk modulus that falls as the oil warms up."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="bulk_modulus_temperature",
    name="the oil's stiffness changes with its temperature",
    equation="bulk-modulus",
    signature=(
        "The swings of the pressure after starts and stops are slower and wider in warm oil and faster in "
        "cold oil, at any load and position. Steady lowering does not differ."
    ),
    confused_with=(
        "entrained_air",
        "chain_elasticity",
        "temperature_offset",
    ),
    sentence=(
        "The {lift} lift's oil changes its stiffness with temperature: it falls by the rate {rate} for every "
        "kelvin above 20 degC."
    ),
    needs_two_of=("oil_temperature_degc",),
)
