"""A curve with many narrow splines, for what repeats along the stroke."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

COEFFICIENTS = 40

EFFECT = Effect(
    id="fine_shape",
    name="something without a name changes often along one variable of operation",
    equation="any",
    signature=(
        "What is left over rises and falls several times along the stroke, at the same places in every "
        "recording: rollers, joints of rails; `forklift.plant.forklift.free_curve` draws it."
    ),
    confused_with=("friction_position", "free_shape"),
    sentence=(
        "Something without a name acts on the {lift} lift as a fine curve over one variable of operation, "
        "with the coefficients " + ", ".join(f"{{shape_{k}}}" for k in range(COEFFICIENTS)) + "."
    ),
    general=True,
)
