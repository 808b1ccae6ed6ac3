"""What may be amiss with a forklift or its recordings: the catalogue's effects, and their dull rivals."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from itertools import product
from typing import TYPE_CHECKING

from forklift import _core
from forklift.plant.forklift.effects import EFFECTS
from forklift.plant.forklift.sensors import POSITIONS
from forklift.plant.forklift.unknowns import unknown
from forklift.plant.protocol import Addition, Hypothesis
from forklift.plant.sensor_faults import SensorFault, SensorUnknown, condition_offset, sensor_unknown
from forklift.recordings.channels import LIFTS, Lift, channels

if TYPE_CHECKING:
    from forklift._core import EffectParameterSpec, EffectSpec
    from forklift.plant.forklift.truck import Truck

OIL = "oil_temperature_degc"
"""The channel that tells the temperature of the oil."""
LOAD_WIDTH_KG = 100.0
"""Prior standard deviation of an entered load that may be wrong."""
TEMPERATURE_WIDTH_K = 10.0
"""The same of a recording's oil temperature: a sensor that stands still is off by as much as the oil warms up
from a cold morning to the afternoon."""
START_WIDTH_M = 0.2
"""Where a lift starts, as far as an encoder of unknown scale tells."""

PLACE, PLACES = "centre", (0.1, 0.3, 0.5, 0.7, 0.9)
"""The parameter that is a place of the stroke, and at which shares of the way travelled it is looked for."""
REACH, FAR = "length", (0.15, 0.25, 0.5, 1.0)
"""The parameter that is a way from the lower stop. A lift that turns back before its stop meets only what
reaches to where it turned: starts count from there, and go on to these shares of the way travelled."""
WIDE = 2.0
"""A parameter is wide open if what is plausible spans this factor."""
SHARES = ((1 / 6, 1 / 2, 5 / 6), (0.3, 0.7))
"""Shares of what is plausible at which the first and the second wide open parameter start."""

FAULTS: dict[str, tuple[tuple[SensorFault, str, str], ...]] = {
    "Pa": (
        ("gain", "pressure_gain", "the pressure sensor's gain is off"),
        ("offset", "pressure_offset", "the pressure sensor's zero is off"),
        ("lag", "sensor_lag", "the signal arrives late"),
    ),
    "m": (
        ("gain", "position_scale", "the position sensor's scale is off"),
        ("offset", "position_offset", "the position sensor's zero is off"),
        ("lag", "sensor_lag", "the signal arrives late"),
    ),
}
"""By a channel's unit: how its sensor may read wrongly, the word for it, and the sentence."""


def hypotheses(
    truck: Truck,
    lifts: Collection[Lift],
    measured: Collection[str],
    travelled: Mapping[Lift, tuple[float, float]],
    with_oil: Collection[str] = (),
    apart: Collection[Collection[str]] = (),
) -> tuple[Hypothesis, ...]:
    """All of them, for recordings that command `lifts` and have these channels.

    Each lift's cylinder `travelled` from there to there [m]. An effect that looks different at different
    values of its further parameters is a hypothesis for some of them, all under one label. `with_oil` are the
    files of the recordings with an oil temperature of their own; `apart`, the channels of each clock that is
    not the command's, whose lag is estimated anyhow and no hypothesis. Of what the return line of all lifts
    and the hose of one do where no other lift moves, which no recording can part, the hose is named.
    """
    return (
        *_physics(truck, lifts, travelled),
        *_sensors(measured, {frozenset(one) for one in apart}),
        *_conditions(with_oil),
    )


def _physics(
    truck: Truck, lifts: Collection[Lift], travelled: Mapping[Lift, tuple[float, float]]
) -> Iterator[Hypothesis]:
    specs = effect_specs()
    for effect in EFFECTS:
        if effect.general:
            continue
        scope = [lift for lift in LIFTS if lift in lifts] if specs[effect.id]["scope"] == "lift" else [""]
        for lift in scope:
            way = travelled.get(lift)  # type: ignore[call-overload]
            stop = float(truck.values[f"{lift}.cylinder.stroke_lower"]) if lift else 0.0  # type: ignore[arg-type]
            for starts in starting_values(effect.id, way, stop):
                yield Hypothesis(
                    effect.id,
                    "physics",
                    effect.name,
                    lift,
                    effect.equation,
                    _names(effect.id, lift)[0],
                    acting(truck, effect.id, lift, starts),
                    effect.confused_with,
                    effect.needs_two_of,
                    unlikely=len(lifts) == 1 and effect.id == "return_back_pressure",
                    also_in=effect.also_in,
                    plausible=_plausible(effect.id, lift, way),
                )


def _plausible(
    id: str, lift: str, travelled: tuple[float, float] | None
) -> tuple[tuple[str, float, float], ...]:
    """Of an effect's parameters: as the catalogue has it; a place lies where the lift came by."""
    rows = zip(_names(id, lift), effect_specs()[id]["parameters"], strict=True)
    return tuple(
        (name, *travelled)
        if one["name"] == PLACE and travelled
        else (name, one["plausible_lower"], one["plausible_upper"])
        for name, one in rows
    )


@cache
def effect_specs() -> dict[str, EffectSpec]:
    """The core's table of effects, by id."""
    return {spec["id"]: spec for spec in _core.effect_table()}


def _names(id: str, lift: str) -> list[str]:
    head = f"{lift}.{id}" if lift else id
    return [f"{head}.{parameter['name']}" for parameter in effect_specs()[id]["parameters"]]


def acting(truck: Truck, id: str, lift: str, starts: Sequence[float] | None = None) -> Addition:
    """An effect at its null value; its further parameters at `starts`, by default amid what is plausible."""
    spec, names = effect_specs()[id], _names(id, lift)
    further = starts if starts is not None else [_at(one, 0.5) for one in spec["parameters"][1:]]
    return added(truck, dict(zip(names, [spec["quiet"], *further], strict=True)), names)


def added(truck: Truck, values: Mapping[str, float], free: Sequence[str]) -> Addition:
    """Further parameters of the truck at `values`, some of them unknown."""
    there = truck.with_values(values, source="hypothesis")
    return Addition(tuple(values.items()), tuple(unknown(there, name) for name in free))


def starting_values(
    id: str, travelled: tuple[float, float] | None, stop: float = 0.0
) -> Iterator[tuple[float, ...]]:
    """From where the search for an effect's further parameters may start: the first two that are wide open
    at some values each, a place on the way that the lift travelled, and what reaches from its lower `stop` to
    that way."""
    wide, values = 0, []
    for one in effect_specs()[id]["parameters"][1:]:
        if one["name"] == PLACE and travelled:
            values.append([travelled[0] + share * (travelled[1] - travelled[0]) for share in PLACES])
            wide += 1
        elif one["name"] == REACH and travelled:
            values.append(_reaching(one, travelled, stop))
            wide += 1
        elif _wide(one) and wide < len(SHARES):
            values.append([_at(one, share) for share in SHARES[wide]])
            wide += 1
        else:
            values.append([_at(one, 0.5)])
    return product(*values)


def _reaching(parameter: EffectParameterSpec, travelled: tuple[float, float], stop: float) -> list[float]:
    """Ways from the stop that end where the lift came by."""
    gap, way = max(travelled[0] - stop, 0.0), travelled[1] - travelled[0]
    into = [*(_at(parameter, share) for share in SHARES[0]), *(share * way for share in FAR)]
    return sorted({min(gap + one, parameter["upper"]) for one in into})


def _wide(parameter: EffectParameterSpec) -> bool:
    return parameter["plausible_upper"] > WIDE * abs(parameter["plausible_lower"])


def _at(parameter: EffectParameterSpec, share: float) -> float:
    """The value at a share of what is plausible."""
    lower, upper = parameter["plausible_lower"], parameter["plausible_upper"]
    if parameter["scale"] == "log":
        return float(lower * (upper / lower) ** share)
    return lower + share * (upper - lower)


def _sensors(measured: Collection[str], apart: Collection[frozenset[str]]) -> Iterator[Hypothesis]:
    for channel in measured:
        unit = channels()[channel]["unit"]
        for fault, id, name in FAULTS[unit]:
            if fault == "lag" and frozenset([channel]) in apart:
                continue
            number = sensor_unknown([channel], fault, unit)
            yield Hypothesis(id, "sensor", name, channel, "sensor", number.name, _misread(number))
    if frozenset(measured) in apart:
        return
    late = sensor_unknown(list(measured), "lag", "s")
    yield Hypothesis(
        "sensor_lag", "sensor", "all signals arrive late", "", "sensor", late.name, _misread(late),
        ("valve_delay",), unlikely=True,
    )  # fmt: skip


def _misread(number: SensorUnknown) -> Addition:
    """A number of a sensor; where an encoder's is not its lag, it no longer tells where its lift starts."""
    starts = [
        (f"{channel.split('_')[1]}.start", START_WIDTH_M)
        for channel in number.channels
        if channel in POSITIONS and number.fault in ("gain", "offset")
    ]
    return Addition(free=(number,), widened=tuple(starts))


def _conditions(with_oil: Collection[str]) -> Iterator[Hypothesis]:
    yield Hypothesis(
        "load_entered", "parameter", "the entered load is wrong", "", "operating-point", None,
        Addition(widened=(("load", LOAD_WIDTH_KG),)), ("pressure_gain", "pressure_offset"),
    )  # fmt: skip
    yield Hypothesis(
        "temperature_offset", "parameter", "the oil's temperature is off", "", "operating-point", None,
        Addition(widened=(("oil_temperature", TEMPERATURE_WIDTH_K),)),
        ("oil_temperature_at_valve", "viscosity_law"),
    )  # fmt: skip
    if with_oil:
        off = condition_offset(
            "temperature_offset.oil_temperature", "oil_temperature", "K", TEMPERATURE_WIDTH_K, with_oil
        )
        yield Hypothesis(
            "temperature_offset", "parameter", "the oil temperature sensor's zero is off", OIL,
            "operating-point", off.name, Addition(free=(off,)),
            ("oil_temperature_at_valve", "viscosity_law"),
        )  # fmt: skip
