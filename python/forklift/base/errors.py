"""The one exception a user of forklift can meet."""

from __future__ import annotations

from typing import Any


class ForkliftError(Exception):
    """A user's mistake or a run that failed, told in one sentence with a stable code.

    Parameters
    ----------
    code
        Stable, hyphenated word for the kind of error, e.g. ``"parameter-out-of-bounds"``.
    message
        One sentence: what, where, value, bound, and what to do.
    facts
        What the sentence says, as data: ``name``, ``value``, ``lower``, ``upper``, ``unit``,
        ``file``, ``line``, ``channel``, ``time_s``, ``worst_state``, … as far as they apply.
        Each is also an attribute of the exception.
    """

    def __init__(self, code: str, message: str, **facts: Any) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.facts = facts

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["facts"][name]
        except KeyError:
            raise AttributeError(name) from None

    def __str__(self) -> str:
        return f"{self.message} [{self.code}]"

    def __reduce__(self) -> tuple[Any, ...]:
        return (_rebuild, (self.code, self.message, self.facts))

    def to_dict(self) -> dict[str, Any]:
        """The error as plain data, for ``--json``."""
        return {"code": self.code, "message": self.message, "facts": self.facts}


def _rebuild(code: str, message: str, facts: dict[str, Any]) -> ForkliftError:
    return ForkliftError(code, message, **facts)
