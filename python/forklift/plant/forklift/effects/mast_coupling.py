"""The lifts joined mechanically."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="mast_coupling",
    name="the lifts are mechanically coupled",
    equation="mast-coupling",
    signature=(
        "When one lift starts or stops, the pressure of the other, whose valve is shut, swings with it, and "
        "its position bounces; in steady lowering nothing differs. It grows with the load, which takes part "
        "in both motions."
    ),
    confused_with=("chassis_compliance", "chain_elasticity"),
    sentence=(
        "The lifts push each other when they gather speed: {factor} of the joint inertia of the free lift's "
        "cylinder, carriage and load acts between them."
    ),
)
