"""Options that several commands have, and the statuses they end with."""

from __future__ import annotations

from enum import StrEnum
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


Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for a script.")]
TruckName = Annotated[
    str, typer.Option("--truck", help="A shipped truck's name, or the path of a truck's TOML file.")
]
