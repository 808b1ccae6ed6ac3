"""Linear algebra on one thread: faster for matrices this small, and its sums do not depend on the cores."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


def one_thread() -> AbstractContextManager[Any]:
    """A context in which BLAS and LAPACK use one thread; recordings are shared out among cores instead."""
    return _controller().limit(limits=1)  # type: ignore[no-any-return]


def on_one_thread(verb: Callable[P, R]) -> Callable[P, R]:
    """The function, all of it within `one_thread`."""

    @wraps(verb)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with one_thread():
            return verb(*args, **kwargs)

    return alone


@cache
def _controller() -> Any:
    return ThreadpoolController()
