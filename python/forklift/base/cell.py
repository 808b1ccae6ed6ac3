"""What shows itself in a notebook's cell: sentences and a table, as data."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from forklift.base import present


@dataclass(frozen=True)
class Cell:
    """Sentences, then a table by its heads and rows."""

    sentences: Sequence[str]
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]


class Celled(ABC):
    """What has such a cell."""

    @abstractmethod
    def cell(self) -> Cell:
        """In a few sentences and one table."""

    def _repr_html_(self) -> str:
        return present.summary(self)
