"""What folders of results have in common: the page's name, rows for JSON, files of an earlier result."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forklift.base.numbers import defined

if TYPE_CHECKING:
    import polars as pl

PAGE = "report.html"


def earlier_files(
    out: str | Path,
    mark: str,
    files: Callable[[Sequence[str]], frozenset[str]],
    facts: str = "campaign",
) -> frozenset[str]:
    """The files of the earlier result that stands in `out`, as its file `mark` tells; else none."""
    try:
        found = json.loads((Path(out) / mark).read_text(encoding="utf-8"))
        return files([recording["file"] for recording in found[facts]["recordings"]])
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return frozenset()


def json_rows(table: pl.DataFrame) -> list[dict[str, Any]]:
    """A table's rows for JSON, which has no NaN."""
    return [{key: defined(value) for key, value in row.items()} for row in table.to_dicts()]
