"""The effects of the core's catalogue as they show themselves in recordings: one file each, and the list.

The physics of an effect stands in Rust, in ``crates/hydro_core/src/effects``; see
`forklift.plant.forklift.tables.parameters` for its parameters.
"""

from __future__ import annotations

from forklift.plant.forklift.effects import (
    bulk_modulus_temperature,
    chain_elasticity,
    chassis_compliance,
    compensator_dynamics,
    end_cushion,
    entrained_air,
    fine_shape,
    free_response,
    free_shape,
    friction_dwell,
    friction_position,
    friction_pressure,
    friction_temperature,
    hidden_resonance,
    hose_inertance,
    hose_resistance,
    leakage,
    mast_coupling,
    oil_temperature_at_valve,
    return_back_pressure,
    valve_current_limit,
    valve_delay,
    valve_flow_force,
    valve_lag,
    viscosity_law,
)
from forklift.plant.forklift.effects.effect import Effect, Equation

EFFECTS: tuple[Effect, ...] = (
    mast_coupling.EFFECT,
    friction_temperature.EFFECT,
    leakage.EFFECT,
    friction_position.EFFECT,
    friction_pressure.EFFECT,
    friction_dwell.EFFECT,
    bulk_modulus_temperature.EFFECT,
    entrained_air.EFFECT,
    chain_elasticity.EFFECT,
    end_cushion.EFFECT,
    chassis_compliance.EFFECT,
    hose_resistance.EFFECT,
    hose_inertance.EFFECT,
    return_back_pressure.EFFECT,
    viscosity_law.EFFECT,
    oil_temperature_at_valve.EFFECT,
    valve_delay.EFFECT,
    valve_lag.EFFECT,
    valve_current_limit.EFFECT,
    valve_flow_force.EFFECT,
    compensator_dynamics.EFFECT,
    free_shape.EFFECT,
    hidden_resonance.EFFECT,
    free_response.EFFECT,
    fine_shape.EFFECT,
)
"""In the order of the core's effect table."""

__all__ = ["EFFECTS", "Effect", "Equation"]
