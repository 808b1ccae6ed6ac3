"""Whether a campaign can support a fit: asked before one, so that none is made of nonsense.

What a fit cannot survive is an error, see `forklift.plant.forklift.checks.faults`; what it survives, but
whoever reads it must know, is a caution.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.numbers import amount
from forklift.plant.findings import Caution
from forklift.plant.forklift.checks import motion
from forklift.plant.forklift.checks.faults import faults
from forklift.plant.forklift.checks.finding import Finding
from forklift.plant.forklift.commands import steps_to_current
from forklift.plant.forklift.phases import shut_current
from forklift.recordings.channels import LIFTS, Lift, commanded

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

LEVELS_APART_A = 0.03
"""Least spread of the currents that are held: four of the ECU's steps, less is one level."""
HELD_SAMPLES = 7
"""Over which a current is held: short beside any staircase or PRMS level, long beside noise."""
SAME_LOAD_KG = 50.0
"""Loads closer than this are one: what static friction makes of a pressure."""
SAME_TEMPERATURE_K = 5.0
"""Temperatures closer than this are one: ten steps of the sensor, and a few per cent of viscosity."""


@dataclass(frozen=True)
class Suitability:
    """What a campaign supports.

    Attributes
    ----------
    lifts
        Those which can be fitted.
    cautions
        What to know about a fit of them.
    """

    lifts: tuple[Lift, ...]
    cautions: tuple[Caution, ...]

    def to_dict(self) -> dict[str, Any]:
        """The same as plain data, for JSON."""
        return {"lifts": list(self.lifts), "cautions": [found.to_dict() for found in self.cautions]}


def suitability(
    recordings: Sequence[Recording],
    truck: Truck,
    oil_temperature_degc: float | None = None,
    known: Sequence[Finding] | None = None,
) -> Suitability:
    """Judge whether these recordings support a fit that starts from `truck`.

    Parameters
    ----------
    recordings
        Of one campaign, of both roles: what a fit is judged on must be as sound as what it is made of.
    truck
        Whose masses, areas, strokes and valves the recordings are held against.
    oil_temperature_degc
        What was entered for recordings without one [°C].
    known
        What `forklift.plant.forklift.checks.faults` finds in them, if it was asked before.

    Raises
    ------
    ForkliftError
        ``"estimate-missing"``; ``"no-excitation"``; ``"channel-stuck"``, ``"recording-frozen"``,
        ``"command-unanswered"``; ``"lifts-swapped"``; ``"pressure-implausible"``,
        ``"position-implausible"``, ``"temperature-implausible"``, ``"command-implausible"``,
        ``"clock-implausible"``, ``"height-contradicts-position"``; ``"samples-lost"``, ``"channel-jump"``,
        ``"command-shifted"``; and those of `forklift.recordings.checks`. The fact ``files`` lists all
        recordings of which the same is true.
    """
    if not any(found.role == "estimate" for found in recordings):
        raise ForkliftError(
            "estimate-missing",
            f"none of the campaign's {len(recordings)} recordings may be fitted on; enter "
            'role = "estimate" for some of them in campaign.toml',
            value=0,
            lower=1,
            files=[found.file for found in recordings],
        )
    found = list(faults(recordings, truck) if known is None else known)
    errors = [finding for finding in found if isinstance(finding, ForkliftError)]
    if errors:
        raise _first(errors)
    recordings = [one.thinned(motion.LOOKED_AT) for one in recordings]
    lifts, unexcited = _excited(recordings, truck)
    cautions = [finding for finding in found if isinstance(finding, Caution)]
    return Suitability(lifts, (*unexcited, *_untold(recordings, lifts, oil_temperature_degc), *cautions))


def _first(errors: list[ForkliftError]) -> ForkliftError:
    """The first error, with all the files of which the same is said."""
    first = errors[0]
    same = [error.file for error in errors if error.code == first.code]
    return ForkliftError(first.code, first.message, **first.facts, files=list(dict.fromkeys(same)))


def _excited(recordings: Sequence[Recording], truck: Truck) -> tuple[tuple[Lift, ...], list[Caution]]:
    """The lifts that the estimate recordings excite, and cautions about those which they do not."""
    lifts, missed = [], {}
    for lift in LIFTS:
        told = [found for found in recordings if lift in commanded(found.lift)]
        if not told:
            continue
        why = _unexcited([found for found in told if found.role == "estimate"], truck, lift)
        if why is None:
            lifts.append(lift)
        else:
            missed[lift] = why
    if not lifts:
        reasons = "; ".join(sentence for sentence, _ in missed.values())
        facts = {name: fact for _, found in reversed(missed.values()) for name, fact in found.items()}
        raise ForkliftError(
            "no-excitation",
            f"no lift can be fitted: {reasons}; record lowerings at several currents between the valve's "
            "opening and its limit, or correct lift and the currents",
            **facts,
        )
    return tuple(lifts), [
        Caution(
            "lift-left-out",
            f"the {lift} lift is left as the truck has it: {why}; its recordings tell nothing of it",
            {"lift": lift, **facts},
        )
        for lift, (why, facts) in missed.items()
    ]


def _unexcited(told: list[Recording], truck: Truck, lift: Lift) -> tuple[str, dict[str, Any]] | None:
    """Why these recordings do not excite the lift, with facts; None if they do."""
    channel, opens = f"current_{lift}_a", shut_current(truck, lift)
    if not told:
        return f"no estimate recording commands the {lift} lift", {"lift": lift}
    facts: dict[str, Any] = {"lift": lift, "channel": channel, "file": told[0].file}
    files = told[0].file if len(told) == 1 else f"{told[0].file} and {len(told) - 1} more"
    highest = max(float(found[channel].max()) for found in told)
    if highest <= opens:
        why = (
            f"{channel} is at most {amount(highest, 'A')} in {files}, where the valve opens at {opens:.3g} A"
        )
        return why, facts | {"value": highest, "lower": opens, "unit": "A"}
    travels = [way for found in told if (way := motion.travel(found, lift)) is not None]
    answers = max(motion.answer(motion.pressure(found, lift)) for found in told)
    if travels and max(travels) < motion.LEAST_TRAVEL_M:
        why = (
            f"the {lift} lift moves by at most {amount(max(travels), 'm')} in {files}, where "
            f"{amount(motion.LEAST_TRAVEL_M, 'm')} is the least that tells anything"
        )
        return why, facts | {
            "channel": f"position_{lift}_m",
            "value": max(travels),
            "lower": motion.LEAST_TRAVEL_M,
            "unit": "m",
        }
    if not travels and answers == 0.0:
        why = f"neither position_{lift}_m, pressure_{lift}_pa nor fork_height_m tells of it in {files}"
        return why, facts | {"channel": f"position_{lift}_m"}
    held = _held(told, truck, lift)
    spread = float(np.ptp(np.percentile(held, [5, 95]))) if len(held) else 0.0
    if len(held) and spread < LEVELS_APART_A:
        level = float(np.median(held))
        why = f"{channel} opens the valve to one level only, {level:.3g} A, in {files}"
        return why, facts | {"value": level, "spread": spread, "lower": LEVELS_APART_A, "unit": "A"}
    return None


def _held(told: Sequence[Recording], truck: Truck, lift: Lift) -> Floats:
    """The currents at which the valve is held open [A]; those passed through on the way do not count."""
    step = float(steps_to_current(np.array([1]))[0])
    found = []
    for recording in told:
        current = recording[f"current_{lift}_a"]
        if len(current) <= HELD_SAMPLES:
            continue
        smooth = np.convolve(current, np.full(HELD_SAMPLES, 1.0 / HELD_SAMPLES), "valid")
        flat = np.abs(np.diff(smooth)) < 0.5 * step
        found.append(smooth[1:][flat & (smooth[1:] > shut_current(truck, lift))])
    return np.concatenate(found) if found else np.zeros(0)


def _untold(
    recordings: Sequence[Recording], lifts: Sequence[Lift], entered_degc: float | None
) -> Iterator[Caution]:
    """What a fit of these lifts cannot tell, for want of recordings."""
    for lift in lifts:
        told = [found for found in recordings if lift in commanded(found.lift) and found.role == "estimate"]
        loads = [found.load_kg for found in told]
        if max(loads) - min(loads) < SAME_LOAD_KG:
            yield Caution(
                "one-load",
                f"the {lift} lift is recorded with one load only, {loads[0]:g} kg: friction per mass "
                f"({lift}.friction.f_cfr) cannot be told from preload ({lift}.friction.F_pr); record it with "
                "another load too",
                {"lift": lift, "value": loads[0], "unit": "kg"},
            )
        oil = [motion.measured(found, "oil_temperature_degc") for found in told]
        read = [entered_degc if values is None else float(np.nanmean(values)) for values in oil]
        means = [mean for mean in read if mean is not None]
        if means and max(means) - min(means) < SAME_TEMPERATURE_K:
            yield Caution(
                "one-temperature",
                f"the {lift} lift is recorded at one oil temperature only, {means[0]:.3g} degC: how "
                f"viscosity falls with temperature ({lift}.viscosity.lambda) cannot be told, nor any effect "
                "of temperature; record it with cold and with warm oil",
                {
                    "lift": lift,
                    "value": means[0],
                    "unit": "degC",
                    "parameter": f"{lift}.viscosity.lambda",
                },
            )
        if not any(found.role == "validate" and lift in commanded(found.lift) for found in recordings):
            yield Caution(
                "validate-missing",
                f"no validate recording commands the {lift} lift: how well the fit predicts cannot be "
                'judged; enter role = "validate" for some that are not needed for the fit',
                {"lift": lift},
            )
