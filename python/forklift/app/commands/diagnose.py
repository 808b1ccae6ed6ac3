"""`forklift diagnose`: what a truck, or a machine of your own, lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.interruption import keeping
from forklift.app.machines import asked_for
from forklift.app.options import Json, Machine, TruckName
from forklift.app.terminal import print_json, say_written, telling

EXAMPLE = "Example: forklift diagnose campaign --truck thesis --out found"


def diagnose(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    out: Annotated[
        Path,
        typer.Option(
            "--out", help="Folder to write report.html, truck.toml, diagnosis.json and predictions to."
        ),
    ],
    truck: TruckName = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    machine: Machine = None,
    as_json: Json = False,
) -> None:
    """Find where model and recordings part, name what is missing, and show what the model gains by it.

    Ctrl-C keeps what was computed: the same command goes on from there.
    """
    from forklift import diagnose as verb
    from forklift.base.result_files import PAGE
    from forklift.diagnosis import files as diagnosis_files
    from forklift.diagnosis.unfinished import FOLDER

    diagnosis_files.check(out)
    chosen, found, conditions = asked_for(campaign, truck, machine, temperature)
    with keeping(out / FOLDER, "the same command"):
        with telling() as progress:
            result = verb(chosen, found, out=out, progress=progress, **conditions)
        result.write(out)
    if as_json:
        print_json(result.to_dict())
    else:
        typer.echo(str(result))
        say_written(out / PAGE, out / result.machine.file, out / diagnosis_files.MARK)
