"""Counter-based random numbers: what is drawn depends on (seed, number, purpose) alone.

Philox4x64-10, Salmon et al. (2011), Parallel random numbers: as easy as 1, 2, 3.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

DEVELOPMENT = 1_000_000
"""Seeds below it are for development; a figure that is told comes from a seed of at least this."""


class Purpose(IntEnum):
    """What a stream of random numbers is for; a new one is appended, so that the others stay."""

    KIND = 0
    CONCEALED = 1
    TRUCK = 2
    RECORDINGS = 3
    COMMANDS = 4
    SENSORS = 5
    NOISE = 6
    SIZE = 7


def stream(seed: int, number: int, purpose: Purpose) -> np.random.Generator:
    """The generator of one purpose of campaign `number` of `seed`."""
    return np.random.Generator(np.random.Philox(key=[seed, number], counter=[0, 0, 0, int(purpose)]))
