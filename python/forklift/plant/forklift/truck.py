"""A truck: the parameters of both lifts, checked by the core, each with its source."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import isfinite
from pathlib import Path
from types import MappingProxyType
from typing import Any

from forklift import _core
from forklift.base import arguments, output, present
from forklift.base.cell import Cell, Celled
from forklift.base.errors import ForkliftError
from forklift.base.sheet import Listed, Listing
from forklift.plant.forklift import truck_file
from forklift.plant.forklift.tables import parameters
from forklift.plant.forklift.truck_file import Value
from forklift.recordings.channels import LIFTS

SHIPPED = Path(__file__).parent / "trucks"


@dataclass(frozen=True, eq=False, repr=False)
class Truck(Listed, Celled):
    """The parameters of both lifts of a truck, immutable and checked against the core's tables.

    `Truck.read` makes one. Names are full (``"free.viscosity.nu_0"``), values in the SI units of
    `forklift.plant.forklift.tables.parameters`; the two knots tables ``valve.table_current`` and
    ``valve.table_area`` are tuples. Two trucks are equal if their values are.

    Raises
    ------
    ForkliftError
        ``"parameter-unknown"``, ``"parameter-missing"``, ``"parameter-out-of-bounds"``,
        ``"parameter-not-a-number"``, ``"table-length"`` or ``"table-not-rising"``.
    """

    name: str
    values: Mapping[str, Value]
    sources: Mapping[str, str] = field(default_factory=dict)
    origin: str = "Python"
    """Where the values come from: ``"shipped"``, a file, or ``"Python"``."""

    def __post_init__(self) -> None:
        values = {name: _number(name, value) for name, value in self.values.items()}
        object.__setattr__(self, "core", _core.Truck(values))
        names = sorted(values, key=_places().__getitem__)
        object.__setattr__(self, "values", MappingProxyType({name: values[name] for name in names}))
        sources = {name: self.sources.get(name, "set in Python") for name in names}
        object.__setattr__(self, "sources", MappingProxyType(sources))

    core: _core.Truck = field(init=False)
    """The same truck as the core holds it."""

    @classmethod
    def read(cls, name_or_path: str | Path) -> Truck:
        """The shipped truck of this name (``"thesis"``), or the truck in a TOML file.

        A name without a folder and without ``.toml`` is a shipped truck's. The layout of a file is the
        shipped ``trucks/thesis.toml``'s; every parameter of both lifts must be there, with a source.

        Raises
        ------
        ForkliftError
            ``"truck-unknown"``, ``"file-unreadable"``, ``"toml-syntax"``, ``"parameter-malformed"``,
            ``"parameter-unit"`` and those of the class, with ``file`` and, if known, ``line``.
        """
        arguments.path("name_or_path", name_or_path)
        path, origin = _locate(name_or_path)
        found = truck_file.read(path)
        try:
            return cls(found.name, found.values, found.sources, origin)
        except ForkliftError as error:
            name = error.facts.get("name")
            line = truck_file.line_of(found.text, name) if isinstance(name, str) else None
            raise ForkliftError(
                error.code,
                f"{truck_file.where(path, line)}: {error.message[:1].lower()}{error.message[1:]}",
                **error.facts | {"file": str(path), "line": line},
            ) from None

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects beyond the thesis's model whose parameters the truck gives."""
        return tuple(self.core.effects)

    @cached_property
    def sha256(self) -> str:
        """A hash of the values, to the bit, and of nothing else."""
        text = json.dumps({name: self.values[name] for name in sorted(self.values)}, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    def with_values(
        self, values: Mapping[str, float | Sequence[float]], *, source: str = "set in Python"
    ) -> Truck:
        """Another truck with some values replaced or, for an effect's parameters, added.

        Parameters
        ----------
        values
            By full name, e.g. ``{"free.friction.sigma_2": 4000.0}``, in the core's units.
        source
            Where the new values come from.
        """
        sources = dict(self.sources) | dict.fromkeys(values, source)
        merged = {**self.values, **{name: _number(name, value) for name, value in values.items()}}
        return Truck(self.name, merged, sources)

    def facts(self) -> dict[str, Any]:
        """Name, origin, hash and effects: what a result says of a truck it was made with."""
        return {
            "name": self.name,
            "origin": self.origin,
            "sha256": self.sha256,
            "effects": list(self.effects),
        }

    def write(self, path: str | Path) -> Path:
        """Write the TOML file that `Truck.read` reads back equal; whole or not at all.

        Raises
        ------
        ForkliftError
            ``"not-writable"``; ``"output-exists"`` if something else than a truck stands there.
        """
        output.check_alike(path, "truck", truck_file.read)
        return output.write_file(
            path, lambda temporary: truck_file.write(temporary, self.name, self.values, self.sources)
        )

    def to_dict(self) -> dict[str, Any]:
        """The truck as plain data, for JSON."""
        return self.facts() | {
            "parameters": {
                name: {
                    "value": list(value) if isinstance(value, tuple) else value,
                    "unit": parameters()[name]["unit"],
                    "source": self.sources[name],
                }
                for name, value in self.values.items()
            },
        }

    def listing(self) -> Listing:
        """Every parameter with symbol, value, unit and source."""
        return Listing(
            f"Truck {self.name} ({self.origin}, sha256 {self.sha256[:12]})",
            ["parameter", "symbol", ">value", "unit", "source"],
            [
                (name, spec["symbol"], _shown(value), spec["unit"], self.sources[name])
                for name, value in self.values.items()
                for spec in [parameters()[name]]
            ],
        )

    def cell(self) -> Cell:
        """Every parameter, both lifts side by side."""
        rows: dict[str, dict[str, str]] = {}
        units = {}
        for name, value in self.values.items():
            lift, _, rest = name.partition(".")
            own, column = (rest, lift) if lift in LIFTS else (name, "both")
            rows.setdefault(own, {})[column] = _shown(value)
            units[own] = parameters()[name]["unit"]
        said = f"Truck “{self.name}” ({self.origin}, SHA-256 {self.sha256[:12]})"
        more = f" with {', '.join(self.effects)}" if self.effects else ", the thesis's model"
        return Cell(
            [f"{said}{more}."],
            ["Parameter", "Unit", "Free lift", "Main lift"],
            [
                [name, units[name], *(found.get(lift, found.get("both", "—")) for lift in LIFTS)]
                for name, found in rows.items()
            ],
        )

    def __repr__(self) -> str:
        effects = f", effects={list(self.effects)}" if self.effects else ""
        return f"Truck({self.name!r}, {len(self.values)} parameters{effects}, sha256={self.sha256[:12]})"

    def __str__(self) -> str:
        return "\n".join(present.tables(self))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Truck) and self.sha256 == other.sha256

    def __hash__(self) -> int:
        return hash(self.sha256)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Truck, (self.name, dict(self.values), dict(self.sources), self.origin))


@cache
def _places() -> dict[str, tuple[int, int]]:
    """Of every parameter where its part begins among all, and where it stands itself."""
    order = list(parameters())
    part = {name.rpartition(".")[0]: place for place, name in reversed(list(enumerate(order)))}
    return {name: (part[name.rpartition(".")[0]], place) for place, name in enumerate(order)}


def truck_of(given: Truck | str | Path) -> Truck:
    """A truck, or the one of a name or a file.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``, and those of `Truck.read`.
    """
    if isinstance(given, str | Path):
        return Truck.read(given)
    arguments.of_kind(Truck, truck=given)
    return given


def shipped() -> tuple[str, ...]:
    """The names of the trucks that come with forklift."""
    return tuple(sorted(path.stem for path in SHIPPED.glob("*.toml")))


def _locate(name_or_path: str | Path) -> tuple[Path, str]:
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and name_or_path in shipped():
        return SHIPPED / f"{name_or_path}.toml", "shipped"
    if not path.exists():
        raise ForkliftError(
            "truck-unknown",
            f"there is no truck and no file {str(name_or_path)!r}; "
            f"give the path of a TOML file or a shipped truck's name ({', '.join(shipped())})",
            file=str(name_or_path),
            shipped=list(shipped()),
        )
    return path, str(path)


def _shown(value: Value) -> str:
    return " ".join(f"{knot:.6g}" for knot in (value if isinstance(value, tuple) else (value,)))


def _number(name: str, value: float | Sequence[float]) -> Value:
    if type(value) is float and isfinite(value):
        return value
    try:
        if isinstance(value, str | bytes | bool):
            raise TypeError
        if isinstance(value, Sequence) or getattr(value, "ndim", 0) == 1:
            numbers: Value = tuple(float(knot) for knot in value)  # type: ignore[union-attr]
        else:
            numbers = float(value)
        if not all(map(isfinite, numbers if isinstance(numbers, tuple) else (numbers,))):
            raise ValueError
    except (TypeError, ValueError):
        raise ForkliftError(
            "parameter-not-a-number",
            f"parameter {name} is {value!r}, which is not a finite number; give it in the model's unit",
            name=name,
            value=value,
        ) from None
    return numbers
