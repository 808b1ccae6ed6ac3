"""Formats of recordings: one file each, and the registry that finds them by suffix.

CSV and Parquet are tables: one time column, and every column must be known. MAT and MDF4 carry many
signals, of which the wanted ones are picked, each on its own time if the file has one; CAN logs carry frames,
which a DBC decodes.
"""

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from forklift.base.errors import ForkliftError
from forklift.recordings.formats import isolation
from forklift.recordings.formats.signals import Choose, Place, Signals, unreadable


@dataclass(frozen=True)
class Format:
    """A format a recording may have.

    Attributes
    ----------
    name
        Its name, e.g. ``"csv"``.
    suffixes
        Of its files, in lower case.
    module
        The module with its ``read(place, choose)``.
    picks
        Whether names that no one asked for are passed over.
    timed
        Whether its series may bring their own time.
    isolated
        Whether a library reads it that can take the whole process down on a damaged file.
    frames
        Whether it may hold the frames of a CAN bus, which a DBC decodes.
    """

    name: str
    suffixes: tuple[str, ...]
    module: str
    picks: bool
    timed: bool
    isolated: bool
    frames: bool = False


FORMATS = (
    Format("csv", (".csv",), "forklift.recordings.formats.csv", picks=False, timed=False, isolated=False),
    Format(
        "parquet",
        (".parquet", ".pq"),
        "forklift.recordings.formats.parquet",
        picks=False,
        timed=False,
        isolated=True,
    ),
    Format("mat", (".mat",), "forklift.recordings.formats.mat", picks=True, timed=True, isolated=True),
    Format(
        "mdf4",
        (".mf4", ".mdf"),
        "forklift.recordings.formats.mdf4",
        picks=True,
        timed=True,
        isolated=True,
        frames=True,
    ),
    Format(
        "can",
        (".blf", ".asc"),
        "forklift.recordings.formats.can",
        picks=True,
        timed=True,
        isolated=True,
        frames=True,
    ),
)

_BY_SUFFIX = {suffix: format for format in FORMATS for suffix in format.suffixes}

SUFFIXES = tuple(_BY_SUFFIX)
"""Of all formats, in lower case."""


def format_of(file: str) -> Format:
    """The format of a file, by its suffix.

    Raises
    ------
    ForkliftError
        ``"format-unknown"``.
    """
    suffix = PurePosixPath(file).suffix.lower()
    if suffix not in _BY_SUFFIX:
        known = ", ".join(SUFFIXES)
        raise ForkliftError(
            "format-unknown",
            f"{file}: recordings are read from {known}, not from {suffix or 'a file without suffix'}; "
            "export it to one of these",
            file=file,
            value=suffix,
        )
    return _BY_SUFFIX[suffix]


def check_dbc(files: Sequence[str]) -> None:
    """Refuse that a DBC is given for files of which none may hold CAN frames.

    Raises
    ------
    ForkliftError
        ``"option-not-wanted"``.
    """
    if files and not any(format_of(file).frames for file in files):
        raise ForkliftError(
            "option-not-wanted",
            f"a DBC tells what the frames of a CAN log hold, and {files[0]} holds none; leave --dbc out",
            name="dbc",
            file=files[0],
        )


def read(place: Place, choose: Choose) -> tuple[Signals, str]:
    """The chosen series of the file at `place`, and the SHA-256 of the file.

    Raises
    ------
    ForkliftError
        ``"recording-missing"``, ``"recording-empty"``, ``"recording-unreadable"``, and what the format and
        `choose` raise.
    """
    format = format_of(place.file)
    digest = _digest(place)
    try:
        if format.isolated:
            return isolation.read(format.module, place, choose), digest
        signals: Signals = importlib.import_module(format.module).read(place, choose)
        return signals, digest
    except ForkliftError:
        raise
    except Exception as error:
        raise unreadable(place, format.name, error) from error


def _digest(place: Place) -> str:
    path = Path(place.path)
    try:
        if not path.is_file():
            raise place.error(
                "recording-missing",
                f"there is no such file in {path.parent}; put it there or correct its name",
            )
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
        if path.stat().st_size == 0:
            raise place.error("recording-empty", "the file is empty; record or export it again")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise place.error(
            "recording-unreadable", f"the file cannot be opened ({why.lower()}); see to its rights", cause=why
        ) from error
    return digest
