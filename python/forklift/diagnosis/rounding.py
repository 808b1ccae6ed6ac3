"""What an encoder hides by rounding: a constant of each recording, not to be taken for anything else."""

from __future__ import annotations

import numpy as np

from forklift.base.arrays import Floats
from forklift.recordings.noise import Sensor


def rounded(sensor: Sensor, rows: Floats) -> Floats:
    """Rows of one recording, in units of noise, with a constant of one standard deviation marginalised.

    At rest an encoder reads off by the same throughout: that is rounding, and tells nothing. With residuals r
    and such a constant, (I + 11ᵀ)^(-1/2) r has independent errors again. Rows of other sensors stay.
    """
    if not sensor.count or not len(rows):
        return rows
    share = 1.0 - 1.0 / np.sqrt(1.0 + len(rows))
    return np.asarray(rows - share * rows.mean(axis=0))
