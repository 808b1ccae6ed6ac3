"""A share of the command that arrives late."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="valve_lag",
    name="a share of the command reaches the valve late",
    equation="valve-dynamics",
    signature=(
        "After each change of the command the speed does most of its way at once and creeps the rest in one "
        "time constant, upward and downward alike."
    ),
    confused_with=(
        "valve_delay",
        "compensator_dynamics",
        "oil_temperature_at_valve",
    ),
    sentence=(
        "The {lift} lift's valve does the share {share} of each change late, with the time constant {time}."
    ),
)
