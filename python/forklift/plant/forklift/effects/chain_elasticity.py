"""Chains that stretch under their load."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="chain_elasticity",
    name="the chains stretch",
    equation="cylinder-pressure",
    signature=(
        "The swings after starts and stops are slower and wider, by the same compliance at every load, "
        "temperature and pressure; most where the oil's column is short."
    ),
    confused_with=(
        "entrained_air",
        "bulk_modulus_temperature",
        "chassis_compliance",
    ),
    sentence=("The {lift} lift's chains stretch: {compliance} for every newton in them."),
)
