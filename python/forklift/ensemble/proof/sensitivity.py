"""What halving and doubling each bound of the diagnosis does to its score, on development seeds only."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from forklift.base import output
from forklift.base.errors import ForkliftError
from forklift.ensemble.proof.bounds import VARIABLE, bounds
from forklift.ensemble.proof.prove import LIMIT_S, prove
from forklift.ensemble.proof.random import DEVELOPMENT

FACTORS = (0.5, 2.0)
TOLD = ("all right", "kind of fault", "location", "cause, or a tie that holds it", "false alarms")
TABLE = "sensitivity.json"


def sensitivity(
    seed: int,
    campaigns: int,
    out: str | Path,
    *,
    only: str | None = None,
    jobs: int = 1,
    limit_s: float = LIMIT_S,
    progress: Callable[[str], None] = lambda line: None,
) -> list[dict[str, Any]]:
    """The score as it is, then with each bound halved and doubled: a row each, as in ``sensitivity.json``.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for a reporting seed; those of `prove`.
    """
    if seed >= DEVELOPMENT:
        raise ForkliftError(
            "argument-invalid",
            f"seed is {seed}, but bounds are only ever moved on seeds below {DEVELOPMENT}; "
            "choose one of those",
            name="seed",
            value=seed,
            upper=DEVELOPMENT - 1,
        )
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    rows: list[dict[str, Any]] = []

    def run(name: str, value: float | None, factor: float) -> None:
        folder = out / (f"{name}-{factor:g}" if name else "as it is")
        given = {} if value is None else {VARIABLE: json.dumps({name: value * factor})}
        progress(f"{name or 'as it is'} {'' if value is None else f'x {factor:g}'}")
        found = prove(
            seed, campaigns, folder, only=only, jobs=jobs, limit_s=limit_s, environment=given,
            progress=progress,
            judge_hidden=True,
        )  # fmt: skip
        rows.append(
            {"bound": name, "value": value, "factor": factor}
            | {key: found.score["rates"][key]["share"] for key in TOLD}
        )
        output.write_text(out / TABLE, json.dumps(rows, indent=1) + "\n")

    run("", None, 1.0)
    for name, value in bounds().items():
        for factor in FACTORS:
            run(name, value, factor)
    return rows


def text(rows: list[dict[str, Any]]) -> str:
    """The table as Markdown."""
    lines = ["| bound | value | " + " | ".join(TOLD) + " |", "|---|---:|" + "---:|" * len(TOLD)]
    for row in rows:
        name = row["bound"] or "as it is"
        value = "" if row["value"] is None else f"{row['value'] * row['factor']:g}"
        cells = " | ".join("–" if row[key] is None else f"{100 * row[key]:.0f} %" for key in TOLD)
        lines.append(f"| {name} | {value} | {cells} |")
    return "\n".join(lines)
