"""Bubbles of air in the cylinder's oil."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="entrained_air",
    name="the oil holds air",
    equation="bulk-modulus",
    signature=(
        "The swings after starts and stops are slower and wider the lower the pressure: an empty lift "
        "bounces most. Under a heavy load hardly anything differs."
    ),
    wear=True,
    confused_with=(
        "chain_elasticity",
        "bulk_modulus_temperature",
    ),
    sentence=(
        "The {lift} lift's oil holds air: the share {fraction} of its volume at atmospheric pressure, with "
        "the exponent {exponent}."
    ),
)
