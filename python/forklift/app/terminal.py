"""What a command shows on the terminal: tables, what it wrote, and signs of life while it runs.

Results go to stdout, as tables with colours on a terminal and plain in a pipe; signs of life to stderr, and
only to a terminal but for a diagnosis, which takes minutes.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

if TYPE_CHECKING:
    from rich.console import RenderableType

    from forklift.control.tune import Progress as Tuning
    from forklift.diagnosis.progress import Progress as Diagnosing
    from forklift.ensemble.rare import Progress as RareProgress
    from forklift.ensemble.sweep import Progress as SweepProgress
    from forklift.fitting.fit import Progress
    from forklift.plant.findings import Caution


Now = TypeVar("Now")
"""How far a piece of work is."""


def print_json(value: Any) -> None:
    typer.echo(json.dumps(value, indent=1, ensure_ascii=False))


def print_tables(*tables: RenderableType) -> None:
    from forklift.report.tables import plain

    if sys.stdout.isatty():
        from rich.console import Console

        Console().print(*tables, sep="\n")
    else:
        for table in tables:
            typer.echo(f"\n{plain(table)}")


def say_written(*paths: Path) -> None:
    for path in paths:
        typer.echo(f"Written: {path}")


@contextmanager
def counting(what: str, total: int) -> Iterator[Callable[[], None]]:
    """A bar on a terminal, gone when it is done; nothing in a pipe."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda: bar.advance(task)


@contextmanager
def _bar(
    what: str, told: Callable[[Now], tuple[float, float, str]], *, width: int = 20
) -> Iterator[Callable[[Now], None] | None]:
    """A bar on a terminal: `told` makes how much, of how much, and what of each progress; None in a pipe."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=width),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)

        def update(now: Now) -> None:
            done, total, said = told(now)
            bar.update(task, total=total, completed=done, description=said)

        yield update


def searching() -> AbstractContextManager[Callable[[Progress], None] | None]:
    """How far a fit is."""

    def told(now: Progress) -> tuple[float, float, str]:
        where = now.profile or f"start {now.start + 1}/{now.starts} stage {now.stage}/{now.stages}"
        said = f"{where}: cost {now.cost:.5g}, misfit {now.misfit:.3g} x noise"
        return now.start * now.stages + now.stage - 1, now.starts * now.stages, said

    return _bar("Reading what the recordings support", told, width=10)


def tuning() -> AbstractContextManager[Callable[[Tuning], None] | None]:
    """How far the search of a controller is."""

    def told(now: Tuning) -> tuple[float, float, str]:
        said = f"{now.lift} lift, generation {now.generation} of {now.generations}, cost {now.cost:.5g}"
        return now.generation, now.generations, said

    return _bar("Setting up the pressure's feedback", told)


def sweeping() -> AbstractContextManager[Callable[[SweepProgress], None] | None]:
    """How far a sweep is, how fast, and what failed so far."""

    def told(now: SweepProgress) -> tuple[float, float, str]:
        said = f"{now.done} of {now.members}, {now.rate:.0f} a second, {now.failures} fail"
        if now.interval:
            said += f" ({100 * now.interval.lower:.2g} to {100 * now.interval.upper:.2g} %)"
        return now.done, now.members, said

    return _bar("Drawing members", told)


def running() -> AbstractContextManager[Callable[[RareProgress], None] | None]:
    """How many runs of subset simulation are over."""

    def told(now: RareProgress) -> tuple[float, float, str]:
        said = "Searching the worst case" if now.run == now.runs else "Running levels of members"
        return now.run, now.runs, f"{said}, {now.run} of {now.runs} runs over"

    return _bar("Running levels of members", told)


@contextmanager
def telling() -> Iterator[Callable[[Diagnosing], None]]:
    """How far a diagnosis is; in a pipe a line a stage, and a line a trial."""
    if not sys.stderr.isatty():
        yield _lines()
        return
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("Reading what the recordings support", total=None)
        yield lambda now: bar.update(task, description=str(now))


def _lines() -> Callable[[Diagnosing], None]:
    told: list[tuple[str, int]] = []

    def tell(now: Diagnosing) -> None:
        if (now.stage, now.trial) not in told:
            told.append((now.stage, now.trial))
            print(now, file=sys.stderr, flush=True)

    return tell


@contextmanager
def busy(what: str) -> Iterator[Callable[[], AbstractContextManager[None]]]:
    """A sign of life on a terminal while nothing can be counted; nothing in a pipe.

    It is silent within the context that it gives, in which the user may be asked.
    """
    if not sys.stderr.isatty():
        yield nullcontext
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:

        @contextmanager
        def silent() -> Iterator[None]:
            status.stop()
            yield
            status.start()

        yield silent


def say_findings(found: Iterable[Caution]) -> None:
    """What is wrong with recordings, a line each, before all that is made of them."""
    for one in found:
        typer.echo(f"Check [{one.code}]: {one.sentence}.")
