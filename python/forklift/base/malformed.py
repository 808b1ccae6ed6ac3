"""What pydantic found wrong in a file, as one sentence in the words of whoever wrote the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

_KINDS = {"str", "int", "float", "bool", "list", "tuple", "dict"}
"""How a place in a file is called where several kinds of value are possible: no key of it."""
_WANTED = (
    (("float", "int", "finite", "decimal"), "write a number"),
    (("string",), "write text in quotes"),
    (("bool",), "write true or false"),
    (("list", "tuple"), "write a list in brackets"),
    (("dict", "model", "mapping"), "write a table"),
)


class Wrong(NamedTuple):
    """The first thing that is wrong: the key's full name, whether it is unknown, and a sentence."""

    name: str
    unknown: bool
    sentence: str


def first_wrong(error: ValidationError, model: type[BaseModel]) -> Wrong:
    """What a file that was to be a `model` has wrong."""
    found, schema = error.errors(include_url=False)[0], model.model_json_schema()
    kinds = _KINDS | set(schema.get("$defs", {}))
    path = [part for part in found["loc"] if isinstance(part, int) or not (part in kinds or "[" in part)]
    name = ".".join(map(str, path)) or "the file"
    kind = found["type"]
    if kind == "extra_forbidden":
        near = get_close_matches(str(path[-1]), sorted(set(_keys(schema))), n=1)
        hint = f" (did you mean {near[0]}?)" if near else ""
        return Wrong(name, unknown=True, sentence=f"there is no key {name}{hint}; correct or remove it")
    if kind == "missing" and path and isinstance(path[-1], int):
        parent = ".".join(map(str, path[:-1]))
        return Wrong(
            parent,
            unknown=False,
            sentence=f"{parent} has {path[-1]} value{'s' * (path[-1] != 1)}; add what is missing",
        )
    if kind == "missing":
        return Wrong(name, unknown=False, sentence=f"the key {name} is missing; add it")
    told = repr(found["input"])
    told = told if len(told) <= 60 else f"{told[:57]}..."
    return Wrong(name, unknown=False, sentence=f"{name} is {told}; {_wanted(kind, found)}")


def _wanted(kind: str, found: Mapping[str, Any]) -> str:
    if kind == "literal_error":
        return f"write {found['ctx']['expected']}"
    for words, wanted in _WANTED:
        if kind.startswith(words) and kind.endswith(("_type", "_parsing", "_number")):
            return wanted
    said = str(found["msg"]).removeprefix("Value error, ").replace("Input should be", "it must be")
    return said[:1].lower() + said[1:]


def _keys(schema: Any) -> Iterator[str]:
    """Every key that a file may have, at any depth."""
    if isinstance(schema, dict):
        yield from schema.get("properties", {})
        for inner in schema.values():
            yield from _keys(inner)
    elif isinstance(schema, list):
        for inner in schema:
            yield from _keys(inner)
