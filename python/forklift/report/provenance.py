"""What a page was made from, and how to make it again."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING

from forklift.report.blocks import Block, Code, Section, Table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from forklift.campaign import Campaign
    from forklift.truck import Truck

PACKAGES = ("numpy", "scipy", "polars", "plotly")
FREE_RUN = (
    "Simulations run free from the start of each recording: no state is corrected by a measurement. "
    "Velocities are the derivative of the fork height, or of the lift's own encoder, through a "
    "Savitzky–Golay filter of 11 samples and second order, measured and simulated alike."
)


def provenance(
    campaign: Campaign, trucks: Mapping[str, Truck], command: str | None, more: Sequence[Block] = ()
) -> Section:
    """Hashes, versions and the command; `trucks` by the part they play."""
    from forklift import __version__

    made = [
        [f"Campaign {campaign.name}, {len(campaign.recordings)} recordings", campaign.sha256],
        *([f"{part}: {truck.name} ({truck.origin})", truck.sha256] for part, truck in trucks.items()),
    ]
    used = {"forklift": __version__, "Python": platform.python_version()} | {
        name: found for name in PACKAGES if (found := _version(name))
    }
    again: list[Block] = [Code("The same again", command)] if command else []
    return Section(
        "provenance",
        "Provenance",
        FREE_RUN,
        [
            *again,
            Table("Made from", ["What", "SHA-256"], made, [False, False]),
            Table(
                "Recordings",
                ["File", "Role", "SHA-256"],
                [[one.file, one.role, one.sha256] for one in campaign.recordings],
                [False, False, False],
                folded=True,
            ),
            Table("Made with", ["Program", "Version"], [[*row] for row in used.items()], [False, False]),
            *more,
        ],
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
