"""A curve of any shape over one variable of operation, at one port."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="free_shape",
    name="something without a name depends on one variable of operation",
    equation="any",
    signature=(
        "What is left over is the same wherever the variable is the same, in recordings of any load, command "
        "and temperature; `forklift.plant.forklift.free_curve` says what it is a function of, and draws it."
    ),
    confused_with=("friction_temperature", "friction_position", "friction_pressure", "valve_lag"),
    sentence=(
        "Something without a name acts on the {lift} lift as a curve over one variable of operation, with "
        "the coefficients {shape_0}, {shape_1}, {shape_2}, {shape_3}, {shape_4}, {shape_5} and {shape_6}."
    ),
    general=True,
)
