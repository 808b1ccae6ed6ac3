"""Something on one lift that rings with a frequency of its own."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="hidden_resonance",
    name="something on the lift rings with a frequency of its own",
    equation="force-balance",
    signature=(
        "After starts and stops the pressure of this lift alone swings with a second frequency beside the "
        "oil's, the same at every position, load and temperature. A truck on its tyres swings the resting "
        "lift's pressure and the fork height as well, and more under load; a chain that stretches adds no "
        "second swing but slows the oil's."
    ),
    confused_with=("chassis_compliance", "mast_coupling", "chain_elasticity"),
    sentence=(
        "Something on the {lift} lift rings: {mass} of its inertia at the cylinder, at {frequency} and with "
        "the damping ratio {damping_ratio}."
    ),
    general=True,
)
