"""The controller as C99 for the ECU: what the files are, and the folder they are written to."""

from __future__ import annotations

import re
from pathlib import Path

from forklift.base import output
from forklift.base.errors import ForkliftError
from forklift.control.controller import Controller

FILES = (
    "forklift_control.h",
    "forklift_control.c",
    "forklift_control_test.c",
    "forklift_control_eva.c",
    "forklift_control_helpers.c",
    "controller.toml",
)
"""Header, source, a self-checking test from random states, what Frama-C's Eva analyses it with, a test of its
helpers over all their arguments, the settings."""


def sources(controller: Controller) -> dict[str, str]:
    """The C files by name.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` for a controller whose name is no plain word: it stands in a comment of the C.
    """
    if not re.fullmatch(r"[A-Za-z0-9 _.-]{1,60}", controller.name):
        raise ForkliftError(
            "argument-invalid",
            f"the controller's name is {controller.name!r}; "
            "give one of up to 60 plain letters, digits, space, _ . -",
            name="name",
        )
    return dict(zip(FILES, controller.core.c_sources(controller.name), strict=False))


def export_c(controller: Controller, folder: str | Path) -> Path:
    """Write the C files and the controller's settings into a folder; whole or not at all.

    Returns
    -------
    Path
        The folder, with the files of `FILES`.

    Raises
    ------
    ForkliftError
        As `sources`; ``"not-writable"`` or ``"output-exists"`` for a folder that holds anything else.
    """
    files = sources(controller)
    with output.folder(folder, FILES, FILES[0]) as new:
        for name, text in files.items():
            (new / name).write_text(text, encoding="utf-8", newline="\n")
        controller.write(new / FILES[-1])
    return Path(folder)


def range_table(controller: Controller) -> str:
    """The range of every variable in the unit it stands for, before and after saturation, and where that
    can act."""
    lines = [f"{'lift':<6}{'variable':<15}{'reaches':>28}{'is kept in':>28} unit    saturates"]
    for row in controller.core.ranges():
        one = 2.0 ** row["scale"]
        shown = ["{:.6g} .. {:.6g}".format(*(end / one for end in row[key])) for key in ("reach", "kept")]
        lines.append(
            f"{row['lift'] or 'both':<6}{row['variable']:<15}{shown[0]:>28}{shown[1]:>28} {row['unit']:<8}"
            + ("yes" if row["saturates"] else "no")
        )
    lines.append(f"widest product or sum: {controller.core.widest} of 64 bits")
    return "\n".join(lines)
