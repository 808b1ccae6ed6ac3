"""A name that leaves nothing over is not replaced by a curve that does as well."""

from dataclasses import dataclass
from typing import Any, cast

import pytest

from forklift.diagnosis.rules import settled_names


@dataclass(frozen=True)
class Refit:
    hypotheses: tuple[str, ...] = ()
    excess: float = 0.0
    complete: bool = False
    quiet: bool = False


@pytest.mark.parametrize(
    ("best", "baseline", "kept"),
    [
        # 439 of an excess of 852 is no mismatch at all: noise that was taken for less than it is.
        (Refit(("name",), 439.0, complete=True), Refit(excess=852.0), True),
        (Refit(("name",), 439.0), Refit(excess=852.0), False),
        (Refit(("name",), 400.0), Refit(excess=852.0), True),
        (Refit(("name",), 439.0), Refit(excess=500.0, quiet=True), True),
    ],
)
def test_what_removed_all_there_was_stays(best: Refit, baseline: Refit, kept: bool) -> None:
    found = settled_names(cast(Any, best), cast(Any, baseline))
    assert found == (best.hypotheses if kept else ())
