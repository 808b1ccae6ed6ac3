"""A run of a machine of one's own, with its files: what `forklift simulate --machine` gives."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from forklift.base import output
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.sheet import Curve, Curves, Listing, Sheet, Sheeted
from forklift.base.typeset import printed
from forklift.plant.parts import Plant
from forklift.plant.recording import Recording
from forklift.plant.simulate import simulate_plant


@dataclass(frozen=True, eq=False, repr=False)
class PlantSimulation(Sheeted):
    """Inputs and outputs over time.

    Attributes
    ----------
    plant, driven
        The machine, and the recording whose inputs drove it.
    values, present
        Parameters that are not as the plant has them, and the effects that acted.
    outputs
        By name, (times,), without noise.
    """

    plant: Plant
    driven: Recording
    values: Mapping[str, float]
    present: Sequence[str]
    outputs: Mapping[str, Floats]

    def to_polars(self) -> pl.DataFrame:
        """``time_s``, inputs and outputs, a column each."""
        return pl.DataFrame({"time_s": self.driven.time_s, **self.driven.u, **self.outputs})

    def write(self, path: str | Path) -> Path:
        """Write `to_polars` as ``.csv`` or ``.parquet``; whole or not at all.

        Raises
        ------
        ForkliftError
            ``"format-unknown"`` for another suffix, ``"not-writable"``.
        """
        return output.write_table(path, self.to_polars())

    def to_dict(self) -> dict[str, Any]:
        """Values, effects, and of each output its last, least and greatest value, for JSON."""
        time = self.driven.time_s
        return {
            "machine": {"name": self.plant.name, "source": self.plant.source},
            "values": dict(self.values),
            "present": list(self.present),
            "samples": len(time),
            "time_s": [float(time[0]), float(time[-1])],
            "outputs": {
                one.name: {
                    "unit": one.unit,
                    "last": float(self.outputs[one.name][-1]),
                    "least": float(self.outputs[one.name].min()),
                    "greatest": float(self.outputs[one.name].max()),
                }
                for one in self.plant.outputs
            },
        }

    def listing(self) -> Listing:
        """Each output's first, last, least and greatest value."""
        return Listing(
            f"{self.plant.name}, driven by {self.driven.file}",
            ["output", "unit", ">first", ">last", ">least", ">greatest"],
            [
                (one.name, one.unit, *(f"{v:.5g}" for v in (y[0], y[-1], y.min(), y.max())))
                for one in self.plant.outputs
                for y in [self.outputs[one.name]]
            ],
        )

    def sheet(self) -> Sheet:
        """Every output, and every input below them."""
        time = self.driven.time_s
        parts = [(one, self.outputs[one.name]) for one in self.plant.outputs]
        parts += [(one, self.driven.u[one.name]) for one in self.plant.inputs if one.name in self.driven.u]  # type: ignore[misc]
        drawn = [Curve(one.name, printed(one.unit), values) for one, values in parts]
        said = [
            f"{one.name} goes from {y[0]:.4g} to {y[-1]:.4g} {printed(one.unit)}".rstrip()
            + f", between {y.min():.4g} and {y.max():.4g}."
            for one in self.plant.outputs
            for y in [self.outputs[one.name]]
        ]
        return Sheet(
            f"{self.plant.name} driven by {self.driven.file}",
            f"Simulation of {self.plant.name} under the inputs of {self.driven.file}, "
            f"{float(np.ptp(time)):.4g} s",
            said,
            [Curves(self.plant.name, time, drawn)],
            [(self.driven.file, self.driven.sha256)],
            [("effects that act", ", ".join(self.present) or "none")],
        )


def simulated(
    plant: Plant, driven: Recording, values: Mapping[str, float], present: Sequence[str]
) -> PlantSimulation:
    """The plant through a recording's inputs.

    Raises
    ------
    ForkliftError
        As `forklift.simulate_plant`.
    """
    given = {one.name: driven.u[one.name] for one in plant.inputs if one.name in driven.u}
    outputs = simulate_plant(plant, driven.time_s, given, values, present)
    return PlantSimulation(plant, driven, values, present, outputs)


def found(path: str | Path, plant: Plant) -> tuple[dict[str, float], tuple[str, ...]]:
    """Values and effects of a ``parameters.json`` that a fit or a diagnosis wrote, as far as they are the
    plant's own: gains and offsets of sensors are not simulated.

    Raises
    ------
    ForkliftError
        ``"file-unreadable"``.
    """
    try:
        told = json.loads(Path(path).read_text(encoding="utf-8"))
        values = {str(name): float(value) for name, value in told["values"].items()}
        ids = {str(name) for name in told["present"]}
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise ForkliftError(
            "file-unreadable",
            f"{path} is no parameters.json ({type(error).__name__}); name one that forklift fit or diagnose "
            "wrote for this machine",
            file=str(path),
        ) from error
    effects = [one for one in plant.effects if one.id in ids]
    own = {one.name for one in plant.params} | {f"{one.name}.start" for one in plant.states}
    own |= {effect.full(one) for effect in effects for one in effect.params}
    return {name: v for name, v in values.items() if name in own}, tuple(one.id for one in effects)
