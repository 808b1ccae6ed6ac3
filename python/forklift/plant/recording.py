"""One recording of a machine: what drove it, and what was measured."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError

Role = Literal["estimate", "validate"]


@dataclass(frozen=True, eq=False)
class Recording:
    """What one recording holds.

    Attributes
    ----------
    file
        Its name.
    time_s
        (n,), increasing [s]; steps may differ.
    u, y
        By name, (n,): inputs, none missing; outputs, NaN where a sample is missing.
    role
        ``"estimate"`` may be fitted on; ``"validate"`` is only ever judged on.
    group
        What belongs together when it is left out: a pressure, a load, a day.
    conditions
        Numbers that describe it, by name.
    rows
        By output on a clock of its own: at which of the times, by their place, it was sampled. One that is
        not named was sampled at all.

    Raises
    ------
    ForkliftError
        ``"recording-invalid"``.
    """

    file: str
    time_s: Floats
    u: Mapping[str, Floats]
    y: Mapping[str, Floats]
    role: Role = "estimate"
    group: str = ""
    conditions: Mapping[str, float] = field(default_factory=dict)
    blocks: int = 1
    """How many stretches of it err independently."""
    rows: Mapping[str, NDArray[np.intp]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = _floats(self.time_s)
        columns = {kind: {name: _floats(values) for name, values in given.items()}
                   for kind, given in (("u", self.u), ("y", self.y))}  # fmt: skip
        self._check_time(time)
        for kind, given in columns.items():
            for name, values in given.items():
                self._check_column(name, values, time, driving=kind == "u")
        for name, checked in (("time_s", time), *columns.items()):
            object.__setattr__(self, name, checked)

    def __len__(self) -> int:
        return len(self.time_s)

    @cached_property
    def sha256(self) -> str:
        """Of its data: times, inputs and outputs by name, as little-endian doubles."""
        digest = hashlib.sha256(self.time_s.astype("<f8").tobytes())
        for kind, columns in (("u", self.u), ("y", self.y)):
            for name in sorted(columns):
                digest.update(f"{kind}:{name}:".encode() + columns[name].astype("<f8").tobytes())
        return digest.hexdigest()

    def between(self, first: int, last: int, file: str, role: Role | None = None) -> Recording:
        """The samples from `first` up to `last`."""
        here = slice(first, last)
        return Recording(
            file,
            self.time_s[here],
            {name: values[here] for name, values in self.u.items()},
            {name: values[here] for name, values in self.y.items()},
            role or self.role,
            self.group,
            self.conditions,
            rows={name: at[(at >= first) & (at < last)] - first for name, at in self.rows.items()},
        )

    def own(self, output: str) -> NDArray[np.intp]:
        """At which of the times an output was sampled, by their place; samples that were lost among them."""
        return self.rows.get(output, np.arange(len(self)))

    def split(self, share: float) -> tuple[Recording, Recording]:
        """The first `share` of it to be fitted on, the rest to be judged on."""
        at = round(share * len(self))
        return (
            self.between(0, at, f"{self.file} up to {100 * share:.0f} %", "estimate"),
            self.between(at, len(self), f"{self.file} from {100 * share:.0f} %", "validate"),
        )

    def _check_time(self, time: Floats) -> None:
        if time.ndim != 1 or len(time) < 2:
            raise self._error(
                f"time_s has the shape {time.shape}, where at least 2 samples in a row are needed; record it "
                "again, or leave it out",
                "time_s",
                value=time.size,
                lower=2,
            )
        wrong = np.flatnonzero(~(np.diff(time) > 0.0))
        if len(wrong):
            at = int(wrong[0]) + 1
            raise self._error(
                f"time_s is {time[at]:.9g} s after {time[at - 1]:.9g} s (sample {at + 1} of {len(time)}); it "
                "must increase from sample to sample, so remove or reorder these samples",
                "time_s",
                sample=at + 1,
                value=float(time[at]),
                lower=float(time[at - 1]),
                unit="s",
            )

    def _check_column(self, name: str, values: Floats, time: Floats, *, driving: bool) -> None:
        if values.shape != time.shape:
            raise self._error(
                f"{name} has samples of shape {values.shape}, where time_s has {time.shape}; give one number "
                "for each time",
                name,
            )
        lost = np.flatnonzero(~np.isfinite(values))
        if driving and len(lost):
            at = int(lost[0])
            raise self._error(
                f"input {name} is {values[at]:g} at {time[at]:.9g} s (sample {at + 1}), the first of "
                f"{len(lost)} that are missing, but must be known at every sample; fill it in, or cut the "
                "recording there",
                name,
                sample=at + 1,
                time_s=float(time[at]),
                count=len(lost),
            )

    def _error(self, what: str, name: str, **facts: float | str) -> ForkliftError:
        message = f"recording {self.file}: {what}"
        return ForkliftError("recording-invalid", message, name=name, file=self.file, **facts)


def _floats(values: ArrayLike) -> Floats:
    return np.array(values, dtype=float)
