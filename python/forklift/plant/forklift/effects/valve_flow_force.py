"""The jet through the valve that draws its spool shut."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="valve_flow_force",
    name="the flow closes the proportional valve",
    equation="valve-dynamics",
    signature=(
        "The valve opens less than the model's, by more at large openings and at high drops: while the "
        "compensator has yet to close, and where it does not regulate."
    ),
    confused_with=(
        "current_gain",
        "hose_resistance",
        "compensator_dynamics",
    ),
    sentence=(
        "The jet draws the {lift} lift's valve shut: {coefficient} for every newton of opening times drop."
    ),
)
