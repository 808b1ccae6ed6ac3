"""Oil that leaks from the cylinder past its seals to the tank."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="leakage",
    name="oil leaks from the cylinder",
    equation="cylinder-pressure",
    signature=(
        "With the valve shut the lift sinks at a constant speed that grows with the load; while lowering it "
        "is faster by as much, whatever the command. Its pressure hardly differs."
    ),
    confused_with=("position_scale", "sensor_slip"),
    sentence=(
        "The {lift} lift's cylinder loses oil past its seals: {coefficient} for every pascal over the tank's."
    ),
)
