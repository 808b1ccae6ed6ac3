"""Where what is left over lies: its share by recording, by signal, by phase of motion and by frequency.

The misfit of a cell is the sum of squares above the noise's, Σ (r² − 1) with r in units of noise, where that
is more than chance gives; its share is of all cells of the same kind. An encoder that stands still has no
noise, and is left out. Bands are told from the Fourier transform of each
signal of each recording (Parseval's theorem: their sums of squares add up to the signal's).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forklift.fitting.residuals import ChannelResidual

EDGES_HZ = (0.5, 2.0, 5.0)
"""Between the bands: drift, the steps of a command, the oscillation of a load on its oil, what is faster."""

STILL = 0.1
"""Mean square of a signal, in units of its noise, below which it stands still."""
CHANCE = 4.0
"""Standard deviations of a sum of squares that count as chance."""


@dataclass(frozen=True)
class Share:
    """One cell."""

    by: str
    """``"recording"``, ``"signal"``, ``"phase"`` or ``"band"``."""
    name: str
    samples: float
    """How many, a band's as its part of all frequencies."""
    mean_square: float
    """In units of noise."""
    share: float
    """Of the misfit above the noise; 0 where there is none."""

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "by": self.by,
            "name": self.name,
            "samples": self.samples,
            "mean_square": self.mean_square,
            "share": self.share,
        }


def shares(
    judged: Sequence[ChannelResidual],
    rates_hz: Mapping[tuple[str, str], float],
    phases: Mapping[str, Mapping[str, NDArray[np.intp]]],
    names: Sequence[str],
) -> tuple[Share, ...]:
    """Every cell, kind by kind, the largest share of each kind first.

    Parameters
    ----------
    judged
        Every channel of every recording.
    rates_hz
        Sample rate by recording [Hz].
    phases, names
        By recording and channel, each sample's phase as an index into `names`.
    """
    kinds: dict[str, dict[str, list[float]]] = {"recording": {}, "signal": {}, "phase": {}, "band": {}}

    def put(by: str, name: str, samples: float, square: float) -> None:
        cell = kinds[by].setdefault(name, [0.0, 0.0])
        cell[0] += samples
        cell[1] += square

    for found in judged:
        square = float(found.left @ found.left)
        if square < STILL * found.samples:
            continue
        put("recording", found.file, found.samples, square)
        put("signal", found.channel, found.samples, square)
        phase = phases[found.file][found.channel][found.rows]
        for index in np.unique(phase):
            here = found.left[phase == index]
            put("phase", names[index], len(here), float(here @ here))
        for name, samples, part in _bands(found, rates_hz[found.file, found.channel]):
            put("band", name, samples, part)
    return tuple(share for by, cells in kinds.items() for share in _ranked(by, cells))


def band_names() -> tuple[str, ...]:
    """The bands in words, from slow to fast."""
    inner = [f"{low:g} to {high:g} Hz" for low, high in pairwise(EDGES_HZ)]
    return (f"below {EDGES_HZ[0]:g} Hz", *inner, f"above {EDGES_HZ[-1]:g} Hz")


def _bands(found: ChannelResidual, rate_hz: float) -> Iterator[tuple[str, float, float]]:
    """Name, samples and sum of squares of each band; a missing sample counts as explained."""
    if not len(found.rows):
        return
    place = found.rows if found.instants is None else np.searchsorted(found.instants, found.rows)
    series = np.zeros(int(place[-1] - place[0]) + 1)
    series[place - place[0]] = found.left
    power = np.abs(np.fft.rfft(series)) ** 2 / len(series)
    both = np.full(len(power), 2.0)  # a line stands for its negative frequency, too
    both[0] = 1.0
    if len(series) % 2 == 0:
        both[-1] = 1.0
    band = np.searchsorted(EDGES_HZ, np.fft.rfftfreq(len(series), 1.0 / rate_hz), side="right")
    for index, name in enumerate(band_names()):
        here = band == index
        samples = float(both[here].sum()) * len(found.rows) / len(series)
        yield name, samples, float((both * power)[here].sum())


def _ranked(by: str, cells: Mapping[str, Sequence[float]]) -> list[Share]:
    above = {
        name: square - samples if square > samples + CHANCE * np.sqrt(2.0 * samples) else 0.0
        for name, (samples, square) in cells.items()
    }
    total = sum(above.values())
    rows = [
        Share(by, name, samples, square / samples if samples else 0.0, above[name] / total if total else 0.0)
        for name, (samples, square) in cells.items()
    ]
    return sorted(rows, key=lambda row: (-row.share, -row.mean_square))
