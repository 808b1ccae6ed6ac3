"""`forklift fit`: a truck to a campaign."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from forklift.app import interruption
from forklift.app.machines import asked_for
from forklift.app.options import Json, Machine, TruckName
from forklift.app.terminal import print_json, print_tables, say_written, searching

EXAMPLE = "Example: forklift fit campaign --truck thesis --out fitted"


def fit(
    campaign: Annotated[Path, typer.Argument(help="The campaign's folder, with its campaign.toml.")],
    out: Annotated[
        Path, typer.Option("--out", help="Folder to write truck.toml, report.html, fit.json and tables to.")
    ],
    truck: TruckName = None,
    starts: Annotated[
        int | None,
        typer.Option("--starts", min=1, help="Searches; else one, and three if that leaves something over."),
    ] = None,
    profile: Annotated[
        list[str] | None,
        typer.Option("--profile", help="A parameter whose profile likelihood is wanted; may be repeated."),
    ] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option("--hold", help="A parameter to leave as the truck has it; may be repeated."),
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option("--also", help="A parameter to estimate besides the thesis's; may be repeated."),
    ] = None,
    together: Annotated[
        list[str] | None,
        typer.Option("--together", help="NAME,NAME,..: parameters that move together; may be repeated."),
    ] = None,
    load_width: Annotated[
        float, typer.Option("--load-width", help="Standard deviation of the entered loads [kg].")
    ] = 0.0,
    machine: Machine = None,
    temperature: Annotated[
        float | None, typer.Option("--temperature", help="Oil temperature [°C] of recordings without one.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the scattered starts.")] = 1,
    as_json: Json = False,
) -> None:
    """Fit a truck, or a machine of your own, to a campaign, judged on what is held out; Ctrl-C keeps it."""
    from forklift import fit as verb
    from forklift.base import output
    from forklift.base.result_files import PAGE
    from forklift.fitting import files as fit_files
    from forklift.report import tables

    output.check_folder(out, fit_files.earlier(out), fit_files.MARK)
    chosen, found, conditions = asked_for(campaign, truck, machine, temperature)
    conditions |= {"load_width_kg": load_width} if load_width else {}
    with searching() as progress:
        result = verb(
            chosen,
            found,
            hold=hold or (),
            also=also or (),
            together=[group.split(",") for group in together or ()],
            starts=starts,
            profiles=profile or (),
            seed=seed,
            progress=progress,
            **conditions,
        )
    result.write(out)
    if as_json:
        print_json(result.to_dict())
    else:
        for sentence in result.sentences:
            typer.echo(sentence)
        print_tables(*tables.fit_tables(result))
        say_written(*(out / name for name in (PAGE, result.machine.file, fit_files.MARK)))
    if result.interrupted:
        noun = result.machine.words.noun
        print(f"forklift: interrupted; the best {noun} so far is in {out}.", file=sys.stderr)
        raise typer.Exit(interruption.status())
