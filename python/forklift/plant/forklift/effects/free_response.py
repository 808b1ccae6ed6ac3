"""A valve whose answer takes a time of its own for every distance."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="free_response",
    name="the valve answers with a time constant that depends on how far it has to go",
    equation="valve-dynamics",
    signature=(
        "Large steps of the command arrive later than small ones, or small ones later, as a ramp or a pilot "
        "stage at its limit has it; a dead time holds all of them back alike, and a lag delays the same "
        "share of each."
    ),
    confused_with=("valve_delay", "valve_lag"),
    sentence=(
        "The {lift} lift's valve answers with a time constant that depends on how far it has to go, with the "
        "coefficients {time_0}, {time_1}, {time_2}, {time_3}, {time_4}, {time_5} and {time_6} over {range}."
    ),
    general=True,
)
