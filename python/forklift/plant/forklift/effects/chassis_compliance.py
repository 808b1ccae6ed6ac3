"""The truck on its tyres."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="chassis_compliance",
    name="the truck moves on its tyres",
    equation="chassis",
    signature=(
        "After starts and stops both pressures swing together at one low frequency that depends neither on "
        "position nor on the oil, the resting lift's as well, and the fork height swings more than the "
        "encoders."
    ),
    confused_with=(
        "mast_coupling",
        "chain_elasticity",
    ),
    sentence=(
        "The truck yields on its tyres as the lifts gather speed: {compliance} for every newton, at "
        "{frequency} without its load and with the damping ratio {damping_ratio}."
    ),
)
