"""A user's own functions: what goes wrong in them is their mistake, and is told with its place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError


def call(plant: str, what: str, function: Callable[..., Any], *given: Any) -> Any:
    """What a plant's function gives.

    Raises
    ------
    ForkliftError
        ``"plant-invalid"`` with the error and its line, if the function raises one.
    """
    try:
        return function(*given)
    except (ForkliftError, MemoryError):
        raise
    except Exception as error:  # a user's function may raise anything
        raise _failed(plant, what, function, error) from error


def named(plant: str, what: str, function: Callable[..., Any], *given: Any) -> Mapping[str, Any]:
    """What a plant's function gives, by name; errors as `call`, for something else than that, too."""
    try:
        found = function(*given)  # at every step of a run: no call within a call
    except (ForkliftError, MemoryError):
        raise
    except Exception as error:
        raise _failed(plant, what, function, error) from error
    if type(found) is not dict and not isinstance(found, Mapping):
        told = "nothing" if found is None else f"a {type(found).__name__}"
        raise mistake(plant, what, f"gives {told}, where values by name are expected; return a dictionary")
    return found


def _failed(plant: str, what: str, function: Callable[..., Any], error: Exception) -> ForkliftError:
    file = getattr(getattr(function, "__code__", None), "co_filename", "")
    line = line_in(error, file)
    where = f" in {file}, line {line}," if line else ""
    told = f"fails{where} with {type(error).__name__} ({error}); correct it"
    return mistake(plant, what, told, error=type(error).__name__, file=file or None, line=line)


def numbers(plant: str, what: str, name: str, found: Any, shape: tuple[int, ...]) -> Floats:
    """What a plant's function gives under a name, at all of (times, lanes) or of (lanes,)."""
    try:
        return np.broadcast_to(np.asarray(found, dtype=float), shape)
    except (TypeError, ValueError) as error:
        raise no_number(plant, what, name, error) from error


def no_number(plant: str, what: str, name: str, error: Exception) -> ForkliftError:
    """That what a function gives under a name is no array of numbers that goes with the others."""
    return mistake(
        plant, what, f"gives {name} that is no number at every moment ({error}); correct it", name=name
    )


def mistake(plant: str, what: str, told: str, **facts: Any) -> ForkliftError:
    """That one of a plant's functions does something wrong."""
    known = {name: fact for name, fact in facts.items() if fact is not None}
    return ForkliftError("plant-invalid", f"plant {plant}: its {what} {told}", **{"name": what, **known})


def line_in(error: BaseException, file: str) -> int | None:
    """The last line of a file that an error came through."""
    trace, line = error.__traceback__, None
    while trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
