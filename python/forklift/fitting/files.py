"""What a fit leaves behind: its folder, its JSON, and its parameters as a table."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from forklift.base import output, present
from forklift.base.errors import ForkliftError
from forklift.base.numbers import defined
from forklift.base.result_files import PAGE, earlier_files, json_rows
from forklift.fitting.agreement import prediction_files
from forklift.fitting.compare import (
    CHANGES,
    command_line,
    validation_change,
)
from forklift.fitting.intervals import QUANTILE
from forklift.fitting.widening import widening
from forklift.plant.forklift.speed_table import SpeedTable, speed_to_current
from forklift.plant.parameter import DEGREES
from forklift.recordings.channels import LIFTS

if TYPE_CHECKING:
    from forklift.base.arrays import Floats
    from forklift.fitting.fit import Fit
    from forklift.fitting.residuals import ChannelResidual
    from forklift.plant.parameter import Unknown
    from forklift.recordings.channels import Lift

MARK = "fit.json"
TRUCK = "truck.toml"

PRIOR_QUANTILE = 2.7764451051977987
"""Of Student's t with `DEGREES` degrees of freedom: 95 % of the prior lie within."""
assert DEGREES == 4.0

PARAMETER_COLUMNS = {
    "name": pl.String,
    "lift": pl.String,
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


def parameters(fit: Fit) -> pl.DataFrame:
    """One row per parameter that was estimated.

    ``start_lower`` and ``start_upper`` bound 95 % of the prior, ``lower`` and ``upper`` of the posterior.
    ``told`` is ``"yes"``, ``"together"`` (with others only) or ``"no"``; ``deviation`` the posterior's
    standard deviation in units of the prior's, ``alone`` the same if all other parameters were known.
    ``widening`` is by how much the posterior's interval is wider than if the truck explained everything:
    above 1 it is biased, too, by what is missing. ``moves_with`` is the parameter this one was made to move
    with.
    """
    return pl.DataFrame(list(_parameter_rows(fit)), schema=PARAMETER_COLUMNS, orient="row")


def _parameter_rows(fit: Fit) -> Iterator[tuple[Any, ...]]:
    together = {name for group in fit.knowledge.groups for name in group.names}
    for estimate, theta in zip(fit.knowledge.estimates, fit.found.x, strict=False):
        unknown = estimate.unknown
        told = "yes" if estimate.identifiable else "together" if estimate.name in together else "no"
        values = unknown.values(float(theta))
        before = interval(unknown, 0.0, PRIOR_QUANTILE)
        wide = widening(fit.judged, unknown.name)
        after = interval(unknown, float(theta), QUANTILE * wide * estimate.deviation)
        for place, name in enumerate(unknown.names):
            lift = name.partition(".")[0]
            yield (
                name,
                lift if lift in LIFTS else None,
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


def interval(unknown: Unknown, centre: float, half: float) -> Floats:
    """(2, names) of each parameter: least and greatest for θ within `half` of `centre` and its bounds."""
    ends = np.clip([centre - half, centre + half], unknown.lower, unknown.upper)
    return np.sort([unknown.values(float(end)) for end in ends], axis=0)


def fits(fit: Fit) -> pl.DataFrame:
    """`Comparison.fits` before and after: one row per recording and signal."""
    keys = [name for name in fit.after.fits.columns if name not in CHANGES]
    sides = [
        comparison.fits.select(*keys, *(pl.col(name).alias(f"{name}_{when}") for name in CHANGES))
        for when, comparison in (("before", fit.before), ("after", fit.after))
    ]
    order = [f"{name}_{when}" for name in CHANGES for when in ("before", "after")]
    return sides[0].join(sides[1].drop(keys[1:5] + keys[6:]), on=["file", "channel"]).select(*keys, *order)


def validation(fit: Fit, lift: Lift) -> pl.DataFrame:
    """`Comparison.validation` of one lift, before and after."""
    return validation_change(fit.before, fit.after, lift)


def speed_tables(fit: Fit) -> dict[Lift, SpeedTable]:
    """The controller's table of each fitted lift that has a steady lowering at every current."""
    found: dict[Lift, SpeedTable] = {}
    for lift in fit.lifts:
        try:
            found[lift] = speed_to_current(fit.truck, lift)
        except ForkliftError as error:
            if error.code != "no-steady-state":
                raise
    return found


def command(fit: Fit) -> str | None:
    """The command that repeats the fit; None if the campaign or the truck does not come from a file, or there
    were bounds or priors, which no command has."""
    options = fit.options
    if options["bounds"] or options["priors"]:
        return None
    words: list[str] = []
    if options["starts"] is not None:
        words += ["--starts", str(options["starts"])]
    for option, names in (("profile", "profiles"), ("hold", "hold"), ("also", "also")):
        words += [word for name in options[names] for word in (f"--{option}", name)]
    words += [word for group in options["together"] for word in ("--together", ",".join(group))]
    if options["load_width_kg"]:
        words += ["--load-width", repr(options["load_width_kg"])]
    if options["oil_temperature_degc"] is not None:
        words += ["--temperature", repr(options["oil_temperature_degc"])]
    if options["seed"] != 1:
        words += ["--seed", str(options["seed"])]
    return command_line("fit", fit.campaign, fit.start, words)


def to_dict(fit: Fit, tables: dict[Lift, SpeedTable] | None = None) -> dict[str, Any]:
    """Everything about a fit but its curves, for JSON."""
    from forklift import __version__

    tables = speed_tables(fit) if tables is None else tables
    names = [unknown.name for unknown in fit.unknowns]
    return {
        "schema": 1,
        "forklift": __version__,
        "campaign": fit.campaign.facts(),
        "start": fit.start.facts(),
        "truck": fit.truck.facts(),
        "options": dict(fit.options),
        "command": command(fit),
        "seconds": fit.seconds,
        "evaluations": fit.found.evaluations,
        "interrupted": fit.interrupted,
        "complete": fit.complete,
        "verdict": list(fit.verdict),
        "parameters": json_rows(parameters(fit)),
        "known_only_together": [
            {"names": list(group.names), "by": list(group.by), "units": list(group.units)}
            for group in fit.knowledge.groups
        ],
        "unidentifiable": list(fit.knowledge.unidentifiable),
        "correlation": {
            "names": names,
            "matrix": [[defined(value) for value in row] for row in fit.knowledge.correlation.tolist()],
        },
        "sensors": [
            {
                "channel": name,
                "noise": sensor.noise,
                "count": sensor.count,
                "weight": fit.noise[name],
                "widening": fit.knowledge.widening.get(name, 1.0),
            }
            for name, sensor in fit.sensors.items()
        ],
        "judged": [_judged(found) for found in fit.judged],
        "starts": [
            {
                "start": end.start + 1,
                "cost": defined(end.cost),
                "distance": defined(end.distance),
                "same": end.same,
            }
            for end in fit.ends
        ],
        "profiles": [
            {
                "name": found.name,
                "values": found.values.tolist(),
                "rise": [defined(value) for value in found.rise.tolist()],
                "lower": defined(found.lower),
                "upper": defined(found.upper),
            }
            for found in fit.profiles
        ],
        "cautions": [caution.to_dict() for caution in fit.cautions],
        "validation": {lift: json_rows(table) for lift in LIFTS if len(table := validation(fit, lift))},
        "fits": json_rows(fits(fit)),
        "speed_tables": {
            lift: {
                "file": _speed_file(lift),
                "load_kg": table.load_kg,
                "oil_temperature_degc": table.oil_temperature_degc,
                "fastest_m_s": table.fastest_m_s,
            }
            for lift, table in tables.items()
        },
    }


def _judged(found: ChannelResidual) -> dict[str, Any]:
    return {
        "file": found.file,
        "role": found.role,
        "lift": found.group,
        "channel": found.channel,
        "samples": found.samples,
        "mean_square": found.mean_square,
        "whiteness": None if found.whiteness is None else defined(found.whiteness),
        "explained": found.explained,
    }


def write(fit: Fit, out: str | Path) -> Path:
    """See `Fit.write`."""
    tables = speed_tables(fit)
    with output.folder(out, earlier(out), MARK) as temporary:
        fit.truck.write(temporary / TRUCK)
        fit.after.write_predictions(temporary)
        fits(fit).write_csv(temporary / "fit.csv")
        parameters(fit).write_csv(temporary / "parameters.csv")
        for lift, table in tables.items():
            table.write(temporary / _speed_file(lift))
        text = json.dumps(to_dict(fit, tables), indent=1, ensure_ascii=False, allow_nan=False)
        (temporary / MARK).write_text(text + "\n", encoding="utf-8", newline="\n")
        (temporary / PAGE).write_text(present.page(fit), encoding="utf-8", newline="\n")
    return Path(out)


def earlier(out: str | Path) -> frozenset[str]:
    """The files of the earlier fit that stands in `out`; none if there is none."""
    return earlier_files(out, MARK, _files)


def _files(recordings: Sequence[str]) -> frozenset[str]:
    """All that `write` may make of a campaign with these recordings."""
    tables = map(_speed_file, LIFTS)
    return frozenset({MARK, PAGE, TRUCK, "fit.csv", "parameters.csv", *tables, *prediction_files(recordings)})


def _speed_file(lift: Lift) -> str:
    return f"speed_table_{lift}.csv"


def signals(fit: Fit) -> pl.DataFrame:
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
