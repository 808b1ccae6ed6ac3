"""What may be amiss with a plant or its recordings: its catalogue's effects, and their dull rivals.

The rivals come of themselves: each output's gain, offset and lag, each input's gain and offset, and each
parameter that is known within a range only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from forklift.plant.findings import InvalidStretch
from forklift.plant.parts import Effect, Input, Output, Param, Plant
from forklift.plant.protocol import Addition, Hypothesis
from forklift.plant.recording import Recording
from forklift.plant.sensor_faults import SensorFault, SensorUnknown

FAULT_SHARE = 0.1
"""Standard deviation of an offset, in the range of what was recorded."""
MOST = 4.0
"""A fault is looked for up to this many of its standard deviations."""


def hypotheses(plant: Plant, recordings: Sequence[Recording]) -> tuple[Hypothesis, ...]:
    """All of them."""
    return (
        *(found for effect in plant.effects for found in of_effect(plant, effect)),
        *_outputs(plant, recordings),
        *_inputs(plant, recordings),
        *_parameters(plant),
    )


def of_effect(plant: Plant, effect: Effect) -> Iterator[Hypothesis]:
    """An effect from every place where its search may start, all under one label."""
    kinds = {port.name: port.kind for port in plant.ports}
    values = [one.starts or (one.value,) for one in effect.params[1:]]
    for starts in product(*values):
        further = [replace(one, value=at) for one, at in zip(effect.params[1:], starts, strict=True)]
        yield Hypothesis(
            effect.id,
            "physics",
            effect.name,
            "",
            kinds.get(effect.ports[0], "input") if effect.ports else "law",
            effect.amplitude,
            acting(replace(effect, params=(effect.params[0], *further))),
            effect.confused_with,
        )


def invalid_hypothesis(stretch: InvalidStretch) -> Hypothesis:
    """A signal that stood still or slipped, whose samples were left out: nothing is left to try."""
    return Hypothesis(
        f"sensor_{stretch.how}", "sensor", stretch.said, stretch.channel, "sensor", None, Addition()
    )


def acting(effect: Effect) -> Addition:
    """An effect at its null value."""
    return Addition(
        tuple((effect.full(one), one.value) for one in effect.params),
        tuple(one.unknown(effect.full(one)) for one in effect.params if not one.known),
    )


def _outputs(plant: Plant, recordings: Sequence[Recording]) -> Iterator[Hypothesis]:
    for one in plant.outputs:
        columns = [found.y[one.name] for found in recordings if one.name in found.y]
        if one.gain_range:
            yield _fault(one, "gain", "the sensor's gain is off", _gain(one))
        if offset := _offset(one, columns):
            yield _fault(one, "offset", "the sensor's zero is off", offset)
        lag = _interval(one, recordings) if one.lag_range is None else one.lag_range
        if lag:
            yield _fault(one, "lag", "the signal arrives late", Param("lag", "s", 0.0, 0.0, MOST * lag))


def _interval(one: Output, recordings: Sequence[Recording]) -> float:
    """From one of its samples to the next [s]; 0 if no recording has two."""
    for found in recordings:
        if one.name in found.y:
            time = found.time_s[np.isfinite(found.y[one.name])]
            if len(time) > 1:
                return float(np.median(np.diff(time)))
    return 0.0


def _inputs(plant: Plant, recordings: Sequence[Recording]) -> Iterator[Hypothesis]:
    for one in plant.inputs:
        if one.derived:
            continue
        if one.gain_range:
            yield _fault(one, "gain", "the input's gain is off", _gain(one))
        if offset := _offset(one, [found.u[one.name] for found in recordings]):
            yield _fault(one, "offset", "the input's zero is off", offset)


def _gain(one: Input | Output) -> Param:
    return Param("gain", "1", 1.0, max(1.0 - MOST * one.gain_range, 0.01), 1.0 + MOST * one.gain_range)


def _offset(one: Input | Output, columns: Sequence[np.ndarray]) -> Param | None:
    size = one.offset_range
    if size is None:
        spans = (float(np.nanmax(c) - np.nanmin(c)) for c in columns if np.isfinite(c).any())
        size = FAULT_SHARE * max(spans, default=0.0)
    return Param("offset", one.unit, 0.0, -MOST * size, MOST * size) if size else None


def _fault(one: Input | Output, fault: SensorFault, name: str, number: Param) -> Hypothesis:
    full = f"{one.name}.{fault}"
    return Hypothesis(
        f"{'input' if isinstance(one, Input) else 'sensor'}_{fault}",
        "sensor",
        name,
        one.name,
        "input" if isinstance(one, Input) else "sensor",
        full,
        _of_input(replace(number, name=full))
        if isinstance(one, Input)
        else _misread(one, number, full, fault),
    )


def _parameters(plant: Plant) -> Iterator[Hypothesis]:
    for one in plant.params:
        if (
            one.known
            and one.per == "plant"
            and np.isfinite([one.lower, one.upper]).all()
            and one.upper > one.lower
        ):
            yield Hypothesis(
                "parameter",
                "parameter",
                f"{one.name} is known within a range only",
                one.name,
                "parameter",
                one.name,
                _of_input(one),
            )


def _of_input(number: Param) -> Addition:
    """A number of the plant, unknown."""
    return Addition(((number.name, number.value),), (number.unknown(),))


def _misread(one: Output, number: Param, name: str, fault: SensorFault) -> Addition:
    """A number of an output's sensor, unknown."""
    own = number.unknown(name)
    return Addition(
        free=(
            SensorUnknown(
                own.names, own.unit, own.scale, own.start, own.width, own.lower, own.upper, (one.name,), fault
            ),
        )
    )
