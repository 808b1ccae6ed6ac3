"""Instants as a data frame writes them into text: ISO 8601, a day and a time of the day."""

from __future__ import annotations

import re
from datetime import UTC, datetime

_INSTANT = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d(:\d\d(\.\d{1,9})?)?\s?(Z|[+-]\d\d:?\d\d)?", re.ASCII)


def instant(cell: str) -> datetime | None:
    """The instant that a cell tells, to the microsecond; without a zone it counts as UTC. None if it tells
    none."""
    if not _INSTANT.fullmatch(cell):
        return None
    try:
        found = datetime.fromisoformat(cell.replace(" ", "T", 1).replace(" ", ""))
    except ValueError:  # the 31st of June, say
        return None
    return found if found.tzinfo else found.replace(tzinfo=UTC)


def seconds(since: datetime, cell: str) -> float | None:
    """How long after that instant a cell's is [s]."""
    found = instant(cell)
    return None if found is None else (found - since).total_seconds()
