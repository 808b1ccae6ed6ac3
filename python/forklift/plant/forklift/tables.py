"""The core's tables of names, by name: the one place where Python learns units, bounds and meanings."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from forklift import _core
from forklift.base.sheet import Listing
from forklift.recordings.channels import LIFTS

if TYPE_CHECKING:
    from forklift._core import EffectSpec, ParameterSpec, QuantitySpec


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
def states() -> dict[str, QuantitySpec]:
    """The states of the thesis's model of one lift, without the lift's name."""
    return {spec["name"]: spec for spec in _core.state_table()}


def parameter_listing() -> Listing:
    """What a truck's file must give: every parameter of a lift with unit, bounds and meaning."""
    return Listing(
        "Parameters of each lift, in a truck's file below [free] and [main]",
        ["parameter", "unit", ">least", ">greatest", "meaning"],
        [
            (spec["name"], spec["unit"], f"{spec['lower']:g}", f"{spec['upper']:g}", spec["meaning"])
            for spec in _core.parameter_table()
        ],
    )


def effect_listing() -> Listing:
    """The effects that a truck's parameters may add to the thesis's model."""
    return Listing(
        "Effects, present if a truck's file gives their parameters",
        ["parameter", "unit", ">least", ">greatest", "equation"],
        [
            (name, spec["unit"], f"{spec['lower']:g}", f"{spec['upper']:g}", effect["equation"])
            for effect in _core.effect_table()
            for name, spec in of_effect(effect).items()
        ],
    )
