"""What a page was made from, and how to make it again."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from forklift.base.typeset import counted
from forklift.report.blocks import Block, Code, Section, Table
from forklift.report.words import capital

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from forklift.fitting.origin import Origin
    from forklift.plant.subject import Subject

PACKAGES = ("numpy", "scipy", "polars", "plotly")
ORIGINS = {"shipped": "shipped with forklift", "Python": "made in Python"}


def provenance(
    origin: Origin,
    machine: Subject,
    facts: Mapping[str, Any],
    recordings: Sequence[Any],
    command: str | None,
    more: Sequence[Block] = (),
) -> Section:
    """Hashes, versions and the command; `facts` of the machine as it started and came out."""
    title = capital(origin.title)
    of = counted(len(recordings), "recording")
    made = [[title if of in title else f"{title}, {of}", origin.sha256]]
    made += [
        [f"{part}: “{one['name']}”, {ORIGINS.get(one['origin'], one['origin'])}", one["sha256"]]
        for part, one in (("Start", facts.get("start")), ("Fitted", facts.get(machine.words.noun)))
        if one and "sha256" in one
    ]
    again: list[Block] = [Code("The same again", command)] if command else []
    rows = [[one.file, one.role, one.sha256] for one in recordings]
    first = [*again, Table("Made from", ["What", "SHA-256"], made, [False, False])]
    return made_from(machine.runs, first, rows, more)


def made_from(
    lead: str, first: Sequence[Block], recordings: Sequence[Sequence[str]], more: Sequence[Block] = ()
) -> Section:
    """What it was made from, each recording's name, role and hash, and the versions."""
    from forklift import __version__

    used = {"forklift": __version__, "Python": platform.python_version()} | {
        name: found for name in PACKAGES if (found := _version(name))
    }
    return Section(
        "provenance",
        "Provenance",
        lead,
        [
            *first,
            Table("Recordings", ["File", "Role", "SHA-256"], recordings, [False, False, False], folded=True),
            Table("Made with", ["Program", "Version"], [[*row] for row in used.items()], [False, False]),
            *more,
        ],
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
