"""How a result shows itself: as a page, as text, in a notebook.

A result never imports the room that draws it. `forklift` names that room (`drawn_by`); it is loaded when the
first result is shown, and registers one function for each type of result.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, singledispatch
from importlib import import_module
from typing import Any

_ROOM: list[str] = []


def drawn_by(module: str) -> None:
    """Name the module whose import registers all pages, tables and summaries."""
    _ROOM[:] = [module]
    _load.cache_clear()


@cache
def _load() -> None:
    for module in _ROOM:
        import_module(module)


@singledispatch
def draw_page(result: Any, *details: Any) -> str:
    """One self-contained HTML page; `details` is what its writer has worked out already."""
    raise TypeError(f"no page is registered for {type(result).__name__}")


@singledispatch
def draw_tables(result: Any) -> Sequence[str]:
    """Its tables as plain text."""
    raise TypeError(f"no tables are registered for {type(result).__name__}")


@singledispatch
def draw_summary(result: Any) -> str:
    """A short HTML fragment for a notebook."""
    raise TypeError(f"no summary is registered for {type(result).__name__}")


@singledispatch
def draw_figure(result: Any, *details: Any) -> Any:
    """A plotly figure for a notebook; `details` is what it shows."""
    raise TypeError(f"no figure is registered for {type(result).__name__}")


def page(result: Any, *details: Any) -> str:
    """`draw_page`, by the room that draws."""
    _load()
    return draw_page(result, *details)


def tables(result: Any) -> Sequence[str]:
    """`draw_tables`, by the room that draws."""
    _load()
    return draw_tables(result)


def summary(result: Any) -> str:
    """`draw_summary`, by the room that draws."""
    _load()
    return draw_summary(result)


def figure(result: Any, *details: Any) -> Any:
    """`draw_figure`, by the room that draws."""
    _load()
    return draw_figure(result, *details)
