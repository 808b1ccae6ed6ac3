"""A digest of what was given, of any kind: equal for what computes the same, in another process too."""

from __future__ import annotations

import copyreg
import hashlib
import json
import os
import sys
import sysconfig
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cached_property, partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

_INSTALLED = tuple({sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")})
"""Where modules stand that nobody edits."""


def fingerprint(*given: object) -> str:
    """SHA-256 of values, arrays, containers, dataclasses and functions.

    What knows its own ``sha256`` is taken by it; a function by its code, defaults and what it refers to; a
    module or a class that is installed by its name, a module that is not by its file, a class that is not by
    what it holds. Anything else by its class and by what pickle would keep of it; what cannot be pickled is
    equal to nothing, not even to itself.
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
    if isinstance(one, MethodType):
        return [_plain(one.__func__, inside), _plain(one.__self__, inside)]
    if isinstance(one, partial):
        return [_plain(part, inside) for part in (one.func, one.args, one.keywords)]
    if isinstance(one, ModuleType):
        return [one.__name__, _file_of(one)]
    if isinstance(one, type):
        return _of_class(one, inside)
    if isinstance(one, CodeType):
        return _of_code(one, inside)
    name = _plain(type(one), inside)
    own = getattr(one, "sha256", None)
    if isinstance(own, str):
        return [name, own]
    if is_dataclass(one):
        return [name, *(_plain(getattr(one, each.name), inside) for each in fields(one))]
    return [name, *_of_object(one, inside)]


def _of_object(one: Any, above: tuple[int, ...]) -> list[Any]:
    """What pickle would keep, the items of a list or a mapping among it; and what a decorator has wrapped."""
    try:
        special = copyreg.dispatch_table.get(type(one))
        reduced: Any = special(one) if special else one.__reduce_ex__(4)
        parts = [reduced] if isinstance(reduced, str) else list(reduced[:3])
        parts += [list(items) for items in reduced[3:5] if items] if len(parts) > 1 else []
        return [_plain(part, above) for part in (*parts, getattr(one, "__wrapped__", None))]
    except Exception:  # objects of others may raise anything
        return [os.urandom(16).hex()]


def _of_class(one: type, above: tuple[int, ...]) -> Any:
    """Its name; of one that is not installed its bases, too, and all that it defines."""
    name = f"{one.__module__}.{one.__qualname__}"
    if _installed(one.__module__):
        return name
    held = {}
    for key, value in vars(one).items():
        found = getattr(value, "__func__", value)  # of a class method, or a static one
        if isinstance(found, property):
            found = (found.fget, found.fset, found.fdel)
        elif isinstance(found, cached_property):
            found = found.func
        if isinstance(found, FunctionType) or not (key.startswith("__") or key == "_abc_impl"):
            held[key] = found
    return [name, *(_plain(part, above) for part in (one.__bases__, held))]


def _file_of(module: ModuleType) -> str:
    """Digest of a module's file, if it may be edited."""
    file = getattr(module, "__file__", None)
    if _installed(module.__name__) or not file or not Path(file).is_file():
        return ""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def _installed(name: str) -> bool:
    """Whether a module is this package's, or of the library or a package that is installed."""
    if name.partition(".")[0] in (__name__.partition(".")[0], *sys.builtin_module_names):
        return True
    file = getattr(sys.modules.get(name), "__file__", None)
    return bool(file) and str(file).startswith(_INSTALLED)


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
