"""`forklift demo`: a truck that conceals something, recorded and found."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json
from forklift.app.terminal import counting, print_json, telling

EXAMPLE = "Example: forklift demo demo"


def demo(
    out: Annotated[
        Path, typer.Argument(help="A new folder, or an earlier demonstration, which is replaced.")
    ] = Path("demo"),
    as_json: Json = False,
) -> None:
    """Record a truck that conceals something, and find it: locate, name, model, improve."""
    from forklift.app.demo import RECORDINGS
    from forklift.app.demo import demo as verb
    from forklift.base.result_files import PAGE

    with counting("Recording and replaying", 2 * len(RECORDINGS)) as step, telling() as told:
        found = verb(out, progress=step, say=told)
    if as_json:
        print_json(found.to_dict())
        return
    campaign, page = out / "campaign", out / "compare" / PAGE
    truth = out / "truth.toml"
    typer.echo(f"{campaign} holds {len(RECORDINGS)} recordings of a simulated truck, {truth}.")
    typer.echo(f"How far the thesis's truck is from them: look at {page} in a browser.")
    typer.echo("")
    typer.echo(str(found))
    typer.echo("")
    typer.echo(
        f"All of it is in {out / 'found'}: look at {out / 'found' / 'report.html'}; "
        f"{out / 'found' / 'truck.toml'} is the truck with what was found."
    )
    typer.echo(f"The same again: forklift diagnose {campaign} --truck thesis --out {out / 'found'}")
