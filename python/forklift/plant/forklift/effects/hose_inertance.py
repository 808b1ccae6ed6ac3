"""The mass of the oil in the hose between cylinder and valve."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="hose_inertance",
    name="the oil in the hose has inertia",
    equation="valve-flow",
    signature=(
        "Swings of speed and pressure after sharp starts and stops differ in frequency and damping with the "
        "valve wide open; steady lowering does not."
    ),
    confused_with=(
        "valve_lag",
        "compensator_dynamics",
    ),
    sentence=(
        "The oil between the {lift} lift's cylinder and its valve is slow to follow: its inertance is "
        "{inertance}."
    ),
    also_in=("tank",),  # pressure that is lost before a valve is lost behind it
)
