"""What is known of a recording besides its samples: from its file's name, or from a table.

``free_prms1_800kg_60c_val.mf4`` is of the free lift, with 800 kg, and held out.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from forklift.base.errors import ForkliftError
from forklift.recordings.channels import Lifts
from forklift.recordings.recording import Role

COLUMNS = ("file", "lift", "load_kg", "role")
_LOAD = re.compile(r"(?<![0-9.])(\d+(?:[.,]\d+)?)\s*(kg|t|lbs?)(?![a-z0-9])", re.IGNORECASE)
_KILOGRAMS = {"kg": 1.0, "t": 1000.0, "lb": 0.45359237, "lbs": 0.45359237}  # NIST SP 811 (2008), B.8
_ROLES: dict[str, Role] = {
    "val": "validate",
    "valid": "validate",
    "validate": "validate",
    "validation": "validate",
    "heldout": "validate",
    "est": "estimate",
    "estimate": "estimate",
    "fit": "estimate",
}


@dataclass(frozen=True)
class Entered:
    """What is said of one recording; None where nothing is."""

    lift: Lifts | None = None
    load_kg: float | None = None
    role: Role | None = None

    def over(self, other: Entered) -> Entered:
        """This, and where it says nothing the other."""
        return Entered(
            self.lift or other.lift,
            self.load_kg if self.load_kg is not None else other.load_kg,
            self.role or other.role,
        )


def of_name(file: str) -> Entered:
    """What a file's name says; nothing of a load where it says two."""
    stem = Path(file).stem
    loads = {float(n.replace(",", ".")) * _KILOGRAMS[unit.lower()] for n, unit in _LOAD.findall(stem)}
    words = [word.lower() for word in re.split(r"[^A-Za-z]+", stem) if word]
    lifts: list[Lifts] = [word for word in words if word in get_args(Lifts)]  # type: ignore[misc]
    return Entered(
        lifts[0] if len(set(lifts)) == 1 else None,
        loads.pop() if len(loads) == 1 else None,
        next((_ROLES[word] for word in words if word in _ROLES), None),
    )


def of_table(path: str | Path) -> Mapping[str, Entered]:
    """What a CSV table with the columns ``file, lift, load_kg, role`` says, by file; role may be left out.

    Raises
    ------
    ForkliftError
        ``"table-invalid"``, ``"file-unreadable"``.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            rows = [(reader.line_num, row) for row in reader]
            names = reader.fieldnames or []
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ForkliftError(
            "file-unreadable",
            f"{path} cannot be read as a table ({error}); save it as CSV in UTF-8",
            file=str(path),
        ) from error
    separator = next((mark for mark in ";\t|" if len(names) == 1 and mark in names[0]), None)
    if separator:
        raise _invalid(
            path, f"its columns are separated by {separator!r}; save it with commas", value=separator
        )
    for name in COLUMNS[:3]:
        if name not in names:
            raise _invalid(
                path,
                f"it has no column {name}, but {', '.join(names) or 'none at all'}; call its columns "
                f"{', '.join(COLUMNS)}",
                name=name,
                value=list(names),
            )
    found = {}
    for line, row in rows:
        found[Path(row["file"] or "").name] = Entered(
            _one_of(path, line, "lift", row, get_args(Lifts)),
            _number(path, line, row["load_kg"]),
            _one_of(path, line, "role", row, get_args(Role)) if row.get("role") else None,
        )
    return found


def _one_of(path: Path, line: int, name: str, row: Mapping[str, str], known: Sequence[str]) -> Any:
    value = (row.get(name) or "").strip()
    if value not in known:
        raise _invalid(
            path, f"{name} is {value!r}; write {' or '.join(map(repr, known))}", line=line, value=value
        )
    return value


def _number(path: Path, line: int, cell: str | None) -> float:
    try:
        return float(cell or "")
    except ValueError:
        raise _invalid(
            path, f"load_kg is {cell!r}; write the mass on the forks in kilograms", line=line, value=cell
        ) from None


def _invalid(path: Path, sentence: str, **facts: Any) -> ForkliftError:
    line = facts.get("line")
    at = f"{path}, line {line}" if line else str(path)
    return ForkliftError("table-invalid", f"{at}: {sentence}", file=str(path), **facts)
