"""A fit as tables: every parameter, every fit before and after, and what is left of every signal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import polars as pl

from forklift.fitting.agreement import change
from forklift.fitting.intervals import interval, within
from forklift.fitting.widening import widening
from forklift.plant.parameter import DEGREES

if TYPE_CHECKING:
    from forklift.fitting.fitted import Fitted

PRIOR_QUANTILE = 2.7764451051977987
"""Of Student's t with `DEGREES` degrees of freedom: 95 % of the prior lie within."""
assert DEGREES == 4.0

PARAMETER_COLUMNS = {
    "name": pl.String,
    "part": pl.String,
    "unit": pl.String,
    "start": pl.Float64,
    "start_lower": pl.Float64,
    "start_upper": pl.Float64,
    "value": pl.Float64,
    "lower": pl.Float64,
    "upper": pl.Float64,
    "told": pl.String,
    "widening": pl.Float64,
    "deviation": pl.Float64,
    "alone": pl.Float64,
    "moves_with": pl.String,
}


def parameters(fit: Fitted) -> pl.DataFrame:
    """One row per parameter that was estimated.

    ``start_lower`` and ``start_upper`` bound 95 % of the prior, ``lower`` and ``upper`` of the posterior.
    ``told`` is ``"yes"``, ``"together"`` (with others only) or ``"no"``; ``deviation`` the posterior's
    standard deviation in units of the prior's, ``alone`` the same if all other parameters were known.
    ``widening`` is by how much the posterior's interval is wider than if the truck explained everything:
    above 1 it is biased, too, by what is missing. ``moves_with`` is the parameter this one was made to move
    with.
    """
    return pl.DataFrame(list(_parameter_rows(fit)), schema=PARAMETER_COLUMNS, orient="row")


def _parameter_rows(fit: Fitted) -> Iterator[tuple[Any, ...]]:
    together = {name for group in fit.knowledge.groups for name in group.names}
    for estimate, theta in zip(fit.knowledge.estimates, fit.found.x, strict=False):
        unknown = estimate.unknown
        told = "yes" if estimate.identifiable else "together" if estimate.name in together else "no"
        values = unknown.values(float(theta))
        before = within(unknown, 0.0, PRIOR_QUANTILE)
        wide = widening(fit.judged, unknown.name)
        after = interval(unknown, float(theta), wide * estimate.deviation)
        for place, name in enumerate(unknown.names):
            part = name.partition(".")[0]
            yield (
                name,
                part if part in fit.machine.parts else None,
                unknown.unit,
                float(unknown.start[place]),
                *map(float, before[:, place]),
                float(values[place]),
                *map(float, after[:, place]),
                told,
                wide,
                estimate.deviation,
                estimate.alone,
                unknown.name if place else None,
            )


def fits(fit: Fitted) -> pl.DataFrame:
    """`Comparison.fits` before and after: one row per recording and signal."""
    return change(fit.before.agreement, fit.after.agreement)


def signals(fit: Fitted) -> pl.DataFrame:
    """The mean square that is left of each signal, by role: over all recordings, and of the worst."""
    rows = []
    for channel in fit.sensors:
        for role in ("estimate", "validate"):
            seen = [found for found in fit.judged if (found.channel, found.role) == (channel, role)]
            if not seen:
                continue
            worst = max(seen, key=lambda found: found.mean_square)
            samples = sum(found.samples for found in seen)
            mean = sum(found.samples * found.mean_square for found in seen) / samples
            tested = [found.white for found in seen if found.white is not None]
            rows.append(
                {
                    "channel": channel,
                    "role": role,
                    "recordings": len(seen),
                    "mean_square": mean,
                    "worst": worst.mean_square,
                    "worst_file": worst.file,
                    "explained": sum(found.explained for found in seen),
                    "white": sum(tested),
                    "tested": len(tested),
                }
            )
    return pl.DataFrame(rows)
