"""A compensator that senses the drop late."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="compensator_dynamics",
    name="the compensator senses part of the drop late",
    equation="compensator",
    signature=(
        "After each change of the command or of the pressure the speed overshoots and settles within one "
        "time constant, upward and downward; steady lowering does not differ."
    ),
    confused_with=(
        "valve_lag",
        "hose_inertance",
        "valve_flow_force",
    ),
    sentence=(
        "The {lift} lift's compensator senses the share {share} of the drop late, with the time constant "
        "{time}."
    ),
)
