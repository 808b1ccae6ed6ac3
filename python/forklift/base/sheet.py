"""What a result says of itself as plain data, so that the room that draws needs to know nothing of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from forklift.base.arrays import Floats


@dataclass(frozen=True)
class Listing:
    """A table: heads, those of numbers after ``>``, and rows of cells."""

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True, eq=False)
class Curve:
    """One quantity over time: its name, the unit it is drawn in, and (times,) of that unit."""

    name: str
    unit: str
    values: Floats


@dataclass(frozen=True, eq=False)
class Curves:
    """Quantities over one time [s], one above the other."""

    title: str
    time_s: Floats
    curves: Sequence[Curve]


@dataclass(frozen=True, eq=False)
class Sheet:
    """A run as its page has it.

    Attributes
    ----------
    title, head
        Of the page, and what was run under which conditions.
    sentences
        What it does, the most important first.
    curves
        A figure each.
    made_from
        What, and its SHA-256.
    work
        Of the integrator: what, and how much.
    """

    title: str
    head: str
    sentences: Sequence[str]
    curves: Sequence[Curves]
    made_from: Sequence[tuple[str, str]]
    work: Sequence[tuple[str, str]]


class Listed(ABC):
    """What can be shown as a table."""

    @abstractmethod
    def listing(self) -> Listing:
        """As a table."""


class Sheeted(Listed):
    """What can be shown as a page of curves."""

    @abstractmethod
    def sheet(self) -> Sheet:
        """As a page."""
