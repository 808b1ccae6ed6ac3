"""Recordings in any format and unit to a campaign of CSV files in SI units."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base import arguments, output
from forklift.base.errors import ForkliftError
from forklift.recordings.campaign import FILE, MAPPING, Campaign, document_of, replaceable
from forklift.recordings.channels import Lifts
from forklift.recordings.cut import lowerings
from forklift.recordings.entered import Entered
from forklift.recordings.formats import check_dbc
from forklift.recordings.formats.signals import Place
from forklift.recordings.mapping_file import mapped
from forklift.recordings.recording import Role
from forklift.recordings.sources import OPTIONS, Ask, is_campaign, of_campaign, of_recordings

if TYPE_CHECKING:
    from forklift.recordings.reading import Raw

_RATE_DIGITS = 6  # of a sample rate that is found from time stamps: a clock is not better than 1 ppm


def convert(
    source: str | Path | Sequence[str | Path],
    out: str | Path,
    *,
    lift: Lifts | None = None,
    load_kg: float | None = None,
    role: Role | None = None,
    name: str | None = None,
    sample_rate_hz: float | None = None,
    channels: Mapping[str, str | Mapping[str, Any]] | str | Path | None = None,
    ignore: Iterable[str] = (),
    dbc: str | Path | Sequence[str | Path] = (),
    table: str | Path | None = None,
    cut: bool = False,
    propose: bool = False,
    extend: bool = False,
    ask: Ask | None = None,
    overwrite: bool = False,
) -> Campaign:
    """Write a plain campaign: one CSV file in SI units for each recording, and its ``campaign.toml``.

    Whole or not at all: before everything has been read and checked, nothing is written.

    Parameters
    ----------
    source
        A campaign (folder or ``campaign.toml``), whose file says all the rest; or one or more recordings
        (MDF4, MAT, Parquet, CSV, CAN), of which `lift`, `load_kg`, `role` and the following are told here.
    out
        The folder to write; it does not exist yet, or is empty.
    lift, load_kg, role
        As in ``campaign.toml`` [kg], for all recordings. Unless told: as `table` says of the file, else as
        its name does (`forklift.recordings.entered`), else as `ask` answers; `role` is then ``"estimate"``.
    name
        Of the campaign; the folder's name, or the source's, unless told.
    sample_rate_hz
        Of recordings whose channels have one clock [Hz]; of a clock that is a whole number of times as fast
        every so-manieth row is kept, and lost rows are filled with missing samples. Unless told, the
        campaign's, or that of the commanded current. Channels on clocks of their own keep them.
    channels
        As ``[channels]``: ``{"ValveCurrFL": {"channel": "current_free_a", "scale": 0.001}}``; a bare name
        stands for its channel, in the unit that the file states. Or a TOML file with that table, as
        ``forklift info FILE --write`` makes it; it may hold ``ignore`` and ``dbc`` too.
    ignore
        Columns to pass over.
    dbc
        The DBC of a CAN log, or several.
    table
        A CSV file with the columns ``file, lift, load_kg, role``.
    cut
        Whether each file is cut into its lowerings, see `forklift.recordings.cut`; the lift is then told by
        the currents, unless `lift` is given, whatever the file's name or `table` says.
    propose
        Whether what `forklift.recordings.inspect` proposes stands for `channels`.
    extend
        Whether the recordings are added to the campaign that stands in `out`, whose files stay as they are
        and whose file has neither ``[channels]`` nor ``ignore``. Unless told otherwise they are mapped as its
        ``channels.toml`` says.
    ask
        Called with a file and ``"lift"`` or ``"load_kg"`` where nothing tells it.
    overwrite
        See `Campaign.write`.

    Returns
    -------
    Campaign
        What was written, read back.

    Raises
    ------
    ForkliftError
        ``"option-missing"``, ``"option-not-wanted"``, ``"table-invalid"``, and everything `Campaign.read` and
        `Campaign.write` raise.
    """
    from forklift.recordings import reading

    if propose and channels is not None:
        raise ForkliftError(
            "option-not-wanted",
            "a mapping is either proposed or given; leave propose or channels out",
            name="propose",
        )
    out = Path(out)
    may_stand = replaceable(out, overwrite or extend)
    output.check_folder(out, may_stand, FILE)
    earlier = _extended(out, name) if extend else None
    if sample_rate_hz is not None:
        sample_rate_hz = _asked_rate(sample_rate_hz, out, earlier)
    files = [Path(source)] if isinstance(source, str | Path) else [Path(file) for file in source]
    if is_campaign(files):
        told = {
            "lift": lift,
            "load_kg": load_kg,
            "role": role,
            "channels": channels,
            "ignore": tuple(ignore) or None,
            "dbc": ([dbc] if isinstance(dbc, str | Path) else list(dbc)) or None,
            "table": table,
            "cut": cut or None,
            "propose": propose or None,
            "extend": extend or None,
        }
        sources = of_campaign(files[0], out, name, told)
    else:
        ignore = tuple(ignore)
        if dbc:
            check_dbc([file.name for file in files])
        alike = extend and channels is None and not propose and (out / MAPPING).exists()
        sources = of_recordings(
            files,
            out,
            name or (earlier.name if earlier else out.resolve().name),
            Entered(lift, load_kg, role),
            mapped(out / MAPPING if alike else channels, ignore, dbc),
            keep_mapping=not alike or bool(ignore or dbc),
            table=table,
            cut=cut,
            propose=propose,
            ask=ask,
        )
    raws = [(entry, reading.load(place, sources.document.channel_map)) for entry, place in sources.found]
    rate = sample_rate_hz or sources.sample_rate_hz
    rate = rate or (earlier.sample_rate_hz if earlier else _rate(raws[0][1]))
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
    if cut:
        recordings = tuple(part for one in recordings for part in lowerings(one))
    notes = dict(sources.notes)
    if overwrite and (out / MAPPING).is_file():
        notes.setdefault(MAPPING, (out / MAPPING).read_text(encoding="utf-8"))
    with output.folder(out, may_stand, FILE) as new:
        Campaign(sources.name, rate, recordings).write(new, notes=notes)
        if earlier:
            _put_behind(out, new, notes)
        made = Campaign.read(new)
    return replace(made, folder=out)


def _asked_rate(rate_hz: float, out: Path, earlier: Campaign | None) -> float:
    """The sample rate that was asked for [Hz], which is that of a campaign that is extended."""
    from forklift.recordings import campaign_file

    rate_hz = arguments.number("sample_rate_hz", rate_hz)
    campaign_file.check_rate(rate_hz, Place(OPTIONS, str(out)))
    if earlier and rate_hz != earlier.sample_rate_hz:
        raise ForkliftError(
            "sample-rate-mismatch",
            f"{out} has {earlier.sample_rate_hz:g} Hz, and what is added to it has the same rate; leave "
            f"--rate {rate_hz:g} out, or convert into another folder",
            file=str(out),
            value=rate_hz,
            expected=earlier.sample_rate_hz,
        )
    return rate_hz


def _extended(folder: Path, name: str | None) -> Campaign:
    """The campaign that is added to; its ``campaign.toml`` says nothing that would count for what is added.

    Raises
    ------
    ForkliftError
        ``"option-not-wanted"``, and those of `Campaign.read`.
    """
    earlier = Campaign.read(folder)
    document = document_of(folder)[1]
    if document.channels or document.ignore:
        raise ForkliftError(
            "option-not-wanted",
            f"the {FILE} of {folder} has {'[channels]' if document.channels else 'ignore'}, which would "
            "count for what is added too; convert that campaign into another folder, and extend that",
            name="extend",
            file=str(folder),
        )
    if name is not None and name != earlier.name:
        raise ForkliftError(
            "option-not-wanted",
            f"{folder} has the name {earlier.name!r}, which it keeps when it is extended; leave --name "
            f"{name!r} out, or write it into its {FILE}",
            name="name",
            file=str(folder),
            value=name,
        )
    return earlier


def _put_behind(earlier: Path, new: Path, notes: Iterable[str]) -> None:
    """The campaign in `new` behind the one in `earlier`, whose files are copied there byte for byte."""
    from forklift.recordings import campaign_file

    (before, after) = ((folder / FILE).read_bytes() for folder in (earlier, new))
    text = before.rstrip() + b"\n" + after[after.index(b"\n[[recording]]") :]
    campaign_file.parse(text, Place(FILE, str(earlier / FILE)))
    shutil.copytree(
        earlier, new, symlinks=True, ignore=shutil.ignore_patterns(FILE, *notes), dirs_exist_ok=True
    )
    (new / FILE).write_bytes(text)


def _rate(raw: Raw) -> float:
    """The sample rate of the commanded currents [Hz], without the rounding of their time stamps."""
    return float(f"{raw.command_rate_hz:.{_RATE_DIGITS}g}")
