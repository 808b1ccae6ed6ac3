"""`forklift rare`: failures too rare to count, and the worst case."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json
from forklift.app.terminal import print_json, running, say_written

EXAMPLE = "Example: forklift rare examples/sweep.toml --out rare"


def rare(
    spec: Annotated[Path, typer.Argument(help="The sweep's TOML file: what varies and what is asked.")],
    members: Annotated[int, typer.Option("--members", min=100, help="Members of a level.")] = 1000,
    runs: Annotated[int, typer.Option("--runs", min=2, help="Independent runs.")] = 10,
    generations: Annotated[
        int, typer.Option("--generations", min=1, help="Of the search for the worst case.")
    ] = 40,
    within: Annotated[
        float, typer.Option("--within", help="How far it goes, in standard deviations of each quantity.")
    ] = 3.0,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for rare.json, and the lowerings likeliest.csv and worst.csv."),
    ] = None,
    threads: Annotated[int, typer.Option("--threads", min=0, help="Threads; 0 takes all.")] = 0,
    as_json: Json = False,
) -> None:
    """Tell how rarely a member of a sweep fails where counting finds too few, and search the worst case."""
    from forklift.base import output
    from forklift.ensemble.rare import FILES, RESULT
    from forklift.ensemble.rare import rare as verb

    if out:
        output.check_folder(out, FILES, RESULT)
    with running() as progress:
        found = verb(
            spec,
            threads=threads,
            members=members,
            runs=runs,
            generations=generations,
            within=within,
            progress=progress,
        )
    if out:
        found.write(out)
    if as_json:
        print_json(found.to_dict())
        return
    typer.echo(str(found))
    if out:
        say_written(*(out / name for name in FILES if (out / name).is_file()))
