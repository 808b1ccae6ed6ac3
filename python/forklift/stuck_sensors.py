"""A signal that stands still while it should not: found before any fit, and taken out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from forklift.errors import ForkliftError
from forklift.estimation.faults import faults

if TYPE_CHECKING:
    from forklift.campaign import Campaign
    from forklift.recording import Recording
    from forklift.truck import Truck

MOST_ROUNDS = 20
"""A recording with more stretches of one channel than this is not worth keeping; the error says so."""


@dataclass(frozen=True)
class Stuck:
    """A channel that stood still in one recording."""

    file: str
    channel: str
    from_s: float
    to_s: float

    @property
    def where(self) -> str:
        """In words."""
        return f"{self.file} from {self.from_s:.2f} to {self.to_s:.2f} s"


def unstuck(campaign: Campaign, truck: Truck) -> tuple[Campaign, tuple[Stuck, ...]]:
    """The campaign without the samples of stuck signals, and which these were."""
    taken: list[Stuck] = []
    for _ in range(MOST_ROUNDS):
        found = [
            Stuck(error.facts["file"], error.facts["channel"], error.facts["from_s"], error.facts["to_s"])
            for error in faults(campaign.recordings, truck)
            if isinstance(error, ForkliftError) and error.code == "channel-stuck"
        ]
        if not found:
            break
        taken += found
        campaign = replace(
            campaign, recordings=tuple(_without(recording, found) for recording in campaign.recordings)
        )
    return campaign, tuple(taken)


def _without(recording: Recording, found: list[Stuck]) -> Recording:
    """The recording with those samples missing."""
    columns = dict(recording.channels)
    for stuck in found:
        if stuck.file == recording.file:
            within = (recording.time_s >= stuck.from_s) & (recording.time_s <= stuck.to_s)
            columns[stuck.channel] = np.where(within, np.nan, columns[stuck.channel])
    return replace(recording, channels=columns)
