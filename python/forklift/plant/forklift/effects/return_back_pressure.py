"""The return line that both lifts share."""

from __future__ import annotations

from forklift.plant.forklift.effects.effect import Effect

EFFECT = Effect(
    id="return_back_pressure",
    name="the return line builds up pressure",
    equation="tank",
    signature=(
        "With both lifts lowering fast and lightly loaded, each is slower than alone; alone, and where the "
        "compensators regulate, hardly anything differs."
    ),
    confused_with=(
        "hose_resistance",
        "viscosity_law",
    ),
    sentence=(
        "The return line holds back what both lifts let through: {coefficient} times their flow squared."
    ),
)
