"""One recording of a campaign."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.plotted import Line, Plotted
from forklift.recordings import checks
from forklift.recordings.channels import COMMANDS, REQUIRED, TIME, Lifts, table
from forklift.recordings.clocks import TIME_SUFFIX, Rows, Sampled, nearest
from forklift.recordings.formats.signals import Place

if TYPE_CHECKING:
    import polars as pl
    import xarray as xr

Role = Literal["estimate", "validate"]
HEAVIEST_KG = 10_000.0
"""The largest rated capacity of the trucks that EN 1726-1:1998 is about [kg]."""


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Plotted):
    """What was commanded and measured in one run, in SI units, and what was entered about it.

    ``recording["pressure_free_pa"]`` is one channel. Two recordings are equal if they hold the same, from
    whatever file.

    Attributes
    ----------
    file
        Its name in the campaign, with forward slashes.
    lift
        Which valves are commanded.
    load_kg
        Mass on the forks as entered [kg].
    role
        ``"estimate"`` may be fitted on; ``"validate"`` is only ever judged on.
    time_s
        (n,), strictly increasing [s]: all instants at which any channel has a sample.
    channels
        Name to (n,) samples, NaN where one is missing; the commanded currents have none missing. Units and
        meanings: `forklift.recordings.channels.table`.
    sha256
        Of the file as it was read; of the CSV file `to_csv` gives, if there was none.
    format
        Of that file: ``"csv"``, ``"parquet"``, ``"mat"``, ``"mdf4"``, ``"can"``; ``"memory"`` if there was
        none.
    rows
        Name to the rows at which a channel on a clock of its own was sampled, in increasing order; a channel
        that is not named was sampled at every row. Between its rows a measurement is NaN and a commanded
        current is held, whose rows hold the first and the last.

    Raises
    ------
    ForkliftError
        ``"lift-unknown"``, ``"role-unknown"``, ``"value-invalid"`` or ``"load-out-of-bounds"``;
        ``"channel-unknown"``, ``"column-missing"`` or ``"lengths-differ"``; and what
        `forklift.recordings.checks` says of times that are missing, too few or do not increase.
    """

    file: str
    lift: Lifts
    load_kg: float
    role: Role
    time_s: Floats
    channels: Mapping[str, Floats]
    sha256: str = ""
    format: str = "memory"
    rows: Mapping[str, Rows] = field(default_factory=dict)

    @property
    def group(self) -> str:
        """What it belongs together with: the recordings of the same lift."""
        return self.lift

    @property
    def blocks(self) -> int:
        """How many stretches of it err independently."""
        return 1

    def __post_init__(self) -> None:
        self._check_entered()
        time = _frozen(self.time_s)
        known = table()
        given = {name: _frozen(values) for name, values in self.channels.items()}
        for name in given:
            if name not in known or name == TIME:
                raise self._error("channel-unknown", f"there is no channel {name}", name)
        for name in REQUIRED[1:]:
            if name not in given:
                raise self._error(
                    "column-missing", f"channel {name} is missing, which every recording has", name
                )
        for name, values in given.items():
            if values.shape != time.shape or time.ndim != 1:
                raise self._error(
                    "lengths-differ", f"{name} has the shape {values.shape}, {TIME} has {time.shape}", name
                )
        place = Place(self.file, self.file)
        checks.length(place, len(time))
        checks.samples(place, TIME, time)
        checks.increasing(place, time)
        ordered = {name: given[name] for name in known if name in given}
        object.__setattr__(self, "time_s", time)
        object.__setattr__(self, "channels", MappingProxyType(ordered))
        object.__setattr__(self, "rows", MappingProxyType(self._own_rows()))
        if not self.sha256:
            object.__setattr__(self, "sha256", hashlib.sha256(self.to_csv().encode()).hexdigest())

    def __getitem__(self, name: str) -> Floats:
        if name == TIME:
            return self.time_s
        if name not in self.channels:
            raise self._error(
                "column-missing",
                f"the recording has no channel {name}; it has {', '.join((TIME, *self.channels))}",
                name,
            )
        return self.channels[name]

    def __contains__(self, name: object) -> bool:
        return name == TIME or name in self.channels

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def on_one_clock(self) -> bool:
        """Whether all channels were sampled at all instants."""
        return not self.rows

    def rows_of(self, name: str) -> Rows:
        """The rows at which the channel was sampled, samples that are missing among them."""
        return self.rows[name] if name in self.rows else np.arange(len(self))

    def own(self, name: str) -> Sampled:
        """The channel's own samples at its own instants, as the logger has them."""
        if name not in self.rows:
            return Sampled(self.time_s, self[name])
        return Sampled(self.time_s[self.rows[name]], self[name][self.rows[name]])

    @property
    def command(self) -> Floats:
        """(n, 2), the commanded currents of free and main lift [A]."""
        return np.column_stack([self.channels[name] for name in COMMANDS])

    @property
    def commanded(self) -> tuple[Floats, Floats]:
        """Instants at which a commanded current was sampled (m,) [s], and both currents there (m, 2) [A]."""
        if not any(name in self.rows for name in COMMANDS):
            return self.time_s, self.command
        at = np.unique(np.concatenate([self.rows_of(name) for name in COMMANDS]))
        return self.time_s[at], self.command[at]

    def thinned(self, names: Iterable[str]) -> Recording:
        """The recording at an even pace, for a look at several channels at once; itself if on one clock.

        The pace is that of the slowest of these channels; of every channel the nearest sample stands there,
        unchanged. Noise, counts and a model are never taken from it.
        """
        steps = [
            self.own(name).step_s for name in names if name in self.channels and len(self.own(name).time) > 2
        ]
        if self.on_one_clock or not steps:
            return self
        at = np.arange(self.time_s[0], self.time_s[-1], max(steps))
        held = np.searchsorted(self.time_s, at, side="right") - 1
        channels = {
            name: values[held] if name in COMMANDS else nearest(at, self.own(name))
            for name, values in self.channels.items()
        }
        given = (self.file, self.lift, self.load_kg, self.role, at, channels, self.sha256, self.format)
        return Recording(*given)

    @property
    def duration_s(self) -> float:
        """From the first sample to the last [s]."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def sample_rate_hz(self) -> float:
        """The mean sample rate [Hz]."""
        return (len(self) - 1) / self.duration_s

    def rate_hz(self, name: str) -> float:
        """The mean rate of the channel's own samples [Hz]."""
        time = self.own(name).time
        return (len(time) - 1) / float(time[-1] - time[0]) if len(time) > 1 else self.sample_rate_hz

    def to_polars(self) -> pl.DataFrame:
        """A column each for time and channels; a missing sample is null."""
        import polars as pl

        return pl.DataFrame({TIME: self.time_s, **self.channels}).fill_nan(None)

    def to_csv(self) -> str:
        """The recording as a CSV file holds it: every number reads back the same, to the bit.

        A channel on a clock of its own stands after a column of its times, ``NAME.time_s``; the shorter
        columns end in empty cells. One that has no sample is left out.
        """
        import polars as pl

        if self.on_one_clock:
            return self.to_polars().write_csv()
        first = self.own(COMMANDS[0])
        columns = {TIME: first.time, COMMANDS[0]: first.values}
        for name in self.channels:
            own = self.own(name)
            if name == COMMANDS[0] or not len(own.time):
                continue
            if not np.array_equal(own.time, first.time):
                columns[name + TIME_SUFFIX] = own.time
            columns[name] = own.values
        longest = max(len(column) for column in columns.values())
        full = {
            name: np.append(column, np.full(longest - len(column), np.nan))
            for name, column in columns.items()
        }
        return pl.DataFrame(full).fill_nan(None).write_csv()

    def to_xarray(self) -> xr.Dataset:
        """Channels over ``time_s`` with ``units`` and ``long_name``, and what was entered as attributes."""
        import xarray as xr

        known = table()
        about = {name: {"units": row.unit, "long_name": row.meaning} for name, row in known.items()}
        return xr.Dataset(
            {name: (TIME, values, about[name]) for name, values in self.channels.items()},
            coords={TIME: (TIME, self.time_s, about[TIME])},
            attrs={
                "file": self.file,
                "lift": self.lift,
                "load_kg": self.load_kg,
                "role": self.role,
                "format": self.format,
                "sha256": self.sha256,
            },
        )

    def to_dict(self) -> dict[str, Any]:
        """What was entered, and of each channel its unit, range and number of missing samples, for JSON."""
        return {
            "file": self.file,
            "lift": self.lift,
            "load_kg": self.load_kg,
            "role": self.role,
            "format": self.format,
            "sha256": self.sha256,
            "samples": len(self),
            "clocks": len({self.own(name).time.tobytes() for name in self.channels}),
            "duration_s": self.duration_s,
            "sample_rate_hz": self.sample_rate_hz,
            "channels": {name: self._summary(name) for name in self.channels},
        }

    def heading(self) -> str:
        """Its file, and what was entered."""
        return f"{self.file}: {self.lift} lift, {self.load_kg:g} kg, {self.role}"

    def lines(self) -> list[Line]:
        """Every channel at its own instants, the commanded currents last."""
        known = table()
        drives = [name for name in self.channels if name in COMMANDS]
        return [
            Line(name, known[name].unit, own.time, own.values,
                 "command" if name in COMMANDS else "measured")
            for name in (*(name for name in self.channels if name not in COMMANDS), *drives)
            for own in [self.own(name)]
        ]  # fmt: skip

    def _summary(self, name: str) -> dict[str, Any]:
        own = self.own(name)
        values = own.values
        finite = values[np.isfinite(values)]
        return {
            "unit": table()[name].unit,
            "samples": len(values),
            "sample_rate_hz": float(f"{1.0 / own.step_s:.6g}") if own.step_s else None,
            "missing": len(values) - len(finite),
            "least": float(finite.min()) if finite.size else None,
            "greatest": float(finite.max()) if finite.size else None,
        }

    @cached_property
    def content_sha256(self) -> str:
        """SHA-256 of everything that makes two recordings equal."""
        entered = (self.file, self.lift, float(self.load_kg), self.role, len(self), tuple(self.channels))
        digest = hashlib.sha256(repr(entered).encode())
        for values in (self.time_s, *self.channels.values()):
            digest.update(np.where(np.isnan(values), np.nan, values + 0.0).astype("<f8").tobytes())
        for name, rows in self.rows.items():
            digest.update(name.encode() + rows.astype("<i8").tobytes())
        return digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return self.content_sha256 == other.content_sha256 if isinstance(other, Recording) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.content_sha256)

    def __reduce__(self) -> tuple[Any, ...]:
        given = (self.file, self.lift, self.load_kg, self.role, self.time_s, dict(self.channels))
        return (Recording, (*given, self.sha256, self.format, dict(self.rows)))

    def __repr__(self) -> str:
        names = ", ".join(self.channels)
        return (
            f"Recording({self.file!r}, {self.lift} lift, {self.load_kg:g} kg, {self.role}, "
            f"{len(self)} samples in {self.duration_s:g} s; {names})"
        )

    def _check_entered(self) -> None:
        """Lift, role and load are such as ``campaign.toml`` may hold."""
        for name, value, known in (("lift", self.lift, get_args(Lifts)), ("role", self.role, get_args(Role))):
            if value not in known:
                raise ForkliftError(
                    f"{name}-unknown",
                    f"{self.file}: {name} is {value!r}; give {' or '.join(map(repr, known))}",
                    file=self.file,
                    name=name,
                    value=value,
                    known=list(known),
                )
        if not isinstance(self.load_kg, Real):
            raise ForkliftError(
                "value-invalid",
                f"{self.file}: load_kg is {self.load_kg!r}; give a number of kilograms",
                file=self.file,
                name="load_kg",
                value=self.load_kg,
            )
        if not 0.0 <= self.load_kg <= HEAVIEST_KG:
            raise ForkliftError(
                "load-out-of-bounds",
                f"{self.file}: load_kg is {self.load_kg:g}, outside 0 to {HEAVIEST_KG:g} kg; give the mass "
                "on the forks in kilograms",
                file=self.file,
                name="load_kg",
                value=self.load_kg,
                lower=0.0,
                upper=HEAVIEST_KG,
                unit="kg",
            )

    def _own_rows(self) -> dict[str, Rows]:
        """`rows` without those that are all rows, checked, in the channels' order."""
        found = {}
        for name in self.rows:
            if name not in self.channels:
                raise self._error("channel-unknown", f"rows are given of {name}, which is not there", name)
        for name, values in self.channels.items():
            if name not in self.rows:
                continue
            rows = np.array(self.rows[name], dtype=np.intp)
            inside = rows.ndim == 1 and (not len(rows) or (rows[0] >= 0 and rows[-1] < len(values)))
            if not inside or np.any(np.diff(rows) <= 0):
                raise self._error(
                    "lengths-differ", f"the rows of {name} are not increasing places among its samples", name
                )
            if len(rows) < len(values):
                rows.setflags(write=False)
                found[name] = rows
        return found

    def _error(self, code: str, sentence: str, channel: str) -> ForkliftError:
        return ForkliftError(code, f"{self.file}: {sentence}", file=self.file, channel=channel)


def _frozen(values: Any) -> Floats:
    copy = np.array(values, dtype=np.float64)
    copy.setflags(write=False)
    return copy
