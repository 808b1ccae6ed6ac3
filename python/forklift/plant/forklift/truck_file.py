"""A truck's TOML file: values with their sources, read with every check and written back.

Layout: ``[free.viscosity]`` then ``nu_0 = { value = 4.45e-5, source = "Table 5.1" }``. Names, units and
bounds are the core's (`forklift.plant.forklift.tables`); an optional ``unit`` beside a value must be the
core's. Where a free curve acts, and over which variable, stands by name: ``port = { value = "force", ... }``.
Files that have a number there, as they once had, are read by the order that the core's tables have.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from pydantic import BaseModel, ConfigDict, ValidationError

from forklift.base import toml
from forklift.base.errors import ForkliftError
from forklift.plant.forklift.curve_tables import IDS, ports, variables
from forklift.plant.forklift.tables import parameters

Value = float | tuple[float, ...]


class Entry(BaseModel):
    """One parameter in the file."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    value: float | list[float] | str
    source: str
    unit: str | None = None


class TruckFile(NamedTuple):
    """What a truck's file says: the truck's name, and by full parameter name values and sources."""

    name: str
    values: dict[str, Value]
    sources: dict[str, str]
    text: str


def read(path: Path) -> TruckFile:
    """Read and check everything but the bounds, which the core checks.

    Raises
    ------
    ForkliftError
        ``"file-unreadable"``, ``"toml-syntax"``, ``"parameter-unknown"``, ``"parameter-malformed"``,
        ``"parameter-not-a-number"`` or ``"parameter-unit"``, with ``file`` and ``line`` among the facts.
    """
    text = _text(path)
    try:
        tables = toml.loads(text)
    except toml.TOMLDecodeError as error:
        line = re.search(r"line (\d+)", str(error))
        number = int(line[1]) if line else text.count("\n") + 1
        what = re.sub(r" \(at .*\)$", "", str(error))
        raise ForkliftError(
            "toml-syntax",
            f"{path}, line {number}: this is not TOML ({what[:1].lower()}{what[1:]}); correct the line",
            file=str(path),
            line=number,
        ) from None
    name = tables.pop("name", path.stem)
    if not isinstance(name, str) or not name:
        _refuse(path, text, "name", "truck-malformed", f"name is {name!r}; give the truck's name in quotes")
    values: dict[str, Value] = {}
    sources: dict[str, str] = {}
    for key, raw in _leaves(tables):
        entry = _entry(path, text, key, raw)
        values[key] = _number(path, text, key, entry.value)
        sources[key] = entry.source
    for head in dict.fromkeys(key.rpartition(".")[0] for key in values if _names(key)):
        values.setdefault(f"{head}.fades", 0.0)  # of a file from before curves that fade
        sources.setdefault(f"{head}.fades", "not given: it does not fade")
    return TruckFile(name, values, sources, text)


def write(path: Path, name: str, values: Mapping[str, Value], sources: Mapping[str, str]) -> None:
    """Write the file that `read` reads back to the same bits, in the order of `values`."""
    lines = [f"name = {toml.written(name)}"]
    section = ""
    for full, value in values.items():
        head, _, key = full.rpartition(".")
        if head != section:
            section = head
            lines += ["", f"[{section}]"]
        names = _names(full)
        if isinstance(value, tuple):
            number = f"[{', '.join(map(repr, value))}]"
        else:
            number = toml.written(names[int(value + 0.5)]) if names else repr(value)
        unit = toml.written(parameters()[full]["unit"])
        lines.append(f"{key} = {{ value = {number}, unit = {unit}, source = {toml.written(sources[full])} }}")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8", newline="\n")


def line_of(text: str, name: str) -> int | None:
    """The line where the parameter `name` stands in a file laid out as above, counted from 1."""
    if name not in parameters() and name.rpartition(".")[0] in parameters():
        name = name.rpartition(".")[0]  # a knot of a table
    head, _, key = name.rpartition(".")
    section = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if found := re.match(r"\s*\[([^\]]+)\]", line):
            section = found[1].replace(" ", "").replace('"', "")
        elif section == head and re.match(rf'\s*"?{re.escape(key)}"?\s*[=.]', line):
            return number
    return None


def where(path: Path | str, line: int | None) -> str:
    """How a message says where: ``"truck.toml, line 12"``."""
    return f"{path}, line {line}" if line else str(path)


def _names(full: str) -> list[str]:
    """What the parameter counts, where it stands for a name: a free curve's port or variable."""
    head, _, key = full.rpartition(".")
    if head.rpartition(".")[2] not in IDS.values():
        return []
    return {"port": list(ports()), "variable": list(variables())}.get(key, [])


def _number(path: Path, text: str, key: str, value: float | list[float] | str) -> Value:
    """A value as the core has it."""
    if isinstance(value, list):
        return tuple(value)
    if not isinstance(value, str):
        return value
    names = _names(key)
    if value not in names:
        near = get_close_matches(value, names, n=1, cutoff=0.0)
        what = (
            f"none that it may have; did you mean {near[0]}?"
            if near
            else f"not a finite number; give it in {parameters()[key]['unit']}"
        )
        _refuse(
            path, text, key, "parameter-not-a-number",
            f"parameter {key} has the value {_short(value)}, which is {what}",
            value=value,
        )  # fmt: skip
    return float(names.index(value))


def _leaves(tables: Mapping[str, Any], head: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tables.items():
        full = f"{head}{key}"
        if isinstance(value, dict) and full not in parameters() and "value" not in value:
            yield from _leaves(value, f"{full}.")
        else:
            yield full, value


def _entry(path: Path, text: str, key: str, raw: Any) -> Entry:
    if key not in parameters():
        near = get_close_matches(key, parameters(), n=1, cutoff=0.0)[0]
        _refuse(
            path,
            text,
            key,
            "parameter-unknown",
            f"parameter {key} is unknown; did you mean {near}?",
            nearest=near,
        )
    spec = parameters()[key]
    knots = spec["length"] == "knots"
    shape = "value = [..]" if knots else "value = .."
    try:
        entry = Entry.model_validate(raw)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = str(first["loc"][0]) if first["loc"] else ""
        if field == "value" and first["type"] != "missing":
            _refuse(
                path, text, key, "parameter-not-a-number",
                f"parameter {key} has the value {_short(raw['value'])}, which is not "
                f"{'a list of finite numbers' if knots else 'a finite number'}; give it in {spec['unit']}",
                value=raw["value"],
            )  # fmt: skip
        what = {
            "missing": f"lacks {field}",
            "extra_forbidden": f"has an unknown key {field}",
        }.get(first["type"], f"has {field or 'an entry'} of the wrong kind")
        _refuse(
            path, text, key, "parameter-malformed",
            f'parameter {key} {what}; write {{ {shape}, source = ".." }}',
        )  # fmt: skip
    if isinstance(entry.value, list) != knots:
        kind = "a table and needs a list of numbers" if knots else "a single number and cannot be a list"
        _refuse(
            path, text, key, "parameter-malformed",
            f'parameter {key} is {kind}; write {{ {shape}, source = ".." }}',
            value=entry.value,
        )  # fmt: skip
    if entry.unit is not None and entry.unit != spec["unit"]:
        _refuse(
            path, text, key, "parameter-unit",
            f"parameter {key} is given in {entry.unit}, but its unit is {spec['unit']}; convert the value",
            unit=entry.unit, expected=spec["unit"],
        )  # fmt: skip
    return entry


def _refuse(path: Path, text: str, key: str, code: str, message: str, **facts: Any) -> NoReturn:
    line = line_of(text, key)
    raise ForkliftError(code, f"{where(path, line)}: {message}", name=key, file=str(path), line=line, **facts)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        why = f"byte {error.start} is not UTF-8"
    except OSError as error:
        why = (error.strerror or "the system does not allow it").lower()
    raise ForkliftError(
        "file-unreadable", f"{path} cannot be read ({why}); give a truck's TOML file", file=str(path)
    )


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
