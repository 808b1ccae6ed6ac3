"""Pressure that the hose between cylinder and valve takes."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="hose_resistance",
    name="the hose before the valve resists the flow",
    equation="valve-flow",
    signature=(
        "With the valve wide open and little load, where the compensator no longer regulates, the lift is "
        "slower than the model by more the faster it goes; where it regulates, nothing differs."
    ),
    confused_with=(
        "return_back_pressure",
        "viscosity_law",
        "current_gain",
    ),
    sentence=(
        "Between the {lift} lift's cylinder and its valve pressure is lost: {coefficient} times the flow "
        "squared."
    ),
    also_in=("tank",),  # pressure that is lost before a valve is lost behind it
)
