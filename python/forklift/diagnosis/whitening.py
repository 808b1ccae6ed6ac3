"""What slow noise has in common from one sample to the next, taken off: what is left errs independently."""

from __future__ import annotations

import numpy as np

from forklift.base.arrays import Floats
from forklift.fitting.observed import Observed


def whitened(seen: Observed, time_s: Floats, rows: Floats) -> Floats:
    """Rows of one channel of a recording, in units of its noise, with each sample's part that the one before
    foretells taken off.

    Noise with the correlation k from one sample to the next, ρ to the power of the steps between them, has
    the independent parts (eₙ − k eₙ₋₁)/√(1 − k²) of the same size (Prais & Winsten 1954); the first sample
    stays as it is. `time_s` are the recording's instants. Rows of white channels stay.
    """
    sensor = seen.sensor
    if not sensor.correlation or len(rows) < 2:
        return rows
    keep = sensor.correlation ** (np.diff(time_s[seen.rows]) / sensor.step_s)
    keep = keep.reshape(-1, *[1] * (rows.ndim - 1))
    return np.concatenate([rows[:1], (rows[1:] - keep * rows[:-1]) / np.sqrt(1.0 - keep**2)])
