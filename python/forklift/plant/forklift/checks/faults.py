"""What makes a recording useless for a fit, told from its samples: one kind a file.

`faults` asks all of them, in an order in which a cause is told before what follows from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from forklift.base.errors import ForkliftError
from forklift.plant.findings import Caution
from forklift.plant.forklift.checks import geometry, motion, scale, stuck, swapped, timing
from forklift.plant.forklift.checks.finding import Finding
from forklift.recordings.channels import LIFTS

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording


def findings(recordings: Sequence[Recording], truck: Truck) -> tuple[Caution, ...]:
    """What is wrong with these recordings of `truck`, as whoever only looks at them must know it.

    The first error alone, since what follows from it would be told too; without an error all cautions. The
    fact ``files`` lists all recordings of which the same is true.
    """
    found = list(faults(recordings, truck))
    errors = [one for one in found if isinstance(one, ForkliftError)]
    if not errors:
        return tuple(one for one in found if isinstance(one, Caution))
    first = errors[0]
    files = list(dict.fromkeys(error.file for error in errors if error.code == first.code))
    return (Caution(first.code, first.message, {**first.facts, "files": files}),)


def faults(recordings: Sequence[Recording], truck: Truck) -> Iterator[Finding]:
    """Everything wrong with these recordings of `truck`, errors and cautions.

    What goes on after an error is told on the assumption that it is not there: the first error counts.
    """
    found = list(scale.as_read(recordings))
    yield from found
    if any(isinstance(finding, ForkliftError) for finding in found):
        return  # a recording that could not have been read
    recordings = [recording.thinned(motion.LOOKED_AT) for recording in recordings]
    known = scale.pressures_at_rest(truck)
    stops = {lift: motion.lowest(recordings, truck, lift) for lift in LIFTS}
    yield from stuck.stuck(recordings)
    for recording in recordings:
        yield from swapped.swapped(recording, truck, known)
    for recording in recordings:
        yield from scale.pressure(recording, truck, known)
        yield from scale.temperature(recording)
        yield from scale.command(recording, truck)
        yield from scale.stroke(recording, truck)
        yield from scale.direction(recording)
    yield from stuck.encoders(recordings, truck)
    for recording in recordings:
        yield from timing.jumps(recording)
    for recording in recordings:
        yield from geometry.geometry(recording)
        yield from timing.shifted(recording, truck, stops)
