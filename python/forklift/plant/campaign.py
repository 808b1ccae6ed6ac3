"""A machine of one's own from its file, and its recordings from a folder: what the commands need.

The machine's file is Python, with a `Plant` called ``machine``. The recordings stand in a folder with a
``campaign.toml``::

    name = "bench"

    [channels]                      # names in the files that are not the machine's own; units that differ
    "Valve current" = "u"
    y = { channel = "y", unit = "mm" }

    [[recording]]
    file = "steps.csv"              # CSV, Parquet, MAT, MDF4; a CAN log with `dbc = "bus.dbc"` at the top
    role = "estimate"               # or "validate", only ever judged on
    group = "cold"                  # optional: what is left out together
    conditions = { load = 800.0 }   # optional: numbers that describe it
"""

from __future__ import annotations

import runpy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, FiniteFloat, ValidationError

from forklift.base import output, toml
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.malformed import first_wrong
from forklift.plant.calls import line_in
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.recordings import checks, formats, units
from forklift.recordings.campaign_file import check_files, check_scale, line_of
from forklift.recordings.channels import TIME
from forklift.recordings.clocks import EVEN, SAME_INSTANT_S, Rows, Sampled, union
from forklift.recordings.formats.signals import Place, Series

FILE = output.CAMPAIGN
NAME = "machine"
"""What the plant is called in the machine's file."""
TIMES = ("time_s", "time", "t", "Time", "time [s]")
"""Names that a file's time [s] may have."""
_STRICT = ConfigDict(extra="forbid", strict=True, frozen=True)


class _Source(BaseModel):
    """Where a channel comes from."""

    model_config = _STRICT
    channel: str
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0


class _Entry(BaseModel):
    """One recording."""

    model_config = _STRICT
    file: str
    role: Literal["estimate", "validate"] = "estimate"
    group: str = ""
    conditions: dict[str, FiniteFloat] = {}


class _Document(BaseModel):
    """The whole file."""

    model_config = _STRICT
    name: str = ""
    dbc: str | list[str] = []
    channels: dict[str, _Source | str] = {}
    recording: list[_Entry]


@dataclass(frozen=True)
class PlantCampaign:
    """Recordings of a machine of one's own.

    Attributes
    ----------
    name
        As in ``campaign.toml``; else the folder's.
    folder
        Where they were read from.
    recordings
        In the order of ``campaign.toml``.
    """

    name: str
    folder: Path
    recordings: tuple[Recording, ...]


def machine(path: str | Path) -> Plant:
    """The plant that a Python file calls ``machine``.

    Raises
    ------
    ForkliftError
        ``"machine-missing"`` if there is no such file, ``"machine-invalid"`` if it fails or has no plant of
        that name.
    """
    path = Path(path)
    if not path.is_file():
        raise ForkliftError(
            "machine-missing", f"there is no file {path}; name a Python file with a machine", file=str(path)
        )
    try:
        found = runpy.run_path(str(path)).get(NAME)
    except ForkliftError:
        raise
    except (Exception, SystemExit) as error:
        line = error.lineno if isinstance(error, SyntaxError) else line_in(error, str(path))
        where = f", line {line}" if line else ""
        raise ForkliftError(
            "machine-invalid",
            f"{path}{where}: the file fails with {type(error).__name__} ({error}); correct it",
            file=str(path),
            line=line,
        ) from error
    if not isinstance(found, Plant):
        what = "nothing" if found is None else f"a {type(found).__name__}"
        raise ForkliftError(
            "machine-invalid",
            f"{path}: {what} is called {NAME}, where a forklift.Plant is expected; write {NAME} = Plant(...)",
            file=str(path),
        )
    return found


def read(folder: str | Path, plant: Plant) -> PlantCampaign:
    """The recordings of a folder with the machine's own inputs and outputs, in the machine's units.

    Raises
    ------
    ForkliftError
        ``"campaign-missing"``, ``"campaign-syntax"``, ``"campaign-invalid"``, ``"path-escapes"``,
        ``"value-invalid"``, ``"recording-repeated"``, ``"channel-unknown"``, ``"scale-invalid"``,
        ``"source-missing"``; of a file ``"column-missing"``, ``"column-repeated"``, ``"unit-unknown"``,
        ``"unit-of-another-kind"``, ``"sample-missing"``, ``"value-infinite"`` or ``"time-not-increasing"`` of
        its times, ``"lengths-differ"``, ``"time-not-common"``; those of `forklift.recordings.formats.read`
        and of `Recording`.
    """
    folder = Path(folder)
    path = folder if folder.name == FILE else folder / FILE
    document, text = _document(path)
    place = Place(path.name, str(path))
    known = {one.name: one.unit for one in plant.inputs} | {one.name: one.unit for one in plant.outputs}
    sources = {
        name: _Source(channel=found) if isinstance(found, str) else found
        for name, found in document.channels.items()
    }
    for name, source in sources.items():
        if source.channel not in known:
            raise ForkliftError(
                "channel-unknown",
                f"{path}: in [channels], {name!r} stands for {source.channel!r}, which {plant.name} does not "
                f"have; it has {', '.join(known)}",
                file=str(path),
                channel=source.channel,
            )
        line = line_of(text, ("channels", name))
        check_scale(name, source.channel, source.scale, source.offset, known[source.channel], place, line)
    databases = (document.dbc,) if isinstance(document.dbc, str) else tuple(document.dbc)
    check_files([entry.file for entry in document.recording], databases, place, text)
    chosen = _Chosen(known, sources, _derived(plant))
    recordings = tuple(
        _recording(path.parent, entry, plant, chosen, databases) for entry in document.recording
    )
    if missing := [name for name in sources if name not in chosen.found]:
        raise ForkliftError(
            "source-missing",
            f"{path}: no recording has {missing[0]!r}, which [channels] maps; correct its name, or remove it",
            file=str(path),
            name=missing[0],
        )
    return PlantCampaign(document.name or path.parent.resolve().name, path.parent, recordings)


def inputs(path: str | Path, plant: Plant) -> Recording:
    """What drives the plant, from one file of any format, with the machine's own names and units.

    Raises
    ------
    ForkliftError
        As `read` of one file.
    """
    path = Path(path)
    known = {one.name: one.unit for one in plant.inputs} | {one.name: one.unit for one in plant.outputs}
    return _recording(path.parent, _Entry(file=path.name), plant, _Chosen(known, {}, _derived(plant)))


def _derived(plant: Plant) -> frozenset[str]:
    return frozenset(one.name for one in plant.inputs if one.derived)


def _document(path: Path) -> tuple[_Document, str]:
    """What the file says, and its text."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ForkliftError(
            "campaign-missing",
            f"there is no {path}; name a folder with a campaign.toml, which lists its recordings",
            file=str(path),
        ) from error
    try:
        text = data.decode("utf-8-sig")
        return _Document.model_validate(toml.loads(text)), text
    except ValidationError as error:
        wrong = first_wrong(error, _Document)
        raise ForkliftError(
            "campaign-invalid", f"{path}: {wrong.sentence}", file=str(path), name=wrong.name
        ) from error
    except (ValueError, RecursionError) as error:
        raise ForkliftError(
            "campaign-syntax", f"{path}: this is not TOML ({error}); correct it", file=str(path)
        ) from error


@dataclass
class _Chosen:
    """Which of a file's names stand for a channel of the machine, or for its time.

    Attributes
    ----------
    known
        The machine's channels, each with its unit.
    sources
        What ``[channels]`` says.
    derived
        Of the channels, inputs that are computed: a time is no such input.
    found
        Of the sources, the names that a file had.
    """

    known: Mapping[str, str]
    sources: Mapping[str, _Source]
    derived: frozenset[str] = frozenset()
    found: set[str] = field(default_factory=set)

    def __call__(self, names: Sequence[str]) -> list[str]:
        return [name for name in dict.fromkeys(names) if name in TIMES or self.source(name) is not None]

    def source(self, name: str) -> _Source | None:
        """Where a name leads: as it is mapped, else to the channel that it names, with a unit in brackets."""
        if name in self.sources:
            self.found.add(name)
            return self.sources[name]
        plain = units.without_brackets(name)
        if name in TIMES and plain in self.derived:
            return None
        return _Source(channel=plain) if plain in self.known else None


def _recording(
    folder: Path, entry: _Entry, plant: Plant, chosen: _Chosen, databases: Sequence[str] = ()
) -> Recording:
    """Every channel at its own instants: outputs are missing between theirs, inputs held or joined.

    Of inputs on several clocks, from when all are known until the first of them ends.
    """
    dbc = tuple(str(folder / name) for name in databases)
    place = Place(entry.file, str(folder / entry.file), dbc=dbc)
    signals, _ = formats.read(place, chosen)
    place = replace(place, lines=signals.lines)
    columns: dict[str, Sampled] = {}
    for name, series in signals.series.items():
        source = chosen.source(name)
        if source is None:
            continue
        if source.channel in columns:
            raise place.error(
                "column-repeated",
                f"two names stand for {source.channel}, {name!r} the second of them; map or keep one",
                column=name,
                channel=source.channel,
            )
        own = series.time if series.time is not None else _time(place, signals.series, chosen)
        checks.lengths(place, source.channel, series.values, own)
        checks.samples(place, TIME, own)
        checks.increasing(place, own, TIME if series.time is None else source.channel)
        values = _in_unit(place, name, series, source, chosen.known[source.channel])
        columns[source.channel] = Sampled(own, values)
    for one in plant.inputs:
        if one.name not in columns and one.derived is None:
            raise place.error(
                "column-missing",
                f"there is no column for the input {one.name} of {plant.name}; the file has "
                f"{', '.join(signals.series) or 'none of its channels'}. Map one to it below [channels]",
                channel=one.name,
            )
    time, values_of, rows = _together(place, plant, columns)
    u = {one.name: values_of[one.name] for one in plant.inputs if one.name in columns}
    y = {one.name: values_of[one.name] for one in plant.outputs if one.name in values_of}
    return Recording(entry.file, time, u, y, entry.role, entry.group, entry.conditions, rows=rows)


def _together(
    place: Place, plant: Plant, columns: Mapping[str, Sampled]
) -> tuple[Floats, dict[str, Floats], dict[str, Rows]]:
    """Times, the columns at all of them, and the rows of outputs that are on a clock of their own."""
    clocks = [one.time for one in columns.values()]
    if all(np.array_equal(clocks[0], time) for time in clocks):
        time = clocks[0] if clocks else np.zeros(0)
        return time, {name: one.values for name, one in columns.items()}, {}
    inputs = [one for one in plant.inputs if one.name in columns]
    slack = min(SAME_INSTANT_S, EVEN * min(one.step_s or 1.0 for one in columns.values()))
    since, found, own = union(place, columns, [one.name for one in inputs], slack)
    begins = [float(columns[one.name].time[0]) for one in inputs]
    time = since + (max(begins) if begins else min(float(clock[0]) for clock in clocks))
    for one in inputs:
        if one.hold == "linear":
            found[one.name] = np.interp(time, columns[one.name].time, columns[one.name].values)
    outputs = {one.name for one in plant.outputs}
    return time, found, {name: r for name, r in own.items() if name in outputs and len(r) < len(time)}


def _time(place: Place, series: Mapping[str, Series], chosen: _Chosen) -> Floats:
    """Of the first name for a time that stands for no channel; else the longest clock of a channel's own."""
    for name in TIMES:
        if name in series and chosen.source(name) is None:
            return np.asarray(series[name].values, float)
    own = [one.time for one in series.values() if one.time is not None]
    if own:
        return np.asarray(max(own, key=len), float)
    free = [name for name in TIMES if name not in {*chosen.known, *chosen.sources}]
    raise place.error(
        "column-missing", f"there is no time; name a column {' or '.join(free[:2])} [s]", channel=TIME
    )


def _in_unit(place: Place, name: str, series: Series, source: _Source, to: str) -> Floats:
    """Values in the machine's unit: by the unit stated in the file or for it, else by scale and offset.

    A scale or an offset takes the place of the file's unit, and of none that stands beside it.
    """
    values = source.scale * series.values + source.offset
    scaled = (source.scale, source.offset) != (1.0, 0.0)
    unit = source.unit or ("" if scaled else series.unit or units.in_brackets(name))
    if units.says_nothing(unit):
        return values
    linear = units.conversion(unit, "dimensionless" if to == "1" else to, exact=True)
    if linear is None:
        raise place.error(
            "unit-of-another-kind" if units.known(unit) else "unit-unknown",
            f"{name} is in {unit}, which does not convert to {to}; state another unit, or a scale, below "
            "[channels]",
            channel=source.channel,
            value=unit,
        )
    return linear.scale * values + linear.offset
