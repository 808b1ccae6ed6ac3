"""What may be concealed, and which answers to it are right."""

from __future__ import annotations

from dataclasses import dataclass

from forklift.ensemble.proof.truth import effects, others, strangers

KINDS = ("complete", "stranger", "two", "effect", "shape", "sensor", "condition")
"""Nothing; physics that the catalogue lacks; two of its effects; one; one in another form; a sensor or clock
that fails; a load or an oil temperature that is not what was entered."""

DECK = (
    *("complete",) * 5,
    *("stranger",) * 4,
    *("two",) * 2,
    *("effect",) * 5,
    *("shape",) * 2,
    "sensor",
    "condition",
)
"""Twenty campaigns in a row are a shuffled deck: a quarter complete, a fifth strangers, a tenth two at
once."""

EQUATIONS = {
    "mast_coupling": ("mast-coupling", "force-balance"),
    "friction_temperature": ("friction",),
    "leakage": ("cylinder-pressure",),
    "friction_position": ("friction", "force-balance"),
    "friction_pressure": ("friction",),
    "friction_dwell": ("friction",),
    "bulk_modulus_temperature": ("bulk-modulus", "cylinder-pressure"),
    "entrained_air": ("bulk-modulus", "cylinder-pressure"),
    "chain_elasticity": ("cylinder-pressure", "bulk-modulus", "force-balance"),
    "end_cushion": ("force-balance", "friction"),
    "chassis_compliance": ("chassis",),
    "hose_resistance": ("valve-flow",),
    "hose_inertance": ("valve-flow",),
    "return_back_pressure": ("tank",),
    "viscosity_law": ("viscosity",),
    "oil_temperature_at_valve": ("viscosity",),
    "valve_delay": ("valve-dynamics",),
    "valve_lag": ("valve-dynamics",),
    "valve_current_limit": ("valve-dynamics",),
    "valve_flow_force": ("valve-dynamics",),
    "compensator_dynamics": ("compensator",),
    "pressure_gain": ("sensor",),
    "pressure_offset": ("sensor",),
    "position_scale": ("sensor",),
    "sensor_lag": ("sensor",),
    "sensor_stuck": ("sensor",),
    "sensor_slip": ("sensor",),
    "clock_late": ("sensor", "valve-dynamics"),
    "load_entered": ("operating-point",),
    "temperature_offset": ("operating-point", "sensor"),
    "temperature_stuck": ("operating-point", "sensor"),
}
"""Where a cause is right to be located."""

ACCEPTED = {
    "clock_late": ("sensor_lag", "valve_delay"),
    "temperature_stuck": ("temperature_offset", "temperature_entered", "sensor_stuck"),
    "temperature_offset": ("temperature_offset", "temperature_entered"),
}
"""Names that are one and the same to any recording; of all others only the own name is right."""

REFUSED = {
    "position_scale": ("height-contradicts-position",),
    "clock_late": ("command-shifted",),
    "sensor_stuck": ("channel-stuck", "recording-frozen"),
    "sensor_slip": ("channel-jump", "height-contradicts-position"),
    "pressure_gain": ("pressure-implausible",),
    "pressure_offset": ("pressure-implausible",),
    "temperature_stuck": ("channel-stuck",),
}
"""Codes with which a campaign may be refused instead: the fault is found before any fit."""

SENSORS = (
    "pressure_gain",
    "pressure_offset",
    "position_scale",
    "sensor_lag",
    "sensor_stuck",
    "sensor_slip",
    "clock_late",
)
CONDITIONS = ("load_entered", "temperature_offset", "temperature_stuck")

BETWEEN_LIFTS = ("mast_coupling", "chassis_compliance", "return_back_pressure")


@dataclass(frozen=True)
class Right:
    """Which answers to one concealed thing are right."""

    id: str
    kind: str
    names: tuple[str, ...]
    equations: tuple[str, ...]
    verdicts: tuple[str, ...]
    refused: tuple[str, ...] = ()
    of: str = ""


def nearest(name: str) -> str:
    """The effect of the catalogue that a law of another form is of: ``leakage__turbulent`` is a leakage."""
    return name.partition("__")[0]


def right(name: str) -> Right:
    """The right answers to what is concealed under `name`."""
    if name in strangers.SPECS:
        spec = strangers.SPECS[name]
        return Right(name, "stranger", (), spec.equations, ("unknown-effect", "missing-physics"), of=spec.of)
    known = nearest(name)
    names = ACCEPTED.get(known, (known,))
    if name in SENSORS:
        both = ("sensor-fault", "missing-physics") if name == "clock_late" else ("sensor-fault",)
        return Right(name, "sensor", names, EQUATIONS[name], both, REFUSED.get(name, ()))
    if name in CONDITIONS:
        told = ("parameter-error", "sensor-fault") if "temperature" in name else ("parameter-error",)
        return Right(name, "condition", names, EQUATIONS[name], told, REFUSED.get(name, ()))
    kind = "shape" if "__" in name else "effect"
    verdicts = ("missing-physics", "unknown-effect") if kind == "shape" else ("missing-physics",)
    return Right(name, kind, names, EQUATIONS[known], verdicts)


def of_kind(kind: str) -> tuple[str, ...]:
    """Everything of a kind that may be concealed."""
    return {
        "stranger": tuple(strangers.SPECS),
        "effect": tuple(effects.CATALOGUE),
        "two": tuple(effects.CATALOGUE),
        "shape": tuple(others.OTHERS),
        "sensor": SENSORS,
        "condition": CONDITIONS,
    }.get(kind, ())


def both_lifts(name: str) -> bool:
    """Whether only a campaign with both lifts tells it."""
    if name in strangers.SPECS:
        return strangers.SPECS[name].lifts == "both"
    return nearest(name) in BETWEEN_LIFTS
