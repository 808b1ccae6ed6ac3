"""Lifts taken for each other: their currents, encoders or pressures exchanged."""

from __future__ import annotations

from collections.abc import Iterator
from math import log
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.numbers import amount
from forklift.plant.forklift.checks import motion, timing
from forklift.plant.forklift.checks.finding import Finding, fault
from forklift.plant.forklift.checks.scale import Pressures
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.recordings.channels import LIFTS, Lift, commanded

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

STILL, LIVELY = 2.5, 6.0
"""Variation of a pressure, in its noise, up to which it does not answer and from which it does."""
APART = 0.1
"""Least |ln| of the ratio of the two static pressures by which they can be told apart."""
GEOMETRY_M = 0.03
"""How well the height follows the positions that are the right way round."""
BETTER = 0.3
"""By how much a lift's speed must correlate better with the other's command than with its own."""


def swapped(recording: Recording, truck: Truck, known: Pressures) -> Iterator[Finding]:
    """``"lifts-swapped"``, saying which columns, the likeliest first: at most one a recording."""
    for found in (
        _motion(recording),
        _pressure(recording, truck, known),
        _both(recording, truck),
    ):
        if found is not None:
            yield found
            return


def _motion(recording: Recording) -> Finding | None:
    """The lift that is commanded stands and the other moves."""
    if recording.lift == "both":
        return None
    own, rest = recording.lift, motion.other(recording.lift)
    columns = [motion.position(recording, lift) for lift in (own, rest)]
    travels = [motion.span(column) for column in columns]
    if columns[0] is None or travels[1] < motion.LEAST_TRAVEL_M or travels[0] > 0.1 * travels[1]:
        return None
    if _encoders_swapped(recording):
        return _exchange(
            recording,
            "position",
            own,
            f"while lift = {own!r} is commanded, position_{rest}_m moves by {amount(travels[1], 'm')} and "
            f"position_{own}_m by {amount(travels[0], 'm')}, and fork_height_m fits them exchanged",
            travels[1],
        )
    return fault(
        recording,
        "lifts-swapped",
        f"it is entered as lift = {own!r}, but position_{rest}_m moves by {amount(travels[1], 'm')} and "
        f"position_{own}_m by {amount(travels[0], 'm')}; enter lift = {rest!r} and exchange the currents, or "
        "exchange the channels of the lifts, in [channels]",
        channel=f"position_{rest}_m",
        value=travels[1],
        unit="m",
        lift=own,
    )


def _encoders_swapped(recording: Recording) -> bool:
    """Whether the height follows 2 x_free + x_main, and not 2 x_main + x_free."""
    forks = motion.height(recording)
    columns = [motion.position(recording, lift) for lift in LIFTS]
    if forks is None or columns[0] is None or columns[1] is None:
        return False
    ratios = [FORKS_PER_SENSOR[lift] for lift in LIFTS]
    right = motion.span(forks - ratios[0] * columns[0] - ratios[1] * columns[1])
    wrong = motion.span(forks - ratios[1] * columns[0] - ratios[0] * columns[1])
    return wrong < GEOMETRY_M < 0.3 * right


def _pressure(recording: Recording, truck: Truck, known: Pressures) -> Finding | None:
    """The pressures at rest stand the wrong way round, or only the resting lift's answers."""
    free, main = (motion.pressure(recording, lift) for lift in LIFTS)
    if free is None or main is None:
        return None
    rest = motion.at_rest(recording, truck)
    if not (np.isfinite(free[rest]).any() and np.isfinite(main[rest]).any()):
        return None
    read = [float(np.nanmedian(values[rest])) for values in (free, main)]
    implied = [known[lift][0] + known[lift][1] * recording.load_kg for lift in LIFTS]
    if min(read) > 0.0:
        should, does = log(implied[0] / implied[1]), log(read[0] / read[1])
        if abs(should) > APART and abs(does + should) < 0.25 * abs(should):
            told = (
                f"at rest pressure_free_pa reads {amount(read[0], 'Pa')} and pressure_main_pa "
                f"{amount(read[1], 'Pa')}, where the truck's masses imply {amount(implied[0], 'Pa')} and "
                f"{amount(implied[1], 'Pa')}"
            )
            return _exchange(recording, "pressure", commanded(recording.lift)[0], told, read[0])
    if recording.lift == "both" or not motion.is_open(recording, truck, recording.lift).any():
        return None
    own, other = recording.lift, motion.other(recording.lift)
    answers = {lift: motion.answer(motion.pressure(recording, lift)) for lift in LIFTS}
    if answers[own] < STILL and answers[other] > LIVELY:
        told = (
            f"while lift = {own!r} is commanded, pressure_{own}_pa stays within {answers[own]:.2g} times its "
            f"noise and pressure_{other}_pa varies by {answers[other]:.2g} times its own"
        )
        return _exchange(recording, "pressure", own, told, answers[other])
    return None


def _both(recording: Recording, truck: Truck) -> Finding | None:
    """With both lifts commanded, each follows the other's current."""
    if recording.lift != "both":
        return None
    follows = {
        (moved, told): timing.follows(recording, truck, moved, told) for moved in LIFTS for told in LIFTS
    }
    own = max(follows[lift, lift] for lift in LIFTS)
    cross = min(follows[lift, motion.other(lift)] for lift in LIFTS)
    if not cross > own + BETTER:
        return None
    what = "position" if _encoders_swapped(recording) else "current"
    told = (
        f"each lift's speed follows the other's current (correlation {cross:.2f}, with its own {own:.2f} "
        "at most)"
    )
    return _exchange(recording, what, "free", told, cross)


def _exchange(recording: Recording, what: str, lift: Lift, told: str, value: float) -> Finding:
    unit = {"position": "m", "pressure": "pa", "current": "a"}[what]
    names = [f"{what}_{lift}_{unit}", f"{what}_{motion.other(lift)}_{unit}"]
    return fault(
        recording,
        "lifts-swapped",
        f"{told}; {names[0]} and {names[1]} seem exchanged; exchange their columns in [channels] or "
        "in the file",
        channel=names[0],
        channels=names,
        value=value,
        lift=recording.lift,
    )
