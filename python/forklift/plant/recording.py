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
        if len(time) < 2 or not np.all(np.diff(time) > 0.0):
            raise self._error("time must increase, over two samples at least", "time_s")
        for kind, given in columns.items():
            for name, values in given.items():
                if values.shape != time.shape:
                    raise self._error(f"{name} has {values.shape} samples, time {time.shape}", name)
                if kind == "u" and not np.isfinite(values).all():
                    raise self._error(f"input {name} has samples that are missing", name)
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

    def _error(self, what: str, name: str) -> ForkliftError:
        return ForkliftError("recording-invalid", f"recording {self.file}: {what}", name=name, file=self.file)


def _floats(values: ArrayLike) -> Floats:
    return np.array(values, dtype=float)
