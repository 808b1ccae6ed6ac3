"""Dead time between the command and the valve."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="valve_delay",
    name="the valve answers after a dead time",
    equation="valve-dynamics",
    signature=(
        "Every start, change and stop of the lift comes later than the model's by the same time, in speed "
        "and pressure alike; steady lowering does not differ."
    ),
    confused_with=(
        "valve_lag",
        "sensor_lag",
        "friction_dwell",
    ),
    sentence=("The {lift} lift's valve gets its command late by {delay}."),
)
