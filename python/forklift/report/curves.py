"""An unknown input of any machine against its variables, beside what the final model has there.

Both are smoothed alike: first from what the recordings say beyond the fitted model, then from what the final
model says beyond it, read by the same sensors with their noise and put in the recordings' place. Where the
final model has the right law the two curves lie on each other, whatever other parameters have taken up of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.arrays import Floats
from forklift.diagnosis.dependence import Dependence, dependences
from forklift.diagnosis.locate import UnknownInput, unknown_inputs
from forklift.fitting.intervals import QUANTILE

if TYPE_CHECKING:
    from forklift.diagnosis.refit import Refit
    from forklift.fitting.observed import Observed


MOST_VARIABLES = 3
SEED = 1
"""Of the noise with which the final model is read."""
TOLD = 0.7
"""A moment is drawn if the recordings narrow the input there to this share of what it may be anyway."""


@dataclass(frozen=True, eq=False)
class Against:
    """The input against one variable."""

    variable: str
    explained: float
    """Share of the input's square that the curve explains in recordings it was not drawn from."""
    values: Floats
    """(moments,) of the variable."""
    found: Floats
    """(moments,) the input."""
    at: Floats
    """(knots,) of the variable."""
    curve: Floats
    """(knots,) the input as a function of it."""
    band: Floats
    """(knots,) half of its 95 % interval, from leaving out each recording in turn (jackknife)."""
    law: Floats | None
    """(knots,) what the final model has there; None if nothing was added to it."""


def against(
    best: UnknownInput,
    seen: Sequence[Dependence],
    given: Sequence[Mapping[str, Floats]],
    final: UnknownInput | None,
) -> list[Against]:
    """An unknown input against the first variables of `seen`, which `given` holds at the times of its hats.

    `final`: the same input as `had_it_been` gives it.
    """
    return [_against(best, shape, given, final) for shape in seen[:MOST_VARIABLES]]


def had_it_been(baseline: Refit, final: Refit, port: str) -> UnknownInput | None:
    """The same input, had the recordings been what the final model says and the sensors read of it."""
    if not final.hypotheses:
        return None
    problem, last = baseline.early.problem, final.found
    random = np.random.default_rng(SEED)
    said = [
        replace(
            sample,
            observed=tuple(
                replace(seen, values=_read(run[seen.sensor.channel], seen, random))
                for seen in sample.observed
            ),
        )
        for sample, run in zip(problem.samples, last.problem.said(last.x), strict=True)
    ]
    instead = problem.over(said)
    width_s = problem.machine.hat_width_s(problem.samples)
    return next(iter(unknown_inputs(instead, baseline.early.x, [port], width_s)), None)


def _read(values: Floats, seen: Observed, random: np.random.Generator) -> Floats:
    """What a sensor would have read: whole counts of an encoder, else with noise; within its ends."""
    sensor = seen.sensor
    if sensor.count:
        return seen.reading(np.floor(values / sensor.count) * sensor.count)
    return seen.reading(values + sensor.noise * random.standard_normal(len(values)))


def _against(
    best: UnknownInput, shape: Dependence, given: Sequence[Mapping[str, Floats]], fitted: UnknownInput | None
) -> Against:
    name = shape.variable
    columns = [one[name] for one in given]
    told = np.concatenate(best.bands) < TOLD * best.size
    values, moments = np.concatenate(columns), np.concatenate(best.values)
    told &= np.isfinite(values)
    law = None if fitted is None else _curve(fitted, name, columns, shape.at)
    return Against(
        name, shape.explained, values[told], moments[told], shape.at, shape.curve,
        _band(best, name, columns, shape.at), law,
    )  # fmt: skip


def _curve(of: UnknownInput, name: str, columns: Sequence[Floats], at: Floats) -> Floats | None:
    """The input as a function of one variable, at these values of it."""
    drawn = dependences(of, [{name: column} for column in columns])
    return np.interp(at, drawn[0].at, drawn[0].curve) if drawn else None


def _band(best: UnknownInput, name: str, columns: Sequence[Floats], at: Floats) -> Floats:
    count = len(columns)
    if count < 2:
        return np.full(len(at), np.nan)  # there is none to leave out
    curves = []
    for out in range(count):
        kept = [k for k in range(count) if k != out]
        part = replace(
            best,
            centres=tuple(best.centres[k] for k in kept),
            values=tuple(best.values[k] for k in kept),
            bands=tuple(best.bands[k] for k in kept),
        )
        curve = _curve(part, name, [columns[k] for k in kept], at)
        if curve is not None:
            curves.append(curve)
    if len(curves) < 2:
        return np.full(len(at), np.nan)
    n = len(curves)
    variance: Floats = (n - 1) / n * np.sum((np.array(curves) - np.mean(curves, axis=0)) ** 2, axis=0)
    return np.asarray(QUANTILE * np.sqrt(variance))
