"""Many variants of a truck under one command, in lanes and on all cores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forklift import _core
from forklift.base import arguments
from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.simulate import sampled_at
from forklift.plant.forklift.tables import outputs
from forklift.plant.forklift.truck import Truck, truck_of
from forklift.plant.forklift.unknowns import grouped
from forklift.recordings.channels import Lifts

if TYPE_CHECKING:
    import xarray as xr

CONDITIONS = ("load_kg", "oil_temperature_degc")
"""What a case may have of its own, apart from the truck's parameters."""
AT_ONCE = 1024
"""Cases of one call of the core: Ctrl-C is answered between two."""
SUBSTEPS = 8

Cases = Mapping[str, ArrayLike] | Sequence[Mapping[str, float]]


@dataclass(frozen=True, eq=False, repr=False)
class Variants:
    """What `simulate_many` gives: outputs of every case, in SI units, positive upward.

    ``variants["velocity_free_m_s"]`` is one output, (cases, n).

    Attributes
    ----------
    truck, command
        What the cases have in common.
    columns
        What they have of their own: name to (cases,).
    time_s
        (n,) [s].
    outputs
        (cases, n, number of outputs), in the order of `forklift.plant.forklift.tables.outputs`. Not a number
        from where a case runs away, and of a lift that is not simulated.
    finite
        (cases,) whether the case came to the end.
    """

    truck: Truck
    command: Command
    columns: Mapping[str, Floats]
    time_s: Floats
    outputs: Floats
    finite: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.outputs)

    def __getitem__(self, name: str) -> Floats:
        names = list(outputs())
        if name not in names:
            raise ForkliftError(
                "name-unknown", f"there is no output {name}; there are {', '.join(names)}", name=name
            )
        return self.outputs[:, :, names.index(name)]

    @property
    def dataset(self) -> xr.Dataset:
        """Outputs over ``case`` and ``time_s``, and what each case has of its own over ``case``."""
        import xarray as xr

        about = {name: {"units": one["unit"], "long_name": one["meaning"]} for name, one in outputs().items()}
        found = {name: (("case", "time_s"), self[name], about[name]) for name in outputs()}
        own = {name: ("case", values) for name, values in self.columns.items()}
        return xr.Dataset(found, coords={"time_s": ("time_s", self.time_s, {"units": "s"}), **own})

    def __repr__(self) -> str:
        lost = int(np.count_nonzero(~self.finite))
        return (
            f"Variants({self.truck.name!r}, {len(self)} cases of {', '.join(self.columns) or 'nothing'}, "
            f"{len(self.time_s)} samples{f', {lost} ran away' if lost else ''})"
        )


def simulate_many(
    truck: Truck | str | Path,
    cases: Cases,
    command: Command,
    *,
    load_kg: float | None = None,
    oil_temperature_degc: float | None = None,
    lifts: Lifts = "both",
    time: ArrayLike | None = None,
    substeps: int = SUBSTEPS,
) -> Variants:
    """Solve many variants of a truck under one command, from rest: sixteen side by side, on all cores.

    Every case is to the bit what `simulate` gives with ``solver="fixed"`` and as many substeps. It depends
    neither on the other cases nor on the number of threads.

    Parameters
    ----------
    truck
        What the cases have in common: a `Truck`, its name or its file.
    cases
        What each has of its own: a column for each name, (cases,), or a mapping for each case, all of the
        same names. Names are parameters of the truck (of a table its knots, ``"free.valve.table_area.3"``)
        in their units, ``"load_kg"`` [kg] and ``"oil_temperature_degc"`` [°C].
    command
        The currents of both valves, held between their samples.
    load_kg, oil_temperature_degc
        Of all cases, where `cases` has none: mass on the forks [kg], oil temperature [°C] throughout.
    lifts
        ``"both"``, or ``"free"`` or ``"main"`` for one lift alone.
    time
        (n,) [s], strictly increasing, where the outputs are wanted; by default at the command's samples.
    substeps
        Of the fixed-step solver, per sample of the command.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, ``"argument-shape"``; ``"parameter-unknown"`` for a name that the truck has
        not, ``"parameter-out-of-bounds"`` and its like for a case that no truck can be, with ``case``, its
        place. A case that runs away is no error: see `Variants.finite`.
    """
    truck = truck_of(truck)
    arguments.of_kind(Command, command=command)
    given = {"load_kg": load_kg, "oil_temperature_degc": oil_temperature_degc}
    columns = _columns(cases)
    count = len(next(iter(columns.values())))
    loads, degc = (_condition(name, columns, given[name], count) for name in CONDITIONS)
    own = {name: values for name, values in columns.items() if name not in CONDITIONS}
    values = _values(truck, own, count)
    at = sampled_at(time, command)
    arguments.whole("substeps", substeps)
    parts = []
    for first in range(0, count, AT_ONCE):
        some = slice(first, first + AT_ONCE)
        try:
            parts.append(
                _core.simulate_variants(
                    truck.core, values[some], loads[some], degc[some],
                    at, command.time_s, command.currents, lifts=lifts, substeps=substeps,
                )
            )  # fmt: skip
        except ForkliftError as error:
            if error.facts.get("name") == "values":
                _explain(truck, own, first, min(first + AT_ONCE, count))
            raise
        except (TypeError, OverflowError) as error:
            raise ForkliftError(
                "argument-invalid",
                f"an argument of simulate_many is of the wrong kind, shape or size: {error}",
            ) from None
    found = np.concatenate(parts)
    shown = np.isfinite(found[:, 0]).any(axis=0)  # a lift that is not simulated is not a number
    last: Floats = np.asarray(found[:, -1, shown])
    finite: NDArray[np.bool_] = np.asarray(np.isfinite(last.sum(axis=1)))
    return Variants(truck, command, columns, at, found, finite)


def _columns(cases: Cases) -> dict[str, Floats]:
    """Name to (cases,), all finite and of one length."""
    if not isinstance(cases, Mapping):
        rows = list(cases) if isinstance(cases, Sequence) and not isinstance(cases, str) else []
        if not rows or not all(isinstance(row, Mapping) and row.keys() == rows[0].keys() for row in rows):
            raise _wrong("cases must be columns by name, or one or more mappings of the same names each")
        cases = {name: [row[name] for row in rows] for name in rows[0]}
    try:
        found = {str(name): np.array(values, dtype=float) for name, values in cases.items()}
    except (TypeError, ValueError):
        raise _wrong("cases has values that are no numbers; give a number for each case and name") from None
    lengths = {values.shape for values in found.values()}
    if len(lengths) != 1 or len(next(iter(lengths))) != 1 or not next(iter(lengths))[0]:
        shapes = ", ".join(f"{name} {values.shape}" for name, values in found.items()) or "nothing"
        raise _wrong(f"cases has {shapes}; give one or more columns of one length, (cases,)")
    return found


def _condition(name: str, columns: Mapping[str, Floats], given: float | None, count: int) -> Floats:
    if name in columns:
        if given is not None:
            raise _wrong(
                f"{name} is given twice: for all cases and as a column of cases; leave one out", name
            )
        return columns[name]
    if given is None:
        raise _wrong(f"{name} is missing; give it for all cases, or as a column of cases", name)
    return np.full(count, arguments.number(name, given))


def _values(truck: Truck, own: Mapping[str, Floats], count: int) -> Floats:
    """(cases, values) in the core's order."""
    names = truck.core.names
    for name in own:
        if name not in names:
            truck.with_values({name: 0.0})  # says which is near
            raise ForkliftError(
                "parameter-unknown",
                f"{name} stands for an effect or a table that a case cannot add or replace as a whole; give "
                "the truck its effect first, and of a table each knot by its number",
                name=name,
            )
    values = np.tile(truck.core.values, (count, 1))
    for name, column in own.items():
        values[:, names.index(name)] = column
    return values


def _explain(truck: Truck, own: Mapping[str, Floats], first: int, last: int) -> None:
    """The first case that no truck can be, as `Truck.with_values` says it."""
    for case in range(first, last):
        try:
            truck.with_values(grouped(truck, {name: float(column[case]) for name, column in own.items()}))
        except ForkliftError as error:
            sentence = f"case {case}: {error.message[:1].lower()}{error.message[1:]}"
            raise ForkliftError(error.code, sentence, **error.facts | {"case": case}) from None


def _wrong(sentence: str, name: str = "cases") -> ForkliftError:
    return ForkliftError("argument-invalid", sentence, name=name)
