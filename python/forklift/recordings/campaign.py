"""A campaign: recordings of one truck, and what was entered about each."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from forklift.base import arguments, output
from forklift.base.cell import Cell, Celled
from forklift.base.errors import ForkliftError
from forklift.recordings.formats.signals import Place
from forklift.recordings.recording import Recording

if TYPE_CHECKING:
    from forklift.recordings.campaign_file import CampaignFile

FILE = output.CAMPAIGN
MAPPING = "channels.toml"
"""How the logs of a converted campaign were mapped."""


@dataclass(frozen=True, repr=False)
class Campaign(Celled):
    """Recordings of one truck at one sample rate, in the order of ``campaign.toml``.

    ``campaign["free_steps_0kg.csv"]`` and ``campaign[0]`` are recordings; iterating gives all of them.

    Attributes
    ----------
    name
        As in ``campaign.toml``.
    sample_rate_hz
        Of all recordings [Hz].
    recordings
        All of them.
    folder
        Where it was read from; it does not count when campaigns are compared.
    """

    name: str
    sample_rate_hz: float
    recordings: tuple[Recording, ...]
    folder: Path | None = None

    def facts(self) -> dict[str, Any]:
        """Name, hash, and every recording's file and hash: what a result says of what it was made from."""
        return {
            "name": self.name,
            "sha256": self.sha256,
            "recordings": [{"file": found.file, "sha256": found.sha256} for found in self.recordings],
        }

    @property
    def title(self) -> str:
        """Its name, or its folder's, if that says anything; else what it is."""
        names = [self.name, *([self.folder.resolve().name] if self.folder else [])]
        telling = next((name for name in names if name.lower() != "campaign"), None)
        return f"campaign “{telling}”" if telling else "a campaign"

    @classmethod
    def read(cls, path: str | Path) -> Campaign:
        """Read a campaign's folder, or its ``campaign.toml``; every recording is read and checked.

        Formats: CSV, Parquet, MAT, MDF4 and CAN logs, with a ``[channels]`` table for names and units that
        are not the channels' own. Signals on clocks of their own keep them.

        Raises
        ------
        ForkliftError
            ``"campaign-missing"``, ``"campaign-file-missing"``, and everything that
            `forklift.recordings.campaign_file.parse` finds in ``campaign.toml`` and
            `forklift.recordings.reading` in a recording; with ``file``, ``line`` or ``sample``, ``channel``,
            ``value``, ``lower``, ``upper`` as they apply.
        """
        from forklift.recordings import reading

        folder, document = document_of(arguments.path("path", path))
        recordings = []
        for entry, place in places(folder, document):
            raw = reading.load(place, document.channel_map)
            recordings.append(
                reading.build(
                    raw,
                    lift=entry.lift,
                    load_kg=entry.load_kg,
                    role=entry.role,
                    sample_rate_hz=document.sample_rate_hz,
                )
            )
        return cls(document.name, document.sample_rate_hz, tuple(recordings), folder)

    def write(
        self, folder: str | Path, *, overwrite: bool = False, notes: Mapping[str, str] | None = None
    ) -> Path:
        """Write a folder of CSV files in SI units and its ``campaign.toml``, whole or not at all.

        Recordings of other formats are named ``.csv``. Every number reads back the same, to the bit.

        Parameters
        ----------
        folder
            A folder that does not exist yet, or is empty; its parent exists.
        overwrite
            Whether an earlier campaign may be replaced: a folder that holds the files of a campaign and no
            others.
        notes
            Further files to write there, name to text: ``channels.toml``, which an earlier campaign keeps.

        Raises
        ------
        ForkliftError
            ``"output-exists"`` or ``"not-writable"``.
        """
        from forklift.recordings import campaign_file

        folder = Path(folder)
        recordings = [replace(found, file=csv_name(found.file)) for found in self.recordings]
        document = campaign_file.dump(self.name, self.sample_rate_hz, recordings)
        campaign_file.parse(document.encode(), Place(FILE, str(folder / FILE)))
        kept = folder / MAPPING
        notes = dict(notes or {})
        if MAPPING not in notes and overwrite and os.path.isfile(kept):
            notes[MAPPING] = kept.read_text(encoding="utf-8")
        with output.folder(folder, replaceable(folder, overwrite), FILE) as temporary:
            for name, text in notes.items():
                (temporary / name).write_text(text, encoding="utf-8", newline="\n")
            for found in recordings:
                path = temporary / found.file
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(found.to_csv().encode())
            (temporary / FILE).write_bytes(document.encode())
        return folder

    def cell(self) -> Cell:
        """Every recording in a row."""
        held = len(self.validate)
        told = self.title[:1].upper() + self.title[1:]
        return Cell(
            [f"{told}: {len(self)} recordings, {len(self) - held} to be fitted on and {held} held out."],
            ["File", "Lift", "Load [kg]", "Role", "Samples", "Seconds", "Channels"],
            [
                [one.file, one.lift, f"{one.load_kg:g}", one.role, str(len(one)), f"{one.duration_s:.1f}",
                 ", ".join(one.channels)]
                for one in self.recordings
            ],
        )  # fmt: skip

    @property
    def estimate(self) -> tuple[Recording, ...]:
        """The recordings that may be fitted on."""
        return tuple(found for found in self.recordings if found.role == "estimate")

    @property
    def validate(self) -> tuple[Recording, ...]:
        """The recordings that are only ever judged on."""
        return tuple(found for found in self.recordings if found.role == "validate")

    @cached_property
    def sha256(self) -> str:
        """Of everything: what was entered, the files as they were read and the samples as they are used."""
        entered = [self.name, float(self.sample_rate_hz)]
        files = [[found.file, found.sha256, found.content_sha256] for found in self.recordings]
        return hashlib.sha256(json.dumps([entered, files]).encode()).hexdigest()

    def __getitem__(self, which: str | int) -> Recording:
        if isinstance(which, int) and -len(self) <= which < len(self):
            return self.recordings[which]
        for found in self.recordings:
            if found.file == which:
                return found
        files = [found.file for found in self.recordings]
        near = get_close_matches(which, files, n=1) if isinstance(which, str) else []
        raise ForkliftError(
            "recording-unknown",
            f"campaign {self.name!r} has no recording {which!r}, by its file or its number; "
            + (f"did you mean {near[0]!r}?" if near else f"it has {', '.join(files)}"),
            file=str(which),
            known=files,
        )

    def __iter__(self) -> Iterator[Recording]:
        return iter(self.recordings)

    def __len__(self) -> int:
        return len(self.recordings)

    def __contains__(self, which: object) -> bool:
        return any(which in (found, found.file) for found in self.recordings)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Campaign):
            return NotImplemented
        return (self.name, self.sample_rate_hz, self.recordings) == (
            other.name,
            other.sample_rate_hz,
            other.recordings,
        )

    def __hash__(self) -> int:
        return hash((self.name, self.sample_rate_hz, self.recordings))

    def to_dict(self) -> dict[str, Any]:
        """The campaign and each recording's summary, for JSON."""
        return {
            "name": self.name,
            "sample_rate_hz": self.sample_rate_hz,
            "sha256": self.sha256,
            "folder": None if self.folder is None else str(self.folder),
            "recordings": [found.to_dict() for found in self.recordings],
        }

    def __repr__(self) -> str:
        return (
            f"Campaign({self.name!r}, {len(self)} recordings ({len(self.estimate)} estimate, "
            f"{len(self.validate)} validate) at {self.sample_rate_hz:g} Hz)"
        )


def campaign_of(given: Campaign | str | Path) -> Campaign:
    """A campaign, or the one of a folder.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, and those of `Campaign.read`.
    """
    if isinstance(given, str | Path):
        return Campaign.read(given)
    arguments.of_kind(Campaign, campaign=given)
    return given


def document_of(path: str | Path) -> tuple[Path, CampaignFile]:
    """The folder and the campaign file that `path`, either of them, leads to; no recording is read.

    Raises
    ------
    ForkliftError
        See `Campaign.read`.
    """
    from forklift.recordings import campaign_file

    path = Path(path)
    try:
        if not path.exists():
            raise ForkliftError(
                "campaign-missing",
                f"{path} does not exist; name a folder that holds {FILE} and its recordings",
                file=str(path),
            )
        file = path / FILE if path.is_dir() else path
        if file.suffix != ".toml" or not file.is_file():
            what = f"{path} holds no {FILE}" if path.is_dir() else f"{path} is neither a folder nor a {FILE}"
            raise ForkliftError(
                "campaign-file-missing",
                f"{what}; name a campaign's folder, or convert recordings into one",
                file=str(file),
            )
        data = file.read_bytes()
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise ForkliftError(
            "campaign-unreadable",
            f"{path} cannot be opened ({why.lower()}); see to its rights",
            file=str(path),
            cause=why,
        ) from error
    return file.parent, campaign_file.parse(data, Place(file.name, os.path.abspath(file)))


def places(folder: Path, document: CampaignFile) -> Iterable[tuple[Any, Place]]:
    """Each entry of the campaign file, and where its recording stands."""
    for entry in document.recording:
        file = str(PurePosixPath(entry.file))
        dbc = tuple(os.path.abspath(folder / one) for one in document.databases)
        yield entry, Place(file, os.path.abspath(folder / file), dbc=dbc)


def csv_name(file: str) -> str:
    """A recording's name as a CSV file."""
    return str(PurePosixPath(file).with_suffix(".csv"))


def replaceable(folder: Path, overwrite: bool) -> frozenset[str]:
    """The files that may stand in `folder` before a campaign is written there: those an earlier one lists.

    Raises
    ------
    ForkliftError
        ``"output-exists"`` if there is an earlier campaign that is not to be overwritten.
    """
    if not overwrite and os.path.exists(folder / FILE):
        raise ForkliftError(
            "output-exists",
            f"{folder} already holds a campaign; name a folder that does not exist yet, or ask to "
            "overwrite it",
            file=str(folder),
        )
    try:
        _, document = document_of(folder)
    except ForkliftError:
        return frozenset()
    return frozenset({FILE, MAPPING, *(str(PurePosixPath(entry.file)) for entry in document.recording)})
