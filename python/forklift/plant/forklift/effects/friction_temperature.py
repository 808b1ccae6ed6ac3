"""Viscous friction that falls as the oil and the grease warm up."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="friction_temperature",
    name="viscous friction changes with the oil's temperature",
    equation="friction",
    signature=(
        "While lowering, the cylinder pressure differs from the model's in proportion to the speed and to "
        "how far the oil is from 20 degC: warm oil carries more of the weight, cold oil less. The swings "
        "after a step die out later when warm. The steady speed hardly differs, since the compensator holds "
        "it."
    ),
    confused_with=("friction_pressure", "temperature_offset", "viscosity_law"),
    sentence=(
        "The {lift} lift's viscous friction changes with the oil's temperature T by the factor "
        "exp(−{rate}·(T − 20 degC)): it falls as the oil warms."
    ),
    needs_two_of=("oil_temperature_degc",),
)
