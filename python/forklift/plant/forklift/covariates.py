"""What is known of every moment of a recording, as columns that a residual may be correlated with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from forklift.base.arrays import Floats
from forklift.plant.forklift.sensors import POSITIONS
from forklift.plant.subject import Residual
from forklift.recordings.channels import LIFTS, Lift
from forklift.recordings.noise import Sensor
from forklift.recordings.recording import Recording

LAGS_S = (0.0, 0.1, 0.2, 0.3, 0.5, 0.8)
"""How much later a residual may answer: up to two of the oscillation's periods."""


def covariates(
    recordings: Iterable[Recording], judged: Sequence[Residual], sensors: Mapping[str, Sensor]
) -> dict[str, dict[str, Floats]]:
    """By recording and variable: (samples, columns).

    A command, its change and a lift's speed come with lags. Load and oil temperature are constant in a
    recording: they are told across recordings, alone and times the speeds, both as deviations from their
    mean over all recordings. Speeds are the model's own: measured ones would hold the encoder's rounding.
    """
    recordings = tuple(recordings)
    load = float(np.mean([found.load_kg for found in recordings]))
    means = {found.file: _temperature(found) for found in recordings}
    told = [mean for mean in means.values() if mean is not None]
    temperature = float(np.mean(told)) if told else 0.0
    known = {}
    for recording in recordings:
        own = [found for found in judged if found.file == recording.file]
        speeds = _speeds(recording, own, sensors)
        still = np.ones(len(recording))
        columns: dict[str, Floats] = {}
        for lift in LIFTS:
            current = recording[f"current_{lift}_a"]
            if np.ptp(current) > 0.0:
                columns[f"command of the {lift} lift"] = _lagged(current - current.mean(), recording.time_s)
                change = np.gradient(current, recording.time_s)
                columns[f"change of the {lift} lift's command"] = _lagged(change, recording.time_s)
            if lift in speeds:
                columns[f"speed of the {lift} lift"] = _lagged(speeds[lift], recording.time_s)
        none = np.zeros(len(recording))  # of a lift whose position this recording lacks
        with_speeds = np.column_stack([still, *(speeds.get(lift, none) for lift in LIFTS)])
        columns["load"] = (recording.load_kg - load) * with_speeds
        mean = means[recording.file]
        if mean is not None:
            columns["oil temperature"] = (mean - temperature) * with_speeds
        known[recording.file] = columns
    return known


def _temperature(recording: Recording) -> float | None:
    values = recording.channels.get("oil_temperature_degc")
    return None if values is None or not np.isfinite(values).any() else float(np.nanmean(values))


def _speeds(
    recording: Recording, judged: Sequence[Residual], sensors: Mapping[str, Sensor]
) -> dict[Lift, Floats]:
    """The model's speeds where a position is measured [m/s]: what was measured less what is left over."""
    found: dict[Lift, Floats] = {}
    for one in judged:
        if one.channel in POSITIONS and len(one.rows) > 1:
            lift = LIFTS[POSITIONS.index(one.channel)]
            model = recording[one.channel][one.rows] - one.left * sensors[one.channel].noise
            speed = np.gradient(model, recording.time_s[one.rows])
            found[lift] = np.interp(recording.time_s, recording.time_s[one.rows], speed)
    return found


def _lagged(values: Floats, time_s: Floats) -> Floats:
    """(samples, lags) the values as they were so much earlier."""
    return np.column_stack([np.interp(time_s - lag, time_s, values) for lag in LAGS_S])
