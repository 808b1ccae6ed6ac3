"""Oil that is warmer at the valve than in the tank."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="oil_temperature_at_valve",
    name="the oil at the valve is warmer than in the tank",
    equation="viscosity",
    signature=(
        "At a constant command the speed creeps up during a lowering and after several in a row, the more so "
        "the heavier the load, and falls back at rest."
    ),
    confused_with=(
        "temperature_offset",
        "viscosity_law",
        "valve_lag",
    ),
    sentence=(
        "The {lift} lift's valve is warmer than the tank: {resistance} for every watt it throttles, with the "
        "time constant {time}."
    ),
)
