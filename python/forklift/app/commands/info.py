"""`forklift info`: what a campaign, a log, a truck or the program itself holds."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from forklift.app.options import Json
from forklift.app.terminal import print_json, print_tables, say_written
from forklift.base.errors import ForkliftError
from forklift.recordings.channels import channels as known_channels

EXAMPLE = "Example: forklift info thesis"


def info(
    what: Annotated[
        str | None,
        typer.Argument(help="A campaign's folder, a log, a shipped truck's name or a truck's file."),
    ] = None,
    dbc: Annotated[
        list[Path] | None, typer.Option("--dbc", help="What the frames of a CAN log hold; may be repeated.")
    ] = None,
    write: Annotated[
        Path | None, typer.Option("--write", help="Write the proposed [channels] to a .toml file.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Tell what a campaign, a log or a truck holds; of nothing: version, trucks, effects and parameters.

    Of a log: every signal with its clock, unit, range and course, and the [channels] it proposes.
    """
    from forklift.recordings.formats import SUFFIXES
    from forklift.report import tables

    log = what is not None and Path(what).suffix.lower() in SUFFIXES and not Path(what).is_dir()
    for name, value in (("--dbc", dbc), ("--write", write)):
        if value and not log:
            raise ForkliftError(
                "option-not-wanted",
                f"{name} is of a log, as recorded; leave the option out, or name a log's file",
                name=name,
            )
    if what is None:
        print_json(_about()) if as_json else _print_about()
    elif Path(what).is_dir() or Path(what).name == "campaign.toml":
        from forklift.recordings.campaign import Campaign

        campaign = Campaign.read(what)
        print_json(campaign.to_dict()) if as_json else print_tables(tables.campaign_table(campaign))
    elif log:
        from forklift.base import output, toml
        from forklift.recordings.formats import check_dbc
        from forklift.recordings.inspect import inspect

        if dbc:
            check_dbc([Path(what).name])
        if write:
            output.check_file(write)
            output.check_suffix(write, (".toml",))
        found = inspect(what, dbc=dbc or ())
        head = f"dbc = {toml.written([os.path.abspath(one) for one in dbc])}\n\n" if dbc else ""
        if write:
            output.write_text(write, head + found.mapping())
        if as_json:
            print_json(found.to_dict() | {"written": [str(write)] if write else []})
            return
        print_tables(tables.log_table(found))
        for name, said in found.passed.items():
            typer.echo(f"{name} is {said}, and no signal: it is passed over")
        typer.echo(found.mapping())
        if write:
            say_written(write)
    else:
        from forklift.plant.forklift.truck import Truck

        truck = Truck.read(what)
        print_json(truck.to_dict()) if as_json else print_tables(tables.listed(truck.listing()))


def _about() -> dict[str, Any]:
    from forklift import __version__, _core
    from forklift.plant.forklift import tables as names
    from forklift.plant.forklift.truck import shipped

    return {
        "version": __version__,
        "trucks": list(shipped()),
        "effects": _core.effect_table(),
        "parameters": _core.parameter_table(),
        "states": list(names.states().values()),
        "outputs": list(names.outputs().values()),
        "channels": list(known_channels().values()),
    }


def _print_about() -> None:
    from forklift import __version__
    from forklift.plant.forklift.tables import effect_listing, parameter_listing
    from forklift.plant.forklift.truck import shipped
    from forklift.report import tables

    typer.echo(f"forklift {__version__}; trucks that ship with it: {', '.join(shipped())}")
    print_tables(tables.listed(effect_listing()), tables.listed(parameter_listing()))
