"""``campaign.toml``: its keys, what may stand in them, and on which line something wrong stands."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from forklift.base import toml
from forklift.base.errors import ForkliftError
from forklift.recordings.channels import Lifts, names_other_lift, table
from forklift.recordings.formats import format_of
from forklift.recordings.formats.mapping import ChannelMap, Source
from forklift.recordings.formats.signals import Place, quoted
from forklift.recordings.recording import HEAVIEST_KG, Recording, Role

LARGEST_BYTES = 2**20
"""Of a campaign file: an entry takes about a hundred bytes, and a larger file is another one."""

_STRICT = ConfigDict(extra="forbid", strict=True, frozen=True)


class Entry(BaseModel):
    """``[[recording]]``: a file and what the person who measured entered about it."""

    model_config = _STRICT
    file: str
    lift: Lifts
    load_kg: float
    role: Role


class SourceEntry(BaseModel):
    """``[channels]``: the channel a name in the files stands for, and how its values come to SI units.

    By its unit, or by ``value in SI = raw * scale + offset``; `time` names a column with times of its own.
    """

    model_config = _STRICT
    channel: str
    scale: float | None = None
    offset: float | None = None
    unit: str = ""
    time: str = ""


class CampaignFile(BaseModel):
    """The whole of ``campaign.toml``."""

    model_config = _STRICT
    name: str
    sample_rate_hz: float
    ignore: list[str] = []
    dbc: str | list[str] = []
    channels: dict[str, SourceEntry] = {}
    recording: list[Entry]

    @property
    def databases(self) -> tuple[str, ...]:
        """The DBCs of CAN logs, as paths below the campaign's folder."""
        return (self.dbc,) if isinstance(self.dbc, str) else tuple(self.dbc)

    @property
    def channel_map(self) -> ChannelMap:
        """``[channels]`` and ``ignore``."""
        sources = {
            name: Source(found.channel, found.scale, found.offset, found.unit, found.time)
            for name, found in self.channels.items()
        }
        return ChannelMap(sources, frozenset(self.ignore))


def parse(data: bytes, place: Place) -> CampaignFile:
    """The campaign file, every key checked; no recording is read.

    Raises
    ------
    ForkliftError
        ``"campaign-unreadable"``, ``"campaign-syntax"``, ``"key-unknown"``, ``"key-missing"``,
        ``"value-invalid"``, ``"role-unknown"``, ``"lift-unknown"``, ``"load-out-of-bounds"``,
        ``"sample-rate-out-of-bounds"``, ``"recordings-missing"``, ``"recording-repeated"``,
        ``"path-escapes"``, ``"format-unknown"``, ``"channel-unknown"``, ``"channel-repeated"``,
        ``"scale-invalid"`` or ``"source-ignored"``.
    """
    if len(data) > LARGEST_BYTES:
        raise place.error(
            "campaign-unreadable",
            f"the file has {len(data)} bytes, where {LARGEST_BYTES} hold thousands of recordings; name a "
            "campaign.toml",
            value=len(data),
            upper=LARGEST_BYTES,
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise place.error(
            "campaign-unreadable",
            "the file is not UTF-8 text; save it as text in UTF-8",
            line=data.count(b"\n", 0, error.start) + 1,
        ) from error
    try:
        return check(toml.loads(text), place, text)
    except (ValueError, RecursionError) as error:  # a number of too many digits is a ValueError
        where = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)", str(error))
        line = int(where[1]) if where and where[1] else len(text.splitlines()) or 1
        what = str(error).replace(where[0], "") if where else "it cannot be understood"
        raise place.error(
            "campaign-syntax",
            f"this is not TOML ({what[:1].lower()}{what[1:]}); correct it",
            line=line,
            position=int(where[2]) if where and where[2] else None,
        ) from error


def check(document: Mapping[str, Any], place: Place, text: str = "") -> CampaignFile:
    """`document` as a campaign file; `text` is where its lines are looked up."""
    document = _with_channels(document)
    try:
        found = CampaignFile.model_validate(document)
    except ValidationError as error:
        found_wrong = error.errors(include_url=False, include_context=False)
        misspelt = [
            wrong for wrong in found_wrong if wrong["type"] == "extra_forbidden"
        ]  # else told as missing
        raise _structural((misspelt or found_wrong)[0], document, place, text) from error
    check_rate(found.sample_rate_hz, place, line_of(text, ("sample_rate_hz",)))
    if not found.recording:
        raise _no_recordings(place)
    _check_channels(found, place, text)
    _check_entries(found, place, text)
    return found


def _with_channels(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """The document, with the short forms of ``[channels]`` written out.

    ``P = "pressure_free_pa"`` is a channel, ``pressure_free_pa = "bar"`` a unit.
    """
    channels = document.get("channels")
    if not isinstance(channels, dict):
        return document
    written: dict[str, Any] = {}
    for name, value in channels.items():
        if isinstance(value, str) and value not in table() and name in table():
            value = {"channel": name, "unit": value}
        elif isinstance(value, str):
            value = {"channel": value}
        written[name] = value
    return {**document, "channels": written}


def dump(name: str, sample_rate_hz: float, recordings: Iterable[Recording]) -> str:
    """A campaign file of recordings in SI units."""
    lines = [f"name = {toml.written(name)}", f"sample_rate_hz = {float(sample_rate_hz)!r}"]
    for found in recordings:
        lines += [
            "",
            "[[recording]]",
            f"file = {toml.written(found.file)}",
            f"lift = {toml.written(found.lift)}",
            f"load_kg = {float(found.load_kg)!r}",
            f"role = {toml.written(found.role)}",
        ]
    return "\n".join(lines) + "\n"


def normal(file: str) -> str:
    """A recording's name without needless dots and slashes."""
    return str(PurePosixPath(file))


def _structural(
    found: Mapping[str, Any], document: Mapping[str, Any], place: Place, text: str
) -> ForkliftError:
    """What pydantic found first, as one sentence."""
    path: tuple[str | int, ...] = found["loc"]
    if path[0] in ("dbc", "ignore"):
        path = path[:1]  # what lies below is a list's place or a kind, and no key of the file
    kind, value, key = found["type"], found["input"], str(path[-1])
    at = _owner(path, document)
    line = line_of(text, path)
    facts: dict[str, Any] = {"line": line, "key": key, "name": key}
    if kind == "missing" and path == ("recording",):
        return _no_recordings(place)
    if kind == "missing":
        return place.error("key-missing", f"{at}the key {key} is missing; add it", **facts)
    if kind == "extra_forbidden":
        known = _keys(path)
        near = get_close_matches(key, known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
        return place.error(
            "key-unknown",
            f"{at}there is no key {quoted(key)} ({hint}); correct or remove it",
            known=known,
            **facts,
        )
    facts["value"] = value if isinstance(value, str | int | float) else str(value)[:100]
    choices = {"lift": get_args(Lifts), "role": get_args(Role)}.get(key)
    if choices and len(path) == 3:
        return place.error(
            f"{key}-unknown",
            f"{at}{key} is {quoted(value)}; write {' or '.join(repr(choice) for choice in choices)}",
            known=list(choices),
            **facts,
        )
    if path == ("recording",) or (len(path) == 2 and path[0] == "recording"):
        what = "every recording is a table of its own; begin each with [[recording]]"
    else:
        what = f"{at}{key} is {quoted(value)}; {_wanted(kind)}"
    return place.error("value-invalid", what, **facts)


def _wanted(kind: str) -> str:
    for words, wanted in (
        (("float", "int", "finite"), "write a number"),
        (("string",), "write text in quotes"),
        (("list",), "write a list in brackets"),
        (("dict", "model"), 'write a table such as { channel = "time_s", scale = 0.001 }'),
    ):
        if kind.startswith(words):
            return wanted
    return "write a value of the kind that the key has"


def _keys(path: Sequence[str | int]) -> list[str]:
    owner = CampaignFile if len(path) == 1 else Entry if path[0] == "recording" else SourceEntry
    return list(owner.model_fields)


def _owner(path: Sequence[str | int], document: Mapping[str, Any]) -> str:
    """The table in which the key stands, for a sentence."""
    if len(path) >= 2 and path[0] == "recording" and isinstance(path[1], int):
        entry = document["recording"][path[1]]
        file = entry.get("file") if isinstance(entry, dict) else None
        return f"in recording {path[1] + 1}{f' ({quoted(file)})' if isinstance(file, str) else ''}, "
    if len(path) >= 3 and path[0] == "channels":
        return f"in [channels], for {quoted(path[1])}, "
    return ""


def _no_recordings(place: Place) -> ForkliftError:
    return place.error(
        "recordings-missing", "the campaign has no recordings; add a [[recording]] for each file"
    )


def check_rate(rate_hz: float, place: Place, line: int | None = None) -> None:
    """`rate_hz` is a positive number, or ``"sample-rate-out-of-bounds"`` is raised."""
    if not 0.0 < rate_hz < float("inf"):
        raise place.error(
            "sample-rate-out-of-bounds",
            f"sample_rate_hz is {rate_hz:g}; write the sample rate, a positive number of hertz",
            line=line,
            name="sample_rate_hz",
            value=rate_hz,
            lower=0.0,
            unit="Hz",
        )


def _check_channels(found: CampaignFile, place: Place, text: str) -> None:
    first: dict[str, str] = {}
    for name, source in found.channels.items():
        line = line_of(text, ("channels", name))
        at: dict[str, Any] = {"line": line, "channel": source.channel, "column": name}
        if source.channel not in table():
            alike = [one for one in table() if not names_other_lift(one, source.channel)]
            near = get_close_matches(source.channel, alike, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(table())}"
            raise place.error(
                "channel-unknown",
                f"{quoted(name)} is mapped to {quoted(source.channel)}, which is no channel ({hint}); "
                "correct it",
                value=source.channel,
                known=list(table()),
                **at,
            )
        if source.channel in first:
            raise place.error(
                "channel-repeated",
                f"both {quoted(first[source.channel])} and {quoted(name)} are mapped to {source.channel}; "
                "keep one",
                value=[first[source.channel], name],
                **at,
            )
        first[source.channel] = name
        scale, unit = 1.0 if source.scale is None else source.scale, table()[source.channel].unit
        check_scale(name, source.channel, scale, source.offset or 0.0, unit, place, line)
        if name in found.ignore:
            raise place.error(
                "source-ignored",
                f"{quoted(name)} is mapped to {source.channel} and stands in ignore; take it out of one of "
                "them",
                value=name,
                **at,
            )


def check_scale(
    name: str, channel: str, scale: float, offset: float, unit: str, place: Place, line: int | None
) -> None:
    """Scale and offset with which a name stands for a channel are finite, and the scale is not 0.

    Raises
    ------
    ForkliftError
        ``"scale-invalid"``.
    """
    if not 0.0 < abs(scale) < float("inf") or not abs(offset) < float("inf"):
        key, value = ("scale", scale) if abs(offset) < float("inf") else ("offset", offset)
        raise place.error(
            "scale-invalid",
            f"{quoted(name)} is mapped with {key} = {value:g}; write the finite factor (not 0) and "
            f"offset that lead to {unit}",
            name=key,
            value=value,
            unit=unit,
            line=line,
            channel=channel,
            column=name,
        )


def check_files(files: Sequence[str], databases: Sequence[str], place: Place, text: str) -> None:
    """Every one a path below the campaign's folder, and no two recordings' alike but for case or suffix.

    Raises
    ------
    ForkliftError
        ``"path-escapes"``, ``"value-invalid"``, ``"recording-repeated"``; with the line in `text`.
    """
    for database in databases:
        _check_path(database, place, line_of(text, ("dbc",)))
    first: dict[str, str] = {}
    for k, given in enumerate(files):
        _check_path(given, place, line_of(text, ("recording", k, "file")))
        file = normal(given)
        stem = str(PurePosixPath(file).with_suffix("")).casefold()
        if stem in first:
            same = (
                "is listed twice"
                if first[stem] == file
                else f"and {quoted(first[stem])} differ by no more than case or suffix"
            )
            raise place.error(
                "recording-repeated",
                f"{quoted(file)} {same}; results are written by that name, so remove or rename one",
                line=line_of(text, ("recording", k, "file")),
                value=file,
                recording=file,
            )
        first[stem] = file


def _check_entries(found: CampaignFile, place: Place, text: str) -> None:
    check_files([entry.file for entry in found.recording], found.databases, place, text)
    for k, entry in enumerate(found.recording):
        format_of(entry.file)
        file = normal(entry.file)
        if not 0.0 <= entry.load_kg <= HEAVIEST_KG:
            raise place.error(
                "load-out-of-bounds",
                f"in recording {k + 1} ({quoted(file)}), load_kg is {entry.load_kg:g}, outside 0 to "
                f"{HEAVIEST_KG:g} kg; write the mass on the forks in kilograms",
                line=line_of(text, ("recording", k, "load_kg")),
                name="load_kg",
                value=entry.load_kg,
                lower=0.0,
                upper=HEAVIEST_KG,
                unit="kg",
                recording=file,
            )


def is_below(file: str) -> bool:
    """Whether a name leads to nothing outside the folder that it is relative to, on any system."""
    posix, windows = PurePosixPath(file), PureWindowsPath(file)
    outside = posix.is_absolute() or windows.drive or windows.root or ".." in posix.parts or "\\" in file
    return not outside


def _check_path(file: str, place: Place, line: int | None) -> None:
    if not is_below(file):
        raise place.error(
            "path-escapes",
            f"the file {quoted(file)} is not a path below the campaign's folder; put the file there and "
            "write its name, with forward slashes",
            line=line,
            value=file,
        )
    if not PurePosixPath(file).name or not file.isprintable():
        raise place.error(
            "value-invalid",
            f"file is {quoted(file)}; write the name of a file",
            line=line,
            name="file",
            value=file,
        )


_HEADER = re.compile(r"\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?")


def line_of(text: str, path: Sequence[str | int]) -> int | None:
    """The line of a key, else of the table in which it should stand; None if that cannot be told."""
    if '"""' in text or "'''" in text:
        return None
    *tables, key = path
    if path[0] == "channels" and len(path) > 1:
        tables, key = ["channels"], path[1]
    lines, start, end = text.splitlines(), 0, None
    headers = [(k, found[1], found[2]) for k, line in enumerate(lines) if (found := _HEADER.fullmatch(line))]
    if len(path) <= 2 and path[0] == "recording":
        tables, key = list(path), ""
    if tables:
        same = [k for k, _, name in headers if name == tables[0]]
        nth = tables[1] if len(tables) > 1 and isinstance(tables[1], int) else 0
        if nth >= len(same):
            return None
        start = same[nth] + 1
    end = next((k for k, _, _ in headers if k >= start), len(lines))
    pattern = re.compile(rf"""\s*(["']?){re.escape(str(key))}\1\s*=""")
    for k in range(start, end):
        if pattern.match(lines[k]):
            return k + 1
    return start or None
