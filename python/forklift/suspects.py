"""What may be amiss with a forklift or its recordings: the catalogue's effects, and their dull rivals."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import replace
from math import sqrt
from typing import TYPE_CHECKING

from forklift import _core
from forklift.diagnosis.suspect import Suspect, widened, with_unknown
from forklift.effects import EFFECTS
from forklift.estimation.problem import Problem
from forklift.estimation.readings import Fault, Reading, reading
from forklift.estimation.sensors import POSITIONS
from forklift.estimation.unknowns import unknown
from forklift.names import LIFTS, Lift, channels

if TYPE_CHECKING:
    from forklift._core import EffectParameterSpec, EffectSpec
    from forklift.stuck_sensors import Stuck

LOAD_WIDTH_KG = 100.0
"""Prior standard deviation of an entered load that may be wrong."""
TEMPERATURE_WIDTH_K = 3.0
"""The same of a recording's oil temperature."""
START_WIDTH_M = 0.2
"""Where a lift starts, as far as an encoder of unknown scale tells."""

FAULTS: dict[str, tuple[tuple[Fault, str, str], ...]] = {
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


def suspects(lifts: Collection[Lift], measured: Collection[str]) -> tuple[Suspect, ...]:
    """All of them, for a campaign that commands `lifts` and has these channels."""
    return (*_physics(lifts), *_sensors(measured), *_conditions())


def stuck_suspect(stuck: Stuck) -> Suspect:
    """A signal that stood still, whose samples were left out: nothing is left to try."""
    return Suspect(
        "sensor_stuck", "sensor", f"the signal stands still in {stuck.where}", stuck.channel, "sensor", None,
        lambda problem: problem,
    )  # fmt: skip


def _physics(lifts: Collection[Lift]) -> Iterator[Suspect]:
    specs = {spec["id"]: spec for spec in _core.effect_table()}
    for effect in EFFECTS:
        if effect.general:
            continue
        spec = specs[effect.id]
        for lift in [lift for lift in LIFTS if lift in lifts] if spec["scope"] == "lift" else [""]:
            head = f"{lift}.{effect.id}" if lift else effect.id
            names = [f"{head}.{parameter['name']}" for parameter in spec["parameters"]]
            yield Suspect(
                effect.id,
                "physics",
                effect.name,
                lift,
                effect.equation,
                names[0],
                _acting(names, spec),
                effect.confused_with,
            )


def _acting(names: Sequence[str], spec: EffectSpec) -> Callable[[Problem], Problem]:
    """Adds an effect: its amplitude at the quiet value, all else in the middle of what is plausible."""
    starts = [spec["quiet"], *map(_middle, spec["parameters"][1:])]

    def add(problem: Problem) -> Problem:
        truck = problem.truck.with_values(dict(zip(names, starts, strict=True)), source="suspected")
        own = [known for known in problem.unknowns if not isinstance(known, Reading)]
        readings = [known for known in problem.unknowns if isinstance(known, Reading)]
        more = [unknown(truck, name) for name in names]
        return replace(problem, truck=truck, unknowns=(*own, *more, *readings))

    return add


def _middle(parameter: EffectParameterSpec) -> float:
    lower, upper = parameter["plausible_lower"], parameter["plausible_upper"]
    return sqrt(lower * upper) if parameter["scale"] == "log" else 0.5 * (lower + upper)


def _sensors(measured: Collection[str]) -> Iterator[Suspect]:
    for channel in measured:
        unit = channels()[channel]["unit"]
        for fault, id, name in FAULTS[unit]:
            number = reading([channel], fault, unit)
            yield Suspect(id, "sensor", name, channel, "sensor", number.name, _misread(number))
    late = reading(list(measured), "lag", "s")
    yield Suspect(
        "sensor_lag", "sensor", "all signals arrive late", "", "sensor", late.name, _misread(late),
        ("valve_delay",), unlikely=True,
    )  # fmt: skip


def _misread(number: Reading) -> Callable[[Problem], Problem]:
    def add(problem: Problem) -> Problem:
        for channel in number.channels:
            if channel in POSITIONS and number.fault != "lag":
                problem = widened(problem, f"{channel.split('_')[1]}.start", START_WIDTH_M)
        return with_unknown(problem, number)

    return add


def _conditions() -> Iterator[Suspect]:
    yield Suspect(
        "load_entered", "parameter", "the entered load is wrong", "", "operating-point", None,
        lambda problem: widened(problem, "load", LOAD_WIDTH_KG), ("pressure_gain", "pressure_offset"),
    )  # fmt: skip
    yield Suspect(
        "temperature_offset", "parameter", "the oil's temperature is off", "", "operating-point", None,
        lambda problem: widened(problem, "oil_temperature", TEMPERATURE_WIDTH_K),
        ("oil_temperature_at_valve",),
    )  # fmt: skip
