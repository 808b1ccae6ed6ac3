"""`forklift replay`: one member of a sweep again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json
from forklift.app.terminal import print_json, say_written

EXAMPLE = "Example: forklift replay swept 4711 --out member.csv"


def replay(
    folder: Annotated[Path, typer.Argument(help="A sweep's folder.")],
    member: Annotated[int, typer.Argument(min=0, help="The member's index.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write its trajectory: a .csv or .parquet file.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run one member of a sweep again, to the bit, and show what it does."""
    from forklift.base import output
    from forklift.ensemble.sweep import of_folder
    from forklift.ensemble.sweep import replay as verb

    if out:
        output.check_file(out)
        output.check_suffix(out, (".csv", ".parquet"))
    found = verb(*of_folder(folder), member)
    if out:
        found.write(out)
    if as_json:
        print_json(found.to_dict())
        return
    typer.echo(str(found))
    if out:
        say_written(out)
