"""A controller as an ensemble takes it: numbers that may vary from member to member, tables that do not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

from forklift.control.controller import (
    Controller,
    Given,
    LiftSettings,
    Number,
    lift_settings,
    shared_settings,
)
from forklift.recordings.channels import Lift, Lifts


def given(controller: Controller, lifts: Lifts) -> Given:
    """As the core takes it; of one lift alone the reference is all its own."""
    return (controller if lifts == "both" else controller.only(lifts)).given


def to_data(controller: Controller) -> dict[str, Any]:
    """A controller as plain data, for JSON and for workers."""
    return {
        "name": controller.name,
        "word": controller.word,
        "hash": controller.hash,
        "shared": {name: number.model_dump() for name, number in controller.shared.items()},
        "free": controller.free.model_dump(),
        "main": controller.main.model_dump(),
    }


def of_data(data: Mapping[str, Any]) -> Controller:
    """The controller that `to_data` gave."""
    shared = {name: Number.model_validate(number) for name, number in data["shared"].items()}
    free, main = (LiftSettings.model_validate(data[lift]) for lift in ("free", "main"))
    return Controller(data["name"], shared, free, main, data["word"])


def names() -> list[str]:
    """What a sweep may vary of a controller, after ``controller.``."""
    lifts = [f"{lift}.{name}" for lift in get_args(Lift) for name in lift_settings()]
    return [f"shared.{name}" for name in shared_settings()] + lifts


def value(controller: Controller, name: str) -> float:
    """A setting by its name, as in `names`."""
    part, _, setting = name.partition(".")
    numbers = controller.shared if part == "shared" else getattr(controller, part).numbers
    return float(numbers[setting].value)
