"""Recordings in any format and unit to a campaign of CSV files in SI units."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base import output
from forklift.base.errors import ForkliftError
from forklift.recordings.campaign import FILE, Campaign, document_of, places, replaceable
from forklift.recordings.channels import Lifts
from forklift.recordings.formats import SUFFIXES, format_of
from forklift.recordings.formats.signals import Place
from forklift.recordings.recording import Role

if TYPE_CHECKING:
    from forklift.recordings.campaign_file import CampaignFile
    from forklift.recordings.reading import Raw

_RATE_DIGITS = 6  # of a sample rate that is found from time stamps: a clock is not better than 1 ppm
_OPTIONS = "convert"  # what errors about the options name instead of a file


def convert(
    source: str | Path | Sequence[str | Path],
    out: str | Path,
    *,
    lift: Lifts | None = None,
    load_kg: float | None = None,
    role: Role | None = None,
    name: str | None = None,
    sample_rate_hz: float | None = None,
    channels: Mapping[str, str | Mapping[str, Any]] | None = None,
    ignore: Iterable[str] = (),
    dbc: str | Path | Sequence[str | Path] = (),
    overwrite: bool = False,
) -> Campaign:
    """Write a plain campaign: one CSV file in SI units for each recording, and its ``campaign.toml``.

    Whole or not at all: before everything has been read and checked, nothing is written.

    Parameters
    ----------
    source
        A campaign (folder or ``campaign.toml``), whose file says all the rest; or one or more recordings
        (MDF4, MAT, Parquet, CSV), of which `lift`, `load_kg`, `role` and the following are told here.
    out
        The folder to write; it does not exist yet, or is empty.
    lift, load_kg, role
        As in ``campaign.toml`` [kg], for all recordings; `role` is ``"estimate"`` unless told.
    name
        Of the campaign; the folder's name, or the source's, unless told.
    sample_rate_hz
        To bring all channels to [Hz], see `forklift.recordings.resample`; a recording that is at this rate
        stays as it is. Unless told, the campaign's, or that of the commanded current.
    channels
        As ``[channels]``: ``{"ValveCurrFL": {"channel": "current_free_a", "scale": 0.001}}``; a bare name
        stands for its channel, without scale.
    ignore
        Columns to pass over.
    dbc
        The DBC of a CAN log, or several.
    overwrite
        See `Campaign.write`.

    Returns
    -------
    Campaign
        What was written, read back.

    Raises
    ------
    ForkliftError
        ``"option-missing"`` or ``"option-not-wanted"``, and everything `Campaign.read` and `Campaign.write`
        raise.
    """
    from forklift.recordings import campaign_file, reading

    output.check_folder(out, replaceable(Path(out), overwrite), FILE)
    if sample_rate_hz is not None:
        campaign_file.check_rate(sample_rate_hz, Place(_OPTIONS, str(out)))
    files = [Path(source)] if isinstance(source, str | Path) else [Path(file) for file in source]
    rate = sample_rate_hz
    if len(files) == 1 and files[0].suffix.lower() not in SUFFIXES:
        if files[0].is_file() and files[0].suffix.lower() != ".toml":
            format_of(files[0].name)  # a recording of no known format
        told = {
            "lift": lift,
            "load_kg": load_kg,
            "role": role,
            "channels": channels,
            "ignore": tuple(ignore) or None,
        }
        _nothing_told(files[0], told)
        folder, document = document_of(files[0])
        if folder.resolve() == Path(out).resolve():
            raise ForkliftError(
                "output-exists", f"{out} is the campaign to be converted; name another folder", file=str(out)
            )
        found = list(places(folder, document))
        name = name or document.name
        rate = rate or document.sample_rate_hz
    else:
        name = name or Path(out).resolve().name
        document = _document(name, files, str(out), lift, load_kg, role, channels, ignore)
        entries = zip(document.recording, files, strict=True)
        bases = [dbc] if isinstance(dbc, str | Path) else dbc
        databases = tuple(os.path.abspath(file) for file in bases)
        found = [(entry, Place(entry.file, os.path.abspath(file), dbc=databases)) for entry, file in entries]
    raws = [(entry, reading.load(place, document.channel_map)) for entry, place in found]
    rate = rate or _rate(raws[0][1])
    recordings = tuple(
        reading.build(
            raw,
            lift=entry.lift,
            load_kg=entry.load_kg,
            role=entry.role,
            sample_rate_hz=rate,
            regrid=sample_rate_hz is not None,
        )
        for entry, raw in raws
    )
    return Campaign.read(Campaign(name, rate, recordings).write(out, overwrite=overwrite))


def _document(
    name: str,
    files: Sequence[Path],
    out: str,
    lift: Lifts | None,
    load_kg: float | None,
    role: Role | None,
    channels: Mapping[str, str | Mapping[str, Any]] | None,
    ignore: Iterable[str],
) -> CampaignFile:
    """The campaign file that would say the same as the options."""
    from forklift.recordings import campaign_file

    for option, value in (("lift", lift), ("load_kg", load_kg)):
        if value is None:
            raise ForkliftError(
                "option-missing",
                f"the files do not tell {option}; give it, or write a {FILE} for them",
                name=option,
            )
    entered = {"lift": lift, "load_kg": load_kg, "role": role or "estimate"}
    return campaign_file.check(
        {
            "name": name,
            "sample_rate_hz": 1.0,  # not known before the files are read, and not used
            "ignore": list(ignore),
            "channels": {
                name: {"channel": source} if isinstance(source, str) else dict(source)
                for name, source in (channels or {}).items()
            },
            "recording": [{"file": file.name, **entered} for file in files],
        },
        Place(_OPTIONS, out),
    )


def _nothing_told(campaign: Path, told: Mapping[str, object]) -> None:
    for option, value in told.items():
        if value is not None:
            raise ForkliftError(
                "option-not-wanted",
                f"{campaign} is to be a campaign, whose {FILE} tells {option}; leave the option out",
                name=option,
                file=str(campaign),
            )


def _rate(raw: Raw) -> float:
    """The sample rate of the commanded currents [Hz], without the rounding of their time stamps."""
    return float(f"{raw.command_rate_hz:.{_RATE_DIGITS}g}")
