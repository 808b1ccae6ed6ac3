"""What is to be converted: a campaign, whose file says all, or recordings, of which the options tell it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base import toml
from forklift.base.errors import ForkliftError
from forklift.recordings.campaign import FILE, MAPPING, document_of, places
from forklift.recordings.entered import Entered, of_name, of_table
from forklift.recordings.formats import SUFFIXES, format_of
from forklift.recordings.formats.signals import Place
from forklift.recordings.inspect import inspect
from forklift.recordings.mapping_file import Mapped

if TYPE_CHECKING:
    from forklift.recordings.campaign_file import CampaignFile

Ask = Callable[[str, str], Any]
"""Answers of a file what its lift or load is."""
OPTIONS = "convert"
"""What errors about the options name instead of a file."""


@dataclass(frozen=True)
class Sources:
    """What is to be read.

    Attributes
    ----------
    name
        Of the campaign.
    document
        The campaign file, or the one that would say the same as the options.
    found
        Each entry of it, and where its recording stands.
    sample_rate_hz
        As the campaign file says; None where the recordings tell it.
    notes
        Further files of the new campaign, by name.
    """

    name: str
    document: CampaignFile
    found: Sequence[tuple[Any, Place]]
    sample_rate_hz: float | None = None
    notes: Mapping[str, str] = field(default_factory=dict)


def is_campaign(files: Sequence[Path]) -> bool:
    """Whether what is named is one campaign, and no recording.

    Raises
    ------
    ForkliftError
        ``"format-unknown"`` of a recording that no format reads.
    """
    if len(files) != 1 or files[0].suffix.lower() in SUFFIXES:
        return False
    if files[0].is_file() and files[0].suffix.lower() != ".toml":
        format_of(files[0].name)
    return True


def of_campaign(source: Path, out: Path, name: str | None, told: Mapping[str, object]) -> Sources:
    """A campaign; of `told`, the options that would say what its file says, none is given.

    Raises
    ------
    ForkliftError
        ``"option-not-wanted"``, ``"output-exists"``, and those of `document_of`.
    """
    for option, value in told.items():
        if value is not None:
            raise ForkliftError(
                "option-not-wanted",
                f"{source} is to be a campaign, whose {FILE} tells {option}; leave the option out",
                name=option,
                file=str(source),
            )
    folder, document = document_of(source)
    if folder.resolve() == out.resolve():
        raise ForkliftError(
            "output-exists", f"{out} is the campaign to be converted; name another folder", file=str(out)
        )
    return Sources(name or document.name, document, list(places(folder, document)), document.sample_rate_hz)


def of_recordings(
    files: Sequence[Path],
    out: Path,
    name: str,
    options: Entered,
    mapping: Mapped,
    *,
    keep_mapping: bool,
    table: str | Path | None,
    cut: bool,
    propose: bool,
    ask: Ask | None,
) -> Sources:
    """Recordings: of each, lift, load and role as `options` say, else `table`, else its name, else `ask`.

    `keep_mapping` asks for a ``channels.toml`` beside the new campaign.

    Raises
    ------
    ForkliftError
        ``"output-exists"``, ``"option-missing"``, ``"table-invalid"``, and those of `of_table`, `inspect`
        and `forklift.recordings.campaign_file.check`.
    """
    for file in files:
        if out.resolve() in file.resolve().parents:
            raise ForkliftError(
                "output-exists",
                f"{out} holds {file.name}, which is to be converted, and would be replaced with it; name "
                "another folder",
                file=str(out),
            )
    entered = _entered(files, options, table, cut, ask)
    if propose and files:
        proposed = toml.loads(inspect(files[0], dbc=mapping.dbc).mapping())
        ignore = [*mapping.ignore, *proposed.get("ignore", [])]
        mapping = replace(mapping, channels=proposed["channels"], ignore=ignore)
    document = _document(name, files, str(out), entered, mapping)
    databases = tuple(os.path.abspath(file) for file in mapping.dbc)
    found = [
        (entry, Place(entry.file, os.path.abspath(file), dbc=databases))
        for entry, file in zip(document.recording, files, strict=True)
    ]
    notes = {MAPPING: mapping.written()} if keep_mapping and mapping.channels else {}
    return Sources(name, document, found, notes=notes)


def _entered(
    files: Sequence[Path], options: Entered, table: str | Path | None, cut: bool, ask: Ask | None
) -> list[Entered]:
    """What is said of each file; of one that is cut, its currents tell the lift unless `options` do."""
    told_by = of_table(table) if table else {}
    if told_by and not any(file.name in told_by for file in files):
        raise ForkliftError(
            "table-invalid",
            f"{table} tells of {', '.join(list(told_by)[:3])}, and of none of the recordings to be converted "
            f"({', '.join(file.name for file in files[:3])}); write their names as they are, or leave the "
            "table out",
            file=str(table),
            value=list(told_by),
        )
    found = []
    for file in files:
        one = options.over(told_by.get(file.name, Entered())).over(of_name(file.name))
        if cut:
            one = replace(one, lift=options.lift or "both")
        if ask and one.lift is None:
            one = replace(one, lift=ask(file.name, "lift"))
        if ask and one.load_kg is None:
            one = replace(one, load_kg=float(ask(file.name, "load_kg")))
        found.append(one)
    return found


def _document(
    name: str,
    files: Sequence[Path],
    out: str,
    entered: Sequence[Entered],
    mapping: Mapped,
) -> CampaignFile:
    """The campaign file that would say the same as the options."""
    from forklift.recordings import campaign_file

    for file, one in zip(files, entered, strict=True):
        for option, value in (("lift", one.lift), ("load_kg", one.load_kg)):
            if value is None:
                raise ForkliftError(
                    "option-missing",
                    f"nothing tells {option} of {file.name}; give it, write it into the file's name as in "
                    "free_800kg.mf4, or into a table",
                    name=option,
                    file=str(file),
                )
    return campaign_file.check(
        {
            "name": name,
            "sample_rate_hz": 1.0,  # not known before the files are read, and not used
            "ignore": list(mapping.ignore),
            "channels": dict(mapping.channels),
            "recording": [
                {
                    "file": file.name,
                    "lift": one.lift,
                    "load_kg": one.load_kg,
                    "role": one.role or "estimate",
                }
                for file, one in zip(files, entered, strict=True)
            ],
        },
        Place(OPTIONS, out),
    )
