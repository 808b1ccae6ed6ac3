"""Options that several commands have, and the statuses they end with."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

REFUSED = 2
"""Exit status of a mistake in the call, its files or its numbers; also of a run that failed."""

INTERRUPTED = 130
"""Exit status after Ctrl-C (128 + SIGINT)."""


class LiftName(StrEnum):
    """Which lift, or both."""

    BOTH = "both"
    FREE = "free"
    MAIN = "main"


Machine = Annotated[
    Path | None,
    typer.Option("--machine", help="Python file with a machine = Plant(...) of yours, instead of a truck."),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for a script.")]
TruckName = Annotated[
    str, typer.Option("--truck", help="A shipped truck's name, or the path of a truck's TOML file.")
]
