"""Positions and height that contradict each other: the forks stand 2 x_main + x_free over the ground."""

from __future__ import annotations

from collections.abc import Iterator
from math import log
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.numbers import amount
from forklift.plant.forklift.checks import motion
from forklift.plant.forklift.checks.finding import Finding, caution, fault
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.recordings.channels import LIFTS, commanded

if TYPE_CHECKING:
    from forklift.recordings.recording import Recording

GAIN, GAIN_DOUBTFUL = 1.3, 1.03
"""Factors between the height and 2 x_main + x_free."""
OFFSET_M, OFFSET_DOUBTFUL_M = 0.5, 0.03
"""Differences between the same."""


def geometry(recording: Recording) -> Iterator[Finding]:
    """``"height-contradicts-position"``: the forks stand 2 x_main + x_free over the ground."""
    forks = motion.height(recording)
    free, main = (motion.position(recording, lift) for lift in LIFTS)
    if forks is None or free is None or main is None:
        return
    said = FORKS_PER_SENSOR["free"] * free + FORKS_PER_SENSOR["main"] * main
    known = np.isfinite(forks) & np.isfinite(said)
    if np.count_nonzero(known) < motion.REST_SAMPLES:
        return
    seen, said = forks[known], said[known]
    offset = float(np.median(seen[: motion.REST_SAMPLES] - said[: motion.REST_SAMPLES]))
    moved = max(motion.span(seen), motion.span(said))
    ends = [float(np.percentile(values, 99) - np.percentile(values, 1)) for values in (seen, said)]
    gain = ends[0] / ends[1] if moved > 2 * motion.LEAST_TRAVEL_M and ends[1] > 0.0 else 1.0
    if abs(log(max(gain, 1e-9))) > log(GAIN_DOUBTFUL) and abs(ends[0] - ends[1]) > OFFSET_DOUBTFUL_M:
        hard = not 1 / GAIN <= gain <= GAIN
        channel = _smaller(recording, gain) if hard else "fork_height_m"
        wrong = channel if hard else "one of them"
        told = (
            f"fork_height_m moves by {amount(ends[0], 'm')} and 2 position_main_m + position_free_m by "
            f"{amount(ends[1], 'm')}, which should be equal; correct the scale of {wrong} in [channels]"
        )
        facts = {"channel": channel, "value": gain, "lower": 1 / GAIN, "upper": GAIN}
    elif abs(offset) > OFFSET_DOUBTFUL_M:
        hard = abs(offset) > OFFSET_M
        told = (
            f"fork_height_m starts {amount(offset, 'm')} from 2 position_main_m + position_free_m, where "
            f"they should be equal within {amount(OFFSET_DOUBTFUL_M, 'm')}; correct the zero of one of them "
            "with offset in [channels]"
        )
        facts = {"channel": "fork_height_m", "value": offset, "upper": OFFSET_DOUBTFUL_M, "unit": "m"}
    else:
        return
    make = fault if hard else caution
    yield make(recording, "height-contradicts-position", told, **facts)


def _smaller(recording: Recording, gain: float) -> str:
    """The channel whose scale is likely wrong: far off, the one that hardly moves; else the encoder."""
    if gain < 0.1:
        return "fork_height_m"
    return f"position_{commanded(recording.lift)[0]}_m"
