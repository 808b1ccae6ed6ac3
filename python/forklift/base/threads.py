"""Linear algebra on one thread: faster for matrices this small, and its sums do not depend on the cores."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """A context in which BLAS and LAPACK use one thread; recordings are shared out among cores instead."""
    return _controller().limit(limits=1)  # type: ignore[no-any-return]


@cache
def _controller() -> Any:
    return ThreadpoolController()
