"""Recordings in any format and unit to a campaign of CSV files in SI units."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base import arguments, output, toml
from forklift.base.errors import ForkliftError
from forklift.recordings.campaign import FILE, MAPPING, Campaign, document_of, places, replaceable
from forklift.recordings.channels import Lifts
from forklift.recordings.cut import lowerings
from forklift.recordings.entered import Entered, of_name, of_table
from forklift.recordings.formats import SUFFIXES, format_of
from forklift.recordings.formats.signals import Place
from forklift.recordings.inspect import inspect
from forklift.recordings.recording import Role

if TYPE_CHECKING:
    from forklift.recordings.campaign_file import CampaignFile
    from forklift.recordings.reading import Raw

_RATE_DIGITS = 6  # of a sample rate that is found from time stamps: a clock is not better than 1 ppm
Ask = Callable[[str, str], Any]
"""Answers of a file what its lift or load is."""
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
        ``"option-missing"`` or ``"option-not-wanted"``, and everything `Campaign.read` and `Campaign.write`
        raise.
    """
    from forklift.recordings import campaign_file, reading

    if propose and channels is not None:
        raise ForkliftError(
            "option-not-wanted",
            "a mapping is either proposed or given; leave propose or channels out",
            name="propose",
        )
    output.check_folder(out, replaceable(Path(out), overwrite or extend), FILE)
    earlier = _extended(Path(out), name) if extend else None
    mapped_alike = extend and channels is None and not propose and (Path(out) / MAPPING).exists()
    if mapped_alike:
        channels = Path(out) / MAPPING
    if sample_rate_hz is not None:
        sample_rate_hz = arguments.number("sample_rate_hz", sample_rate_hz)
        campaign_file.check_rate(sample_rate_hz, Place(_OPTIONS, str(out)))
        if earlier and sample_rate_hz != earlier.sample_rate_hz:
            raise ForkliftError(
                "sample-rate-mismatch",
                f"{out} has {earlier.sample_rate_hz:g} Hz, and what is added to it has the same rate; leave "
                f"--rate {sample_rate_hz:g} out, or convert into another folder",
                file=str(out),
                value=sample_rate_hz,
                expected=earlier.sample_rate_hz,
            )
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
            "dbc": ([dbc] if isinstance(dbc, str | Path) else list(dbc)) or None,
            "table": table,
            "cut": cut or None,
            "propose": propose or None,
            "extend": extend or None,
        }
        _nothing_told(files[0], told)
        folder, document = document_of(files[0])
        if folder.resolve() == Path(out).resolve():
            raise ForkliftError(
                "output-exists", f"{out} is the campaign to be converted; name another folder", file=str(out)
            )
        found = list(places(folder, document))
        notes: dict[str, str] = {}
        name = name or document.name
        rate = rate or document.sample_rate_hz
    else:
        for file in files:
            if Path(out).resolve() in file.resolve().parents:
                raise ForkliftError(
                    "output-exists",
                    f"{out} holds {file.name}, which is to be converted, and would be replaced with it; name "
                    "another folder",
                    file=str(out),
                )
        name = name or (earlier.name if earlier else Path(out).resolve().name)
        told_by = of_table(table) if table else {}
        entered = [
            Entered(lift, load_kg, role).over(told_by.get(file.name, Entered())).over(of_name(file.name))
            for file in files
        ]
        if ask and not cut:
            entered = [
                Entered(one.lift or ask(file.name, "lift"), one.load_kg, one.role)
                for one, file in zip(entered, files, strict=True)
            ]
        if ask:
            entered = [
                one
                if one.load_kg is not None
                else Entered(one.lift, float(ask(file.name, "load_kg")), one.role)
                for one, file in zip(entered, files, strict=True)
            ]
        if cut:
            entered = [Entered(lift or "both", one.load_kg, one.role) for one in entered]
        ignore = tuple(ignore)
        unchanged = mapped_alike and not ignore and not dbc
        mapping = _mapping(channels, ignore, dbc)
        if propose and files:
            proposed = toml.loads(inspect(files[0], dbc=mapping["dbc"]).mapping())
            mapping["channels"] = proposed["channels"]
            mapping["ignore"] += proposed.get("ignore", [])
        document = _document(name, files, str(out), entered, mapping)
        entries = zip(document.recording, files, strict=True)
        databases = tuple(os.path.abspath(file) for file in mapping["dbc"])
        notes = {MAPPING: _written(mapping)} if mapping["channels"] and not unchanged else {}
        found = [(entry, Place(entry.file, os.path.abspath(file), dbc=databases)) for entry, file in entries]
    raws = [(entry, reading.load(place, document.channel_map)) for entry, place in found]
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
    kept = Path(out) / MAPPING
    if overwrite and kept.is_file():
        notes.setdefault(MAPPING, kept.read_text(encoding="utf-8"))
    with output.folder(out, replaceable(Path(out), overwrite or extend), FILE) as new:
        Campaign(name, rate, recordings).write(new, notes=notes)
        if earlier:
            _put_behind(Path(out), new, notes)
        made = Campaign.read(new)
    return replace(made, folder=Path(out))


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


def _document(
    name: str,
    files: Sequence[Path],
    out: str,
    entered: Sequence[Entered],
    mapping: Mapping[str, Any],
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
            "ignore": list(mapping["ignore"]),
            "channels": dict(mapping["channels"]),
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
        Place(_OPTIONS, out),
    )


def _mapping(
    channels: Mapping[str, str | Mapping[str, Any]] | str | Path | None,
    ignore: Iterable[str],
    dbc: str | Path | Sequence[str | Path],
) -> dict[str, Any]:
    """``channels``, ``ignore`` and ``dbc``, from the options or from a file that says them."""
    bases = [str(dbc)] if isinstance(dbc, str | Path) else [str(file) for file in dbc]
    if not isinstance(channels, str | Path):
        plain = {
            name: source if isinstance(source, str) else dict(source)
            for name, source in (channels or {}).items()
        }
        return {"channels": plain, "ignore": list(ignore), "dbc": bases}
    path = Path(channels)
    try:
        found = toml.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise ForkliftError(
            "mapping-unreadable",
            f"{path} cannot be read as TOML ({error}); make one with forklift info FILE --write {path.name}",
            file=str(path),
        ) from error
    wrong = [key for key in found if key not in ("channels", "ignore", "dbc")]
    stated = found.get("dbc", [])
    stated, passed = [stated] if isinstance(stated, str) else stated, found.get("ignore", [])
    if not isinstance(found.get("channels", {}), dict):
        wrong.append("channels that are no table")
    wrong += [
        f"{key} that is no list of texts"
        for key, told in (("ignore", passed), ("dbc", stated))
        if not isinstance(told, list) or not all(isinstance(one, str) for one in told)
    ]
    if wrong:
        raise ForkliftError(
            "mapping-unreadable",
            f"{path} holds {wrong[0]}; it may hold [channels], ignore and dbc",
            file=str(path),
        )
    return {
        "channels": found.get("channels", {}),
        "ignore": [*passed, *ignore],
        "dbc": bases or [str(path.parent / file) for file in stated],
    }


def _written(mapping: Mapping[str, Any]) -> str:
    """The mapping as a TOML file, for the next time."""

    lines = ["# How these recordings' logs were mapped; forklift convert --extend maps further ones alike."]
    for key in ("ignore", "dbc"):
        if mapping[key]:
            values = [os.path.abspath(one) for one in mapping[key]] if key == "dbc" else mapping[key]
            lines.append(f"{key} = {toml.written(values)}")
    lines += ["", "[channels]"]
    for name, source in mapping["channels"].items():
        if isinstance(source, str):
            lines.append(f"{toml.written(name)} = {toml.written(source)}")
        else:
            inside = ", ".join(
                f"{key} = {toml.written(value) if isinstance(value, str) else repr(float(value))}"
                for key, value in source.items()
            )
            lines.append(f"{toml.written(name)} = {{ {inside} }}")
    return "\n".join(lines) + "\n"


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
