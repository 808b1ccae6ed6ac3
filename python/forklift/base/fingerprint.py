"""A digest of what was given, of any kind: equal for what computes the same, in another process too."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


def fingerprint(*given: object) -> str:
    """SHA-256 of values, arrays, containers, dataclasses and functions.

    What knows its own ``sha256`` is taken by it; a function by its code, defaults and what it refers to;
    a module or a class by its name. Anything else by its type and, if it has one, its name.
    """
    return hashlib.sha256(json.dumps([_plain(one, ()) for one in given]).encode()).hexdigest()


def _plain(one: Any, above: tuple[int, ...]) -> Any:
    """As JSON has it; of what holds itself nothing more than that."""
    if one is None or isinstance(one, bool | int | float | str):
        return one
    if isinstance(one, bytes):
        return one.hex()
    if id(one) in above:
        return "..."
    inside = (*above, id(one))
    if isinstance(one, np.ndarray | np.generic):
        values = np.asarray(one)
        return [str(values.dtype), list(values.shape), hashlib.sha256(values.tobytes()).hexdigest()]
    if isinstance(one, Mapping):
        return sorted([str(key), _plain(value, inside)] for key, value in one.items())
    if isinstance(one, list | tuple):
        return [_plain(value, inside) for value in one]
    if isinstance(one, set | frozenset):
        return sorted(map(repr, one))
    if isinstance(one, FunctionType):
        return _of_function(one, inside)
    if isinstance(one, partial):
        return [_plain(part, inside) for part in (one.func, one.args, one.keywords)]
    if isinstance(one, ModuleType):
        return one.__name__
    if isinstance(one, type):
        return f"{one.__module__}.{one.__qualname__}"
    if isinstance(one, CodeType):
        return _of_code(one, inside)
    name = f"{type(one).__module__}.{type(one).__qualname__}"
    own = getattr(one, "sha256", None)
    if isinstance(own, str):
        return [name, own]
    if is_dataclass(one):
        return [name, *(_plain(getattr(one, each.name), inside) for each in fields(one))]
    return f"{name} {getattr(one, '__name__', '')}"


def _of_function(one: FunctionType, above: tuple[int, ...]) -> Any:
    held = [cell.cell_contents for cell in one.__closure__ or ()]
    used = {name: one.__globals__[name] for name in _names(one.__code__) if name in one.__globals__}
    parts = (one.__code__, one.__defaults__, one.__kwdefaults__, held, used)
    return [_plain(part, above) for part in parts]


def _names(code: CodeType) -> set[str]:
    """What a function refers to, and the functions within it."""
    inner = (_names(one) for one in code.co_consts if isinstance(one, CodeType))
    return set(code.co_names).union(*inner)


def _of_code(one: CodeType, above: tuple[int, ...]) -> Any:
    return [one.co_code.hex(), list(one.co_names), [_plain(value, above) for value in one.co_consts]]
