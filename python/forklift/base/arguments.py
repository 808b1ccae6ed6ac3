"""What a verb was given: a thing of another kind is told in one sentence, like any other mistake."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike
from pathlib import Path

from forklift.base.errors import ForkliftError

HOW = {
    "Truck": "read one with forklift.Truck.read",
    "Campaign": "read one with forklift.Campaign.read",
    "Recording": "take one of a campaign's recordings",
    "Command": "make one with forklift.commands.generate or read one with forklift.Command.read",
}


def of_kind(kind: type, **given: object) -> None:
    """Each argument is a `kind`.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``.
    """
    for name, value in given.items():
        if not isinstance(value, kind):
            raise ForkliftError(
                "argument-invalid",
                f"{name} is {_said(value)}, where a forklift.{kind.__name__} is wanted; {HOW[kind.__name__]}",
                name=name,
            )


def number(name: str, value: object) -> float:
    """The argument as a number.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` if it is none.
    """
    try:
        if not isinstance(value, str):
            return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        pass
    raise ForkliftError("argument-invalid", f"{name} is {_said(value)}; give one number", name=name)


def whole(name: str, value: object) -> int:
    """The argument as a whole number, not negative.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` if it is none.
    """
    found = number(name, value)
    if not (found >= 0.0 and found.is_integer()):
        raise ForkliftError(
            "argument-invalid",
            f"{name} is {_said(value)}; give a whole number, not negative",
            name=name,
            value=value,
            lower=0,
        )
    return int(found)


def path(name: str, value: object) -> Path:
    """The argument as a path.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"`` if it is none.
    """
    if not isinstance(value, str | PathLike):
        raise ForkliftError(
            "argument-invalid", f"{name} is {_said(value)}; give the name of a file or a folder", name=name
        )
    return Path(value)


def names(**given: object) -> None:
    """Each argument is a list, of names or of such lists, not one name by itself.

    Raises
    ------
    ForkliftError
        ``"argument-invalid"``.
    """
    for name, value in given.items():
        if isinstance(value, str) or not isinstance(value, Iterable):
            raise ForkliftError(
                "argument-invalid", f"{name} is {_said(value)}; give a list of names", name=name
            )


def _said(value: object) -> str:
    """The value where it is short, else its kind."""
    return repr(value) if isinstance(value, str | int | float | Path | None) else f"a {type(value).__name__}"
