"""Options that several commands have, and the statuses they end with."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from forklift.base.errors import ForkliftError

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
THESIS = "thesis"
TruckName = Annotated[
    str | None,
    typer.Option(
        "--truck",
        help="A shipped truck's name, or the path of a truck's TOML file.",
        show_default=THESIS,
    ),
]
"""None where the call names none, which is `THESIS`."""


def not_beside(machine: Path, **given: object) -> None:
    """None of these is given: they are of a truck, and there is a machine of one's own.

    Raises
    ------
    ForkliftError
        ``"option-not-wanted"``.
    """
    for name, value in given.items():
        if value is not None:
            raise ForkliftError(
                "option-not-wanted",
                f"--{name} is of a truck, and {machine} is a machine of your own; leave the option out",
                name=f"--{name}",
            )


def no_meaning(where: str, **given: object) -> None:
    """None of these options is given where it has no meaning, such as "beside --score-open".

    Raises
    ------
    ForkliftError
        ``"option-not-wanted"``.
    """
    for name, value in given.items():
        if value is not None and value is not False:
            option = f"--{name.replace('_', '-')}"
            raise ForkliftError(
                "option-not-wanted", f"{option} has no meaning {where}; leave the option out", name=option
            )
