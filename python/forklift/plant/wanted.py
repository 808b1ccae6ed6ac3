"""A recording of a plant to be made next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.typeset import number
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.plant.subject import Drive


@dataclass(frozen=True, eq=False)
class WantedRecording:
    """A candidate that was chosen; see `forklift.plant.subject.Wanted`."""

    plant: Plant
    recording: Recording
    why: str

    @property
    def title(self) -> str:
        """Its name."""
        return self.recording.file

    @property
    def settings(self) -> Sequence[tuple[str, str]]:
        """Its conditions."""
        return [(name, number(value)) for name, value in self.recording.conditions.items()]

    @property
    def drives(self) -> tuple[Floats, Sequence[Drive]]:
        """Its inputs, what moves first."""
        u = self.recording.u
        own = [one for one in self.plant.inputs if one.derived is None]
        own.sort(key=lambda one: not np.ptp(u[one.name]))
        return self.recording.time_s, [
            Drive(one.name, one.unit, u[one.name], held=one.hold == "zero") for one in own
        ]

    def write(self, path: str | Path) -> Path:
        """Its inputs as CSV."""
        time, drives = self.drives
        head = ",".join(["time_s", *(one.name for one in drives)])
        table = np.column_stack([time, *(one.values for one in drives)])
        np.savetxt(path, table, fmt="%.9g", delimiter=",", header=head, comments="")
        return Path(path)

    def to_dict(self, command: str) -> dict[str, Any]:
        """Name, conditions and the file of its inputs."""
        return {
            "why": self.why,
            "recording": self.recording.file,
            **self.recording.conditions,
            "command": command,
        }
