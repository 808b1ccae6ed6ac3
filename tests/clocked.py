"""A campaign as loggers with several clocks would have written it: MDF4, a group for each clock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from forklift import Campaign
from forklift.recordings import campaign_file
from forklift.recordings.campaign import FILE
from forklift.recordings.recording import Recording

Columns = dict[str, tuple[np.ndarray, np.ndarray]]
"""By channel its times [s] and its samples."""

FAST = 1.003
LATE_S = 0.003
PHASE_S = 0.007


def as_it_is(recording: Recording) -> Columns:
    """All channels on one clock."""
    return {name: (recording.time_s, values) for name, values in recording.channels.items()}


def at_three_rates(recording: Recording) -> Columns:
    """Commands at 100 Hz (each sent twice), sensors at 50 Hz, the oil temperature at 10 Hz."""
    found = as_it_is(recording)
    step = float(np.median(np.diff(recording.time_s)))
    twice = np.sort(np.r_[recording.time_s, recording.time_s + 0.5 * step])
    for name in ("current_free_a", "current_main_a"):
        found[name] = (twice, np.repeat(recording[name], 2))
    name = "oil_temperature_degc"
    found[name] = (recording.time_s[::5], recording[name][::5])
    return found


def moved(change: Callable[[np.ndarray], np.ndarray], *names: str) -> Callable[[Recording], Columns]:
    """The stamps of these channels, or of every sensor, changed."""

    def make(recording: Recording) -> Columns:
        which = names or [name for name in recording.channels if not name.startswith("current")]
        return {
            name: (change(time) if name in which else time, values)
            for name, (time, values) in as_it_is(recording).items()
        }

    return make


def with_gaps(recording: Recording) -> Columns:
    """Every sensor loses two stretches of its own, and one sample in fifty."""
    random = np.random.default_rng(7)
    found = as_it_is(recording)
    for name, (time, values) in found.items():
        if not name.startswith("current"):
            kept = random.random(len(time)) > 0.02
            for first in random.integers(0, len(time) - 20, size=2):
                kept[first : first + 15] = False
            found[name] = (time[kept], values[kept])
    return found


CLOCKS: dict[str, Callable[[Recording], Columns]] = {
    "one clock": as_it_is,
    "100, 50 and 10 Hz": at_three_rates,
    "7 ms of phase": moved(lambda time: time + PHASE_S),
    "3 ms late": moved(lambda time: time + LATE_S, "pressure_free_pa"),
    "0.3 % fast": moved(lambda time: time * FAST),
    "gaps": with_gaps,
}


def write(campaign: Campaign, folder: Path, clocks: Callable[[Recording], Columns]) -> Path:
    """The campaign with every recording an MDF4 file of these clocks."""
    asammdf = pytest.importorskip("asammdf", reason="asammdf (the extra mdf) is not installed")
    folder.mkdir(parents=True)
    text = campaign_file.dump(campaign.name, campaign.sample_rate_hz, campaign.recordings)
    (folder / FILE).write_text(text.replace(".csv", ".mf4"))
    for recording in campaign:
        columns = clocks(recording)
        with asammdf.MDF(version="4.10") as mdf:
            groups: dict[bytes, list[str]] = {}
            for name, (time, _) in columns.items():
                groups.setdefault(time.tobytes(), []).append(name)
            for names in groups.values():
                signals = [asammdf.Signal(columns[name][1], columns[name][0], name=name) for name in names]
                mdf.append(signals)
            mdf.save(folder / recording.file.replace(".csv", ".mf4"), overwrite=True)
    return folder
