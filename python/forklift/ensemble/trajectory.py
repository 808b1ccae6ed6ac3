"""One member's lowering, tick by tick."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from forklift.base import output
from forklift.base.arrays import Floats
from forklift.base.numbers import defined
from forklift.ensemble.members import Members
from forklift.ensemble.tables import verdicts
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.plant.forklift.tables import outputs
from forklift.recordings.channels import LIFTS


@dataclass(frozen=True)
class Trajectory:
    """One member's run: a row a tick, true values, not the sensors'.

    ``speed_LIFT_m_s`` is the forks' lowering speed, downward positive, as requirements and references have
    it.

    Attributes
    ----------
    index
        The member's; None of one that no sweep drew.
    """

    index: int | None
    verdict: str
    varied: Mapping[str, float]
    margins: Mapping[str, float]
    table: pl.DataFrame

    def to_dict(self) -> dict[str, Any]:
        """The member without its trajectory, for JSON."""
        return {
            "index": self.index,
            "verdict": self.verdict,
            "varied": dict(self.varied),
            "margins": {name: defined(value) for name, value in self.margins.items()},
        }

    def write(self, path: str | Path) -> Path:
        """The trajectory as ``.csv`` or ``.parquet``."""
        return output.write_table(path, self.table)

    def __str__(self) -> str:
        varied = [f"{name:>40} {value:>14.6g}" for name, value in self.varied.items()]
        margins = [f"{name:>40} {value:>14.6g}" for name, value in self.margins.items()]
        who = "The member" if self.index is None else f"Member {self.index}"
        head = f"{who} is {self.verdict.replace('_', ' ')}."
        return "\n".join([head, "", "varied", *varied, "", "margins, negative where broken", *margins])


def trajectory(members: Members, values: Floats, stream: int, index: int | None = None) -> Trajectory:
    """The lowering of a member with these values (varied,) and this sequence of noise."""
    run = members.core.trace(values, stream)
    table = pl.DataFrame(
        {"time_s": run["tick_s"] * np.arange(len(run["request"])), "request": run["request"]}
    )
    extra = {name: run["outputs"][:, k] for k, name in enumerate(outputs())}
    for k, lift in enumerate(LIFTS):
        extra[f"speed_{lift}_m_s"] = -FORKS_PER_SENSOR[lift] * extra[f"velocity_{lift}_m_s"]
        extra[f"reference_{lift}_m_s"] = run["reference"][:, k]
        extra[f"current_{lift}_a"] = run["current"][:, k]
    names = [require.name for require in members.specification.require]
    return Trajectory(
        index,
        list(verdicts())[run["verdict"]],
        {name: float(x) for name, x in zip(members.specification.vary, values, strict=True)},
        {name: float(x) for name, x in zip(names, run["numbers"], strict=False)},
        table.with_columns(**{k: pl.Series(v) for k, v in extra.items()}),
    )
