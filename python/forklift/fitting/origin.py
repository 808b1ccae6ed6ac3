"""A machine and its recordings as a verb is given them, and what its result was made from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from forklift.base.errors import ForkliftError
from forklift.base.typeset import counted
from forklift.plant.subject import Subject
from forklift.plant.subjects import is_machine, named, subject
from forklift.recordings.campaign import FILE, Campaign
from forklift.recordings.campaign_file import is_below


@dataclass(frozen=True)
class Origin:
    """What a result was made from.

    Attributes
    ----------
    name
        Of the campaign, or of the machine where the recordings have none.
    title
        The same as a page has it.
    facts
        Name, hash, and every recording's file and hash, for JSON.
    folder
        Where the recordings were read from; None if they were not.
    """

    name: str
    title: str
    facts: Mapping[str, Any]
    folder: Path | None = None

    @property
    def sha256(self) -> str:
        """Of all recordings."""
        return str(self.facts["sha256"])

    def command(self, machine: Subject, verb: str, options: Sequence[str] = ()) -> str | None:
        """The command that does the same; None if the recordings or the machine come from no file."""
        return machine.command(verb, self.folder, options) if self.folder else None


def given(
    machine: Any, recordings: Any, *, doubts: bool = True, **conditions: Any
) -> tuple[Subject, tuple[Any, ...], Origin]:
    """The machine behind the protocol, its recordings, and what they are.

    Parameters
    ----------
    machine, recordings
        A `Truck`, its name or file, a `Plant`, or anything with the protocol of `forklift.plant.subject`;
        a `Campaign` or its folder, or recordings of the machine's own kind. The two may change places.
    doubts
        Whether what was entered, and what no recording shows, is as uncertain as it is in a workshop.
    conditions
        As `forklift.plant.subjects.subject` takes them.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, ``"recording-repeated"``; those of `Truck.read` and `Campaign.read`.
    """
    machine, recordings = _read(machine), _read(recordings)
    if isinstance(machine, Campaign) or (is_machine(recordings) and not is_machine(machine)):
        machine, recordings = recordings, machine
    start = subject(machine, doubts=doubts, **conditions)
    each = getattr(recordings, "recordings", recordings)
    if not isinstance(each, Sequence) or isinstance(each, str):
        raise ForkliftError(
            "argument-invalid",
            f"recordings is {type(recordings).__name__}, where a campaign, its folder or a list of recordings"
            " is wanted",
            name="recordings",
        )
    _check(each)
    return start, tuple(each), _origin(start, recordings, each)


def _check(each: Sequence[Any]) -> None:
    """Recordings, each with a name of its own below a folder: results are written by it.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, ``"recording-repeated"``.
    """
    for one in each:
        if not (hasattr(one, "file") and hasattr(one, "sha256")):
            raise ForkliftError(
                "argument-invalid",
                f"recordings holds {type(one).__name__}, where recordings are wanted; read a campaign's "
                "folder, or make them",
                name="recordings",
            )
    names: set[str] = set()
    for one in each:
        if not PurePosixPath(one.file).name or not is_below(one.file):
            raise ForkliftError(
                "argument-invalid",
                f"a recording is called {one.file!r}, and results are written by that name; call it by a "
                "path below a folder",
                name="recordings",
                file=one.file,
            )
        if one.file in names:
            raise ForkliftError(
                "recording-repeated",
                f"two recordings are called {one.file!r}, and results are told by that name; rename one",
                file=one.file,
            )
        names.add(one.file)


def _read(one: Any) -> Any:
    """A campaign or a truck for a path or a name; anything else as it is."""
    if not isinstance(one, str | Path):
        return one
    path = Path(one)
    return Campaign.read(path) if path.name == FILE or (path / FILE).exists() else named(one)


def _origin(start: Subject, recordings: Any, each: Sequence[Any]) -> Origin:
    folder = getattr(recordings, "folder", None)
    if isinstance(recordings, Campaign):
        return Origin(recordings.name, recordings.title, recordings.facts(), folder)
    rows = [{"file": one.file, "sha256": one.sha256} for one in each]
    whole = hashlib.sha256("".join(row["sha256"] for row in rows).encode()).hexdigest()
    name = getattr(recordings, "name", start.name)
    facts = {"name": name, "sha256": whole, "recordings": rows}
    return Origin(name, f"{counted(len(rows), 'recording')} of {start.name}", facts, folder)
