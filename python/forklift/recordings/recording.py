"""One recording of a campaign."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.recordings.channels import COMMANDS, REQUIRED, TIME, Lifts, table

if TYPE_CHECKING:
    import polars as pl
    import xarray as xr

Role = Literal["estimate", "validate"]


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
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
        (n,), strictly increasing [s].
    channels
        Name to (n,) samples, NaN where one is missing; the commanded currents have none missing. Units and
        meanings: `forklift.recordings.channels.table`.
    sha256
        Of the file as it was read; of the CSV file `to_csv` gives, if there was none.
    format
        Of that file: ``"csv"``, ``"parquet"``, ``"mat"``, ``"mdf4"``; ``"memory"`` if there was none.

    Raises
    ------
    ForkliftError
        ``"channel-unknown"``, ``"column-missing"`` or ``"lengths-differ"``.
    """

    file: str
    lift: Lifts
    load_kg: float
    role: Role
    time_s: Floats
    channels: Mapping[str, Floats]
    sha256: str = ""
    format: str = "memory"

    @property
    def group(self) -> str:
        """What it belongs together with: the recordings of the same lift."""
        return self.lift

    @property
    def blocks(self) -> int:
        """How many stretches of it err independently."""
        return 1

    def __post_init__(self) -> None:
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
        ordered = {name: given[name] for name in known if name in given}
        object.__setattr__(self, "time_s", time)
        object.__setattr__(self, "channels", MappingProxyType(ordered))
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
    def command(self) -> Floats:
        """(n, 2), the commanded currents of free and main lift [A]."""
        return np.column_stack([self.channels[name] for name in COMMANDS])

    @property
    def duration_s(self) -> float:
        """From the first sample to the last [s]."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def sample_rate_hz(self) -> float:
        """The mean sample rate [Hz]."""
        return (len(self) - 1) / self.duration_s

    def to_polars(self) -> pl.DataFrame:
        """A column each for time and channels; a missing sample is null."""
        import polars as pl

        return pl.DataFrame({TIME: self.time_s, **self.channels}).fill_nan(None)

    def to_csv(self) -> str:
        """The recording as a CSV file holds it: every number reads back the same, to the bit."""
        return self.to_polars().write_csv()

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
            "duration_s": self.duration_s,
            "sample_rate_hz": self.sample_rate_hz,
            "channels": {name: self._summary(name) for name in self.channels},
        }

    def _summary(self, name: str) -> dict[str, Any]:
        values = self.channels[name]
        finite = values[np.isfinite(values)]
        return {
            "unit": table()[name].unit,
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
        return digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return self.content_sha256 == other.content_sha256 if isinstance(other, Recording) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.content_sha256)

    def __reduce__(self) -> tuple[Any, ...]:
        given = (self.file, self.lift, self.load_kg, self.role, self.time_s, dict(self.channels))
        return (Recording, (*given, self.sha256, self.format))

    def __repr__(self) -> str:
        names = ", ".join(self.channels)
        return (
            f"Recording({self.file!r}, {self.lift} lift, {self.load_kg:g} kg, {self.role}, "
            f"{len(self)} samples in {self.duration_s:g} s; {names})"
        )

    def _error(self, code: str, sentence: str, channel: str) -> ForkliftError:
        return ForkliftError(code, f"{self.file}: {sentence}", file=self.file, channel=channel)


def _frozen(values: Any) -> Floats:
    copy = np.array(values, dtype=np.float64)
    copy.setflags(write=False)
    return copy
