"""Recordings of a machine posed as a least-squares problem."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.fitting.problem import LeastSquares
from forklift.fitting.residuals import LAGS
from forklift.fitting.sample import Sample, observing
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Machine
from forklift.recordings.noise import Sensor

SUBSTEPS = 4
"""Of a simulation, from one sample to the next."""


def pose(
    machine: Machine,
    recordings: Sequence[Any],
    unknowns: Sequence[Unknown],
    sensors: Mapping[str, Sensor],
    sigma: Mapping[str, float] | None = None,
    *,
    substeps: int = SUBSTEPS,
) -> LeastSquares:
    """The problem of these recordings, at the values the machine starts with.

    Parameters
    ----------
    sensors
        By channel; what has none is not looked at.
    sigma
        By channel, what it is weighted by; a search sets it.

    Raises
    ------
    ForkliftError
        ``"nothing-measured"`` of a recording without a sample; whatever the machine's `case` raises.
    """
    samples = tuple(posed(machine, piece, sensors) for one in recordings for piece in machine.pieces(one))
    for sample in samples:
        if sensors and not any(len(seen.values) for seen in sample.observed):
            raise ForkliftError(
                "nothing-measured",
                f"{sample.recording.file} has no sample of anything that the model gives, so that nothing "
                "can be fitted to it or judged on it; take it out",
                file=sample.recording.file,
            )
    shortest = min((len(sample.recording) for sample in samples), default=0)
    lags = max(LAGS, int(machine.lag_share * shortest))
    return LeastSquares(machine, tuple(unknowns), samples, substeps, sigma or {}, lags=lags)


def posed(machine: Machine, piece: Any, sensors: Mapping[str, Sensor]) -> Sample:
    """One recording, or one stretch of it."""
    outputs: Sequence[str] = machine.outputs
    measured: Mapping[str, Floats] = machine.measured(piece)
    return observing(
        machine.case(piece, sensors), measured, sensors, outputs, machine.ends, machine.instants(piece)
    )
