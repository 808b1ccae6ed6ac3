"""The effects of the core's catalogue as they show themselves in recordings: one file each, and the list.

The physics of an effect stands in Rust, in ``crates/hydro_core/src/effects``; see `forklift.names.parameters`
for its parameters.
"""

from __future__ import annotations

from forklift.effects import friction_temperature, leakage, mast_coupling
from forklift.effects.effect import Effect

EFFECTS: tuple[Effect, ...] = (
    mast_coupling.EFFECT,
    friction_temperature.EFFECT,
    leakage.EFFECT,
)
"""In the order of the core's effect table."""

__all__ = ["EFFECTS", "Effect"]
