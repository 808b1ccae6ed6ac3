"""A signal that is no measurement for a while, stuck or slipped: found before any fit, and taken out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from forklift.base.errors import ForkliftError
from forklift.plant.findings import InvalidStretch, without
from forklift.plant.forklift.checks import motion
from forklift.plant.forklift.checks.faults import faults
from forklift.plant.forklift.checks.finding import Finding
from forklift.plant.forklift.checks.timing import POSITIONS

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

MOST_ROUNDS = 20
"""A recording with more such stretches of one channel than this is not worth keeping; the error says so."""


def without_invalid(
    recordings: Sequence[Recording], truck: Truck
) -> tuple[tuple[Recording, ...], tuple[InvalidStretch, ...], tuple[Finding, ...]]:
    """The recordings without the samples of stuck and slipped signals, which these were, and `faults` of what
    is left.

    After a slip nothing is left of that signal in that recording. Where no other signal tells that the lift
    itself did not jump, samples may be lost as well as counts: that is left to the checks, which refuse it.
    """
    kept, taken = tuple(recordings), list[InvalidStretch]()
    for _ in range(MOST_ROUNDS):
        found = tuple(faults(kept, truck))
        invalid = _invalid(kept, found)
        if not invalid:
            return kept, tuple(taken), found
        taken += invalid
        kept = tuple(
            replace(one, channels=without(one.file, one.time_s, one.channels, invalid)) for one in kept
        )
    return kept, tuple(taken), tuple(faults(kept, truck))


def _invalid(given: Sequence[Recording], found: Sequence[Finding]) -> list[InvalidStretch]:
    """Stuck signals; if there are none, slips: the end of a standstill looks like one."""
    recordings = {recording.file: recording for recording in given}
    stuck, slipped = [], []
    for error in found:
        if not isinstance(error, ForkliftError):
            continue
        facts = error.facts
        if error.code == "channel-stuck":
            stuck.append(
                InvalidStretch(facts["file"], facts["channel"], facts["from_s"], facts["to_s"], "stuck")
            )
        elif error.code == "channel-jump" and _witnessed(recordings[facts["file"]], facts["channel"]):
            end = float(recordings[facts["file"]].time_s[-1])
            slipped.append(InvalidStretch(facts["file"], facts["channel"], facts["time_s"], end, "slip"))
    return stuck or slipped


def _witnessed(recording: Recording, channel: str) -> bool:
    """Whether another signal tells of the same motion: of a lift's position the height, and the reverse."""
    height = "fork_height_m"
    others = [name for name in POSITIONS if name != height] if channel == height else [height]
    return any(motion.measured(recording, name) is not None for name in others)
