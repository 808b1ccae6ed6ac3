"""Oil that leaks from the cylinder to the tank, past its seals or past the shut valve."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="leakage",
    name="oil leaks from the cylinder, or past its valve",
    equation="cylinder-pressure",
    signature=(
        "With the valve shut the lift sinks at a constant speed that grows with the load; while lowering it "
        "is faster by as much, whatever the command. The pressure hardly differs on average."
    ),
    wear=True,
    confused_with=("position_scale", "sensor_slip"),
    sentence=(
        "The {lift} lift's cylinder loses {coefficient} of oil, times its pressure over the tank's, past its "
        "seals or past its shut valve."
    ),
    check=(
        "On the machine: hold a load and look at the valve's return line. Oil that flows there passes the "
        "valve, else it passes the seals; no recording tells these apart."
    ),
)
