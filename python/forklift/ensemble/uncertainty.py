"""A fit's covariance as what a sweep draws: trucks within the uncertainty of an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.fitting.intervals import Knowledge
from forklift.plant.forklift.tables import parameters
from forklift.plant.parameter import Unknown
from forklift.plant.sensor_faults import SensorUnknown


def of_knowledge(unknowns: Sequence[Unknown], knowledge: Knowledge, values: dict[str, Any]) -> dict[str, Any]:
    """``vary`` and ``correlate`` of a sweep for a fit: ``of_knowledge(fit.unknowns, fit.knowledge,
    fit.truck.values)``.

    Each parameter is normal, or normal in its logarithm where it was fitted so, with its posterior standard
    deviation, cut off at its bounds; together they have the fit's correlations. Of a scale that is neither
    the tangent at the estimate counts. Parameters that move together in the fit move together here.
    """
    vary: dict[str, Any] = {}
    columns: list[int] = []
    signs: list[float] = []
    for k, unknown in enumerate(unknowns):
        if isinstance(unknown, SensorUnknown):
            continue  # the recordings' clocks, and nothing of the truck's
        deviation = float(np.sqrt(knowledge.covariance[k, k]))
        slopes = unknown.slopes(_theta(unknown, _value(values, unknown.names[0])))
        for name, slope in zip(unknown.names, map(float, slopes), strict=True):
            value, spec = _value(values, name), _bounds(name)
            if unknown.scale == "log":
                vary[name] = {"log_normal": [value, unknown.width * deviation, *spec]}
            else:
                vary[name] = {"normal": [value, abs(slope) * deviation, *spec]}
            columns.append(k)
            signs.append(-1.0 if slope < 0.0 else 1.0)
    correlation: Floats = knowledge.correlation[np.ix_(columns, columns)]
    # Of a scale on which a value falls as θ rises the values are correlated the other way round.
    correlation = np.clip(0.5 * (correlation + correlation.T), -1.0, 1.0) * np.outer(signs, signs)
    np.fill_diagonal(correlation, 1.0)
    return {"vary": vary, "correlate": [{"names": list(vary), "matrix": correlation.tolist()}]}


def _theta(unknown: Unknown, value: float) -> float:
    """θ at which the first parameter has a value: its slope is asked for there."""
    from scipy.optimize import brentq

    def apart(theta: float) -> float:
        return float(unknown.values(theta)[0]) - value

    low, high = max(unknown.lower, -50.0), min(unknown.upper, 50.0)
    if apart(low) * apart(high) > 0.0:
        return 0.0
    return float(brentq(apart, low, high))


def _value(values: dict[str, Any], name: str) -> float:
    """A parameter's value; a table's entry has a name that ends with its place."""
    if name in values:
        return float(values[name])
    table, _, place = name.rpartition(".")
    return float(values[table][int(place)])


def _bounds(name: str) -> list[float]:
    known = parameters()
    spec = known[name] if name in known else known[name.rpartition(".")[0]]
    return [float(spec["lower"]), float(spec["upper"])]
