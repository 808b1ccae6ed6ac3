"""What a page was made from, and how to make it again."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from forklift.report.blocks import Block, Code, Section, Table
from forklift.report.words import capital

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.campaign import Campaign

PACKAGES = ("numpy", "scipy", "polars", "plotly")
ORIGINS = {"shipped": "shipped with forklift", "Python": "made in Python"}
FREE_RUN = (
    "Simulations run free from the start of each recording: no state is corrected by a measurement. "
    "Velocities are the derivative of the fork height, or of the lift's own encoder, through a "
    "Savitzky–Golay filter of 11 samples and second order, measured and simulated alike."
)


def provenance(
    campaign: Campaign, trucks: Mapping[str, Truck], command: str | None, more: Sequence[Block] = ()
) -> Section:
    """Hashes, versions and the command; `trucks` by the part they play."""
    made = [
        [f"{capital(campaign.title)}, {len(campaign.recordings)} recordings", campaign.sha256],
        *(
            [f"{part}: “{truck.name}”, {ORIGINS.get(truck.origin, truck.origin)}", truck.sha256]
            for part, truck in trucks.items()
        ),
    ]
    again: list[Block] = [Code("The same again", command)] if command else []
    recordings = [[one.file, one.role, one.sha256] for one in campaign.recordings]
    first = [*again, Table("Made from", ["What", "SHA-256"], made, [False, False])]
    return made_from(FREE_RUN, first, recordings, more)


def made_from(
    lead: str, first: Sequence[Block], recordings: Sequence[Sequence[str]], more: Sequence[Block] = ()
) -> Section:
    """Of any machine: what it was made from, each recording's name, role and hash, and the versions."""
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
