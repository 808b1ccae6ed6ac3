"""`forklift prove`: the diagnosis on sealed campaigns."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from forklift.app.options import Json, no_meaning
from forklift.app.terminal import print_json, say_written

EXAMPLE = "Example: forklift prove --seed 7 --campaigns 20 --out proof --jobs 2"
SEED, CAMPAIGNS = 1, 20
"""Unless told."""


def prove(
    out: Annotated[Path, typer.Option("--out", help="Folder of the proof; the same call goes on in it.")],
    seed: Annotated[
        int | None,
        typer.Option(
            "--seed",
            min=0,
            help="Below 1,000,000: for development; above: to be told, used once.",
            show_default=str(SEED),
        ),
    ] = None,
    campaigns: Annotated[
        int | None,
        typer.Option("--campaigns", min=1, help="How many to draw.", show_default=str(CAMPAIGNS)),
    ] = None,
    only: Annotated[
        str | None,
        typer.Option("--only", help="Kinds or ids of what is concealed, by commas; others are skipped."),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option("--jobs", min=1, help="Campaigns side by side.", show_default="1")
    ] = None,
    keep: Annotated[bool, typer.Option("--keep", help="Keep campaigns, diagnoses and truth.")] = False,
    limit: Annotated[float, typer.Option("--limit", help="Longest time for a diagnosis [s].")] = 3600.0,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Halve and double each bound that decides an answer.")
    ] = False,
    score_open: Annotated[
        Path | None,
        typer.Option("--score-open", help="Score this folder of open campaigns instead of drawing."),
    ] = None,
    answers: Annotated[
        Path | None,
        typer.Option("--answers", help="Answer file of the open campaigns, else FOLDER/answers.json."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Prove the diagnosis on sealed campaigns of an independent plant with concealed physics."""
    from forklift.base import output
    from forklift.base.result_files import PAGE
    from forklift.ensemble.proof import open as opened
    from forklift.ensemble.proof import prove as proof
    from forklift.ensemble.proof import sensitivity as bounds
    from forklift.report.of_proof import proof_page, proof_text

    def say(line: str) -> None:
        typer.echo(line, err=as_json)

    if not score_open:
        no_meaning("without --score-open, whose answers it names", answers=answers)
    if sensitivity:
        no_meaning("beside --sensitivity", score_open=score_open, keep=keep)
    if score_open:
        drawn = {"seed": seed, "campaigns": campaigns, "jobs": jobs, "keep": keep}
        no_meaning("beside --score-open, which draws nothing", **drawn)
    seed, campaigns, jobs = SEED if seed is None else seed, campaigns or CAMPAIGNS, jobs or 1
    if sensitivity:
        rows = bounds.sensitivity(seed, campaigns, out, only=only, jobs=jobs, limit_s=limit, progress=say)
        print_json(rows) if as_json else say(bounds.text(rows))
        return
    if score_open:
        found = opened.score_open(score_open, out, answers=answers, only=only, limit_s=limit, progress=say)
    else:
        found = proof.prove(
            seed, campaigns, out, only=only, jobs=jobs, keep=keep, limit_s=limit, progress=say
        )
    page = output.write_text(out / PAGE, proof_page(found))
    if as_json:
        print_json(found.score)
    else:
        typer.echo(proof_text(found))
        say_written(page, out / proof.SCORE)
