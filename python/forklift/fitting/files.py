"""What a fit leaves behind: its folder and its JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base import output, present
from forklift.base.numbers import defined
from forklift.base.result_files import PAGE, earlier_files, json_rows
from forklift.fitting import fit_tables, words
from forklift.fitting.agreement import prediction_files

if TYPE_CHECKING:
    from forklift.fitting.fitted import Fitted
    from forklift.fitting.residuals import ChannelResidual
    from forklift.plant.subject import Tabled

MARK = "fit.json"
MODELS = {"truck.toml", "parameters.json"}
"""What the fitted machine may be called."""


def command(fit: Fitted) -> str | None:
    """The command that repeats the fit; None if the recordings or the machine do not come from a file, or
    there were bounds or priors, which no command has."""
    if fit.options["bounds"] or fit.options["priors"]:
        return None
    return fit.origin.command(fit.machine, "fit", _options(fit))


def _options(fit: Fitted) -> list[str]:
    options = fit.options
    said: list[str] = []
    if options["starts"] is not None:
        said += ["--starts", str(options["starts"])]
    for option, names in (("profile", "profiles"), ("hold", "hold"), ("also", "also")):
        said += [word for name in options[names] for word in (f"--{option}", name)]
    said += [word for group in options["together"] for word in ("--together", ",".join(group))]
    if options["seed"] != 1:
        said += ["--seed", str(options["seed"])]
    return said


def to_dict(fit: Fitted, tables: Mapping[str, Tabled] | None = None) -> dict[str, Any]:
    """Everything about a fit but its curves, for JSON."""
    from forklift import __version__

    tables = fit.machine.tables(fit.values) if tables is None else tables
    names = [unknown.name for unknown in fit.unknowns]
    return {
        "schema": 2,
        "forklift": __version__,
        "campaign": dict(fit.origin.facts),
        **fit.machine.facts(),
        **fit.machine.facts_of(fit.values, fit.sources, fit.title),
        "options": dict(fit.options),
        "command": command(fit),
        "seconds": fit.seconds,
        "evaluations": fit.found.evaluations,
        "interrupted": fit.interrupted,
        "complete": fit.complete,
        "verdict": list(words.sentences(fit)),
        "parameters": json_rows(fit_tables.parameters(fit)),
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
        "validation": {channel: json_rows(fit.validation(channel)) for _, channel in fit.after.headlines},
        "fits": json_rows(fit_tables.fits(fit)),
        "tables": {file: dict(table.facts()) for file, table in tables.items()},
    }


def _judged(found: ChannelResidual) -> dict[str, Any]:
    return {
        "file": found.file,
        "role": found.role,
        "group": found.group,
        "channel": found.channel,
        "samples": found.samples,
        "mean_square": found.mean_square,
        "whiteness": None if found.whiteness is None else defined(found.whiteness),
        "explained": found.explained,
    }


def write(fit: Fitted, out: str | Path) -> Path:
    """See `Fit.write`."""
    tables = fit.machine.tables(fit.values)
    with output.folder(out, earlier(out), MARK) as temporary:
        fit.machine.write(temporary, fit.values, fit.sources, fit.title)
        fit.after.agreement.write(temporary, "baseline")
        fit_tables.fits(fit).write_csv(temporary / "fit.csv")
        fit_tables.parameters(fit).write_csv(temporary / "parameters.csv")
        for file, table in tables.items():
            table.write(temporary / file)
        text = json.dumps(to_dict(fit, tables), indent=1, ensure_ascii=False, allow_nan=False)
        (temporary / MARK).write_text(text + "\n", encoding="utf-8", newline="\n")
        (temporary / PAGE).write_text(present.page(fit), encoding="utf-8", newline="\n")
    return Path(out)


def earlier(out: str | Path) -> frozenset[str]:
    """The files of the earlier fit that stands in `out`; none if there is none."""
    return earlier_files(out, MARK, _files)


def _files(recordings: Sequence[str]) -> frozenset[str]:
    """All that `write` may make of these recordings."""
    tables = [f"speed_table_{part}.csv" for part in ("free", "main")]
    own = {MARK, PAGE, *MODELS, "fit.csv", "parameters.csv"}
    return frozenset({*own, *tables, *prediction_files(recordings)})
