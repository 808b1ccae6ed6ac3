"""A coil that does not get the current that is asked for."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="valve_current_limit",
    name="the valve's current is limited",
    equation="valve-dynamics",
    signature=(
        "Above one current the speed grows no further, and at a constant high command it falls slowly while "
        "the coil warms up; at low commands nothing differs."
    ),
    wear=True,
    confused_with=(
        "current_gain",
        "hose_resistance",
        "oil_temperature_at_valve",
    ),
    sentence=(
        "The {lift} lift's valve loses the share {share} of what is asked for above {limit}, a limit that a "
        "warm coil lowers by {warming} within {time}."
    ),
)
