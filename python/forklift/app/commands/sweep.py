"""`forklift sweep`: thousands of varied trucks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json
from forklift.app.terminal import print_json, say_written, sweeping

EXAMPLE = "Example: forklift sweep examples/sweep.toml --out swept"


def sweep(
    spec: Annotated[Path, typer.Argument(help="The sweep's TOML file: what varies and what is asked.")],
    out: Annotated[
        Path,
        typer.Option(
            "--out", help="Folder for members, result.json and report.html; part of a sweep goes on."
        ),
    ],
    threads: Annotated[int, typer.Option("--threads", min=0, help="Threads; 0 takes all.")] = 0,
    scheduler: Annotated[
        str | None, typer.Option("--scheduler", help="Address of a Dask scheduler that runs the chunks.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Lower thousands of varied trucks and tell how many fail what is asked, where, and how surely."""
    from forklift.base import output, present
    from forklift.base.result_files import PAGE
    from forklift.ensemble.sweep import sweep as verb

    with sweeping() as progress:
        result = verb(spec, out=out, threads=threads, scheduler=scheduler, progress=progress)
    output.write_text(out / PAGE, present.page(result))
    if as_json:
        print_json(result.to_dict())
        return
    typer.echo(str(result))
    say_written(out / PAGE, out / "result.json", out / "members")
