"""The core's tables of names, by name: the one place where Python learns units, bounds and meanings."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Literal

from forklift import _core

if TYPE_CHECKING:
    from forklift._core import EffectSpec, ParameterSpec, QuantitySpec

Lift = Literal["free", "main"]
Lifts = Literal["both", "free", "main"]

LIFTS: tuple[Lift, Lift] = ("free", "main")


def commanded(lift: Lifts) -> tuple[Lift, ...]:
    """The lifts that `lift` stands for: ``"both"`` is both of them."""
    return LIFTS if lift == "both" else (lift,)


@cache
def parameters() -> dict[str, ParameterSpec]:
    """Every parameter a truck can have, effects' included, by its full name, e.g. ``"free.valve.D"``."""
    thesis = {f"{lift}.{spec['name']}": spec for lift in LIFTS for spec in _core.parameter_table()}
    return thesis | {
        name: spec for effect in _core.effect_table() for name, spec in of_effect(effect).items()
    }


def of_effect(effect: EffectSpec) -> dict[str, ParameterSpec]:
    """An effect's parameters by full name: ``"main.leakage.coefficient"``, ``"mast_coupling.factor"``."""
    heads = [f"{lift}." for lift in LIFTS] if effect["scope"] == "lift" else [""]
    return {f"{head}{effect['id']}.{spec['name']}": spec for head in heads for spec in effect["parameters"]}


@cache
def outputs() -> dict[str, QuantitySpec]:
    """What a simulation gives, in its order."""
    return {spec["name"]: spec for spec in _core.output_table()}


@cache
def channels() -> dict[str, QuantitySpec]:
    """What a recording may hold, in its order."""
    return {spec["name"]: spec for spec in _core.channel_table()}


@cache
def states() -> dict[str, QuantitySpec]:
    """The states of the thesis's model of one lift, without the lift's name."""
    return {spec["name"]: spec for spec in _core.state_table()}


def amount(value: float, unit: str) -> str:
    """A value as a sentence says it: three digits, with the prefix that keeps them short."""
    value = float(f"{value:.3g}")  # before the prefix is chosen: 999.7 Pa are 1 kPa
    for scale, prefix in ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m")):
        if abs(value) >= scale:
            return f"{value / scale:.3g} {prefix}{unit}"
    return f"{value:.3g} {unit}"
