"""`forklift compare`: a truck beside a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json, TruckName
from forklift.app.terminal import counting, print_json, print_tables, say_findings, say_written

EXAMPLE = "Example: forklift compare campaign --truck thesis --out result"


def compare(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    truck: TruckName = "thesis",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder to write predictions, fit.csv, compare.json and report.html to."),
    ] = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Replay every recording of a campaign on a truck and tell how well it fits."""
    from forklift import compare as verb
    from forklift.base import output
    from forklift.base.result_files import PAGE, earlier_files
    from forklift.fitting.compare import MARK, result_files
    from forklift.plant.forklift.checks.faults import findings
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.campaign import Campaign
    from forklift.report import tables

    if out:
        output.check_folder(out, earlier_files(out, MARK, result_files), MARK)
    chosen = Truck.read(truck)
    found = Campaign.read(campaign)
    with counting("Replaying recordings", len(found.recordings)) as step:
        result = verb(found, chosen, oil_temperature_degc=temperature, progress=lambda _: step())
    if out:
        result.write(out)
    told = findings(found.recordings, chosen)
    if as_json:
        print_json(result.to_dict() | {"findings": [one.to_dict() for one in told]})
        return
    say_findings(told)
    for sentence in result.verdict:
        typer.echo(sentence)
    print_tables(*tables.comparison_tables(result))
    if out:
        say_written(out / PAGE, out / "fit.csv", out / "predictions")
