"""`forklift truck new`: the file of a truck of your own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json
from forklift.app.terminal import print_json, say_written
from forklift.base.errors import ForkliftError

EXAMPLE = (
    'Example: forklift truck new mine --set "free.bore=55 mm # data sheet" '
    '--set "free.mass.moving=310 kg" '
    "--out mine.toml"
)
truck = typer.Typer(no_args_is_help=True, help="Make a truck of your own.")


@truck.command(epilog=EXAMPLE)
def new(
    name: Annotated[str, typer.Argument(help="The truck's name.")],
    out: Annotated[Path, typer.Option("--out", help="The .toml file to write.")],
    told: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="PARAMETER=VALUE UNIT # SOURCE, as forklift info lists the parameters; LIFT.bore and "
            "LIFT.cylinders stand for the area, LIFT.valve.points=0.36:0,0.5:2e-6 for the area table; may be "
            "repeated.",
        ),
    ] = None,
    base: Annotated[
        str, typer.Option("--from", help="The truck that everything else is taken from.")
    ] = "thesis",
    as_json: Json = False,
) -> None:
    """Write the file of a truck of your own: what you know of it, over another truck for the rest.

    In a terminal it asks for what a data sheet tells and no option told.
    """
    from forklift.base import output
    from forklift.plant.forklift.new_truck import ASKED, check_name, new_truck, still_of
    from forklift.plant.forklift.tables import parameters
    from forklift.plant.forklift.truck import Truck

    check_name(name)
    if output.check_file(out).exists():
        raise ForkliftError(
            "output-exists",
            f"{out} is there, and what it tells would be lost; name another file (--from {out} goes on from "
            "what it tells)",
            file=str(out),
        )
    output.check_suffix(out, (".toml",))
    start = Truck.read(base)
    known: dict[str, str] = {}
    for text in told or ():
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise ForkliftError(
                "argument-invalid",
                f"--set {text!r} is not PARAMETER=VALUE; write it like free.mass.moving=310 kg",
                name="set",
                value=text,
            )
        known[key.strip()] = value.strip()
    if sys.stdin.isatty() and sys.stderr.isatty():
        for key in (f"{lift}.{one}" for lift in ("free", "main") for one in ASKED):
            if key in known or (key.endswith(".area") and f"{key.split('.')[0]}.bore" in known):
                continue
            spec = parameters()[key]
            value = typer.prompt(
                f"{key}: {spec['meaning']} [{spec['unit']}], # and its source; empty: as {start.name}",
                default="", show_default=False, err=True,
            )  # fmt: skip
            if value.strip():
                known[key] = value
    made = new_truck(name, known, start)
    written = made.write(out)
    left = still_of(made, start)
    if as_json:
        print_json(made.to_dict() | {"written": [str(written)], "as_before": left})
        return
    if left:
        typer.echo(f"As {start.name}, though a data sheet would tell them: {', '.join(left)}.")
    say_written(written)
