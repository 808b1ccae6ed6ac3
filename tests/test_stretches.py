"""A recording's stretches that err independently share what its own unknowns cost."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from forklift.diagnosis.refit import Refit
from forklift.fitting.residuals import ChannelResidual
from forklift.report import heat


def seen(blocks: int, file: str = "a") -> ChannelResidual:
    left = np.random.default_rng(3).standard_normal(60)
    square = (float(left @ left) + 2.0) / 60  # two of what its own unknowns are strained by
    rows = np.arange(60)
    return ChannelResidual(
        file, "validate", "", "y", 60, square, None, rows, left, blocks=blocks, strain=2.0, freedom=3.0
    )


@pytest.mark.parametrize("blocks", [1, 2, 5])
def test_stretches_add_up_to_the_recordings_squares(blocks: int) -> None:
    nothing: Any = None
    refit = Refit((), nothing, nothing, (seen(blocks),), (0.0,), True, nothing)
    shares = refit.by_recording()
    assert len(shares) == blocks
    assert sum(shares.values()) == pytest.approx(refit.squares)


def test_a_map_of_more_recordings_than_can_be_read_is_not_drawn() -> None:
    many = [seen(1, f"{k}") for k in range(heat.MOST_ROWS + 1)]
    machine: Any = None
    assert heat.heat(machine, (), {"": many}, {}) == []
