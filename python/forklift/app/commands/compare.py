"""`forklift compare`: a truck beside a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.machines import asked_for
from forklift.app.options import Json, Machine, TruckName
from forklift.app.terminal import counting, print_json, print_tables, say_findings, say_written

EXAMPLE = "Example: forklift compare campaign --truck thesis --out result"


def compare(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    truck: TruckName = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder to write predictions, fit.csv, compare.json and report.html to."),
    ] = None,
    machine: Machine = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Replay every recording of a campaign on a truck, or a machine of your own: how well it fits."""
    from forklift import compare as verb
    from forklift.base import output
    from forklift.base.result_files import PAGE, earlier_files
    from forklift.fitting.compare import MARK, result_files
    from forklift.report import tables

    if out:
        output.check_folder(out, earlier_files(out, MARK, result_files), MARK)
    chosen, found, conditions = asked_for(campaign, truck, machine, temperature)
    with counting("Replaying recordings", len(found.recordings)) as step:
        result = verb(chosen, found, progress=lambda _: step(), **conditions)
    if out:
        result.write(out)
    told = result.machine.cautions(found.recordings)
    if as_json:
        print_json(result.to_dict() | {"findings": [one.to_dict() for one in told]})
        return
    say_findings(told)
    for sentence in result.sentences:
        typer.echo(sentence)
    print_tables(*tables.comparison_tables(result))
    if out:
        say_written(out / PAGE, out / "fit.csv", out / "predictions")
