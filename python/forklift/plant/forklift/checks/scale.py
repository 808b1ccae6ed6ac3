"""Values that cannot be in their unit: against the channel table, and against what the truck implies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.errors import ForkliftError
from forklift.base.numbers import amount
from forklift.plant.forklift.checks import motion
from forklift.plant.forklift.checks.finding import Finding, caution, fault
from forklift.plant.forklift.commands import Command
from forklift.plant.forklift.phases import shut_current
from forklift.plant.forklift.simulate import simulate
from forklift.recordings import checks
from forklift.recordings.channels import COMMANDS, LIFTS, TIME, Lift, commanded, conversions, table
from forklift.recordings.formats.signals import Place

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

Pressures = dict[Lift, tuple[float, float]]
"""Of each lift at rest [Pa]: without a load, and what a kilogram adds."""

RATES_HZ = (2.0, 5000.0)
"""Of a recording: below, a 0.4 s oscillation is not seen; above, no vehicle's bus delivers."""
IMPOSSIBLE, DOUBTFUL = 3.0, 1.3
"""Factors between a pressure at rest and what masses and load imply: friction at rest makes a few per cent,
an unknown load rarely a factor 3."""
LOAD_SHARE, LOAD_KG = 0.2, 100.0
"""By how much the load that the pressures imply may differ from the one entered."""
FROZEN_DEGC = 0.01
"""Oil that stays this close to 0 °C is a scale of 1e-5, not a temperature: no sensor resolves it."""
LOWERING_M_S = 0.1
"""A lift that lowers this fast on its own sensor has an open valve: leakage is a tenth of it."""


def as_read(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """What reading a file refuses, of recordings made in Python too; and clocks that no recorder has."""
    rates = [found.sample_rate_hz for found in recordings if found.on_one_clock]
    for recording in recordings:
        place = Place(recording.file, recording.file)
        try:
            for name, values in recording.channels.items():
                checks.samples(place, name, values)
                checks.unit(place, table()[name], values)
            if recording.on_one_clock:
                checks.clock(place, table()[TIME], recording.time_s, float(np.median(rates)))
            checks.lift(place, recording.lift, recording.channels)
        except ForkliftError as error:
            yield error
            continue
        step_s = min(recording.own(name).step_s for name in COMMANDS)
        rate = recording.sample_rate_hz if recording.on_one_clock or not step_s else 1.0 / step_s
        if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
            yield fault(
                recording,
                "clock-implausible",
                f"time_s steps by {amount(1 / rate, 's')}, where {1 / RATES_HZ[1]:g} to {1 / RATES_HZ[0]:g} "
                "s are possible; give time_s and sample_rate_hz in seconds and hertz",
                channel=TIME,
                value=1 / rate,
                lower=1 / RATES_HZ[1],
                upper=1 / RATES_HZ[0],
                unit="s",
            )


def pressures_at_rest(truck: Truck) -> Pressures:
    """What each lift's pressure at rest says about the load, by the truck's masses and areas."""
    still = Command.of_samples(50.0, free=np.zeros(2))
    at = [
        simulate(truck, still, time=[0.0], load_kg=load, oil_temperature_degc=20.0) for load in (0.0, 1000.0)
    ]
    names: list[tuple[Lift, str]] = [(lift, f"pressure_{lift}_pa") for lift in LIFTS]
    empty, loaded = ({lift: float(found[name][0]) for lift, name in names} for found in at)
    return {lift: (empty[lift], (loaded[lift] - empty[lift]) / 1000.0) for lift in LIFTS}


def pressure(recording: Recording, truck: Truck, known: Pressures) -> Iterator[Finding]:
    """``"pressure-implausible"``; cautions ``"pressure-doubtful"``, ``"load-doubtful"``."""
    rest = motion.at_rest(recording, truck)
    reads: dict[Lift, float] = {}
    for lift in LIFTS:
        values = motion.pressure(recording, lift)
        if values is not None and np.isfinite(values[rest]).any():
            reads[lift] = float(np.nanmedian(values[rest]))
    load = _load(reads, known)
    if load is not None and abs(load - recording.load_kg) > max(LOAD_SHARE * recording.load_kg, LOAD_KG):
        yield caution(
            recording,
            "load-doubtful",
            f"load_kg is entered as {recording.load_kg:g}, but the pressures of both lifts at rest agree on "
            f"{load:.0f} kg; enter the load that was on the forks",
            value=recording.load_kg,
            implied=load,
            unit="kg",
        )
        return
    for lift, read in reads.items():
        yield from _pressure(recording, lift, read, known[lift][0] + known[lift][1] * recording.load_kg)


def _load(reads: dict[Lift, float], known: Pressures) -> float | None:
    """The load on which both lifts' pressures agree [kg]."""
    if len(reads) < 2:
        return None
    loads = [(read - known[lift][0]) / known[lift][1] for lift, read in reads.items()]
    mean = float(np.mean(loads))
    agree = abs(loads[0] - loads[1]) <= max(LOAD_SHARE * mean, LOAD_KG)
    return max(mean, 0.0) if agree and min(loads) > -LOAD_KG else None


def _pressure(recording: Recording, lift: Lift, read: float, implied: float) -> Iterator[Finding]:
    channel = f"pressure_{lift}_pa"
    ratio = read / implied
    if 1 / DOUBTFUL <= ratio <= DOUBTFUL:
        return
    told = (
        f"{channel} reads {amount(read, 'Pa')} at rest, where the truck's masses and load_kg = "
        f"{recording.load_kg:g} imply {amount(implied, 'Pa')}"
    )
    facts = {
        "channel": channel,
        "value": read,
        "implied": implied,
        "lower": implied / IMPOSSIBLE,
        "upper": implied * IMPOSSIBLE,
        "unit": "Pa",
    }
    if 1 / IMPOSSIBLE <= ratio <= IMPOSSIBLE:
        yield caution(
            recording,
            "pressure-doubtful",
            f"{told}; see to the load, the sensor's zero and scale, and the truck's masses",
            **facts,
        )
        return
    for unit in conversions("Pa"):
        if 1 / IMPOSSIBLE <= ratio * unit.scale <= IMPOSSIBLE:
            told += f": it looks like {unit.name}; multiply it by {unit.scale:g} with scale in [channels]"
            facts |= {"looks_like": unit.name, "scale": unit.scale}
            break
    else:
        told += "; correct its unit or zero with scale and offset in [channels], or load_kg"
    yield fault(recording, "pressure-implausible", told, **facts)


def temperature(recording: Recording) -> Iterator[Finding]:
    """``"temperature-implausible"`` for one that stays at 0 °C, but not quite."""
    values = motion.measured(recording, "oil_temperature_degc")
    if values is None:
        return
    largest = float(np.nanmax(np.abs(values)))
    if 0.0 < largest < FROZEN_DEGC:
        yield fault(
            recording,
            "temperature-implausible",
            f"oil_temperature_degc is within {largest:.2g} degC of 0 throughout, closer than any sensor "
            "resolves; correct its unit with scale and offset in [channels]",
            channel="oil_temperature_degc",
            value=largest,
            lower=FROZEN_DEGC,
            unit="degC",
        )


def command(recording: Recording, truck: Truck) -> Iterator[Finding]:
    """``"command-implausible"`` where a lift lowers though its valve is never told to open."""
    for lift in commanded(recording.lift):
        speed = motion.speed(recording, lift)
        channel, opens = f"current_{lift}_a", shut_current(truck, lift)
        highest = float(recording[channel].max())
        if highest > 0.5 * opens or speed is None or not np.isfinite(speed).any():
            continue
        fastest = float(np.nanmax(speed))
        if fastest > LOWERING_M_S:
            yield fault(
                recording,
                "command-implausible",
                f"{channel} is at most {amount(highest, 'A')}, where the valve opens at "
                f"{amount(opens, 'A')}, yet the {lift} lift lowers at up to {amount(fastest, 'm/s')}; "
                "correct the current's unit with scale in [channels], or enter the lift that was commanded",
                channel=channel,
                value=highest,
                lower=opens,
                unit="A",
                speed_m_s=fastest,
            )


def direction(recording: Recording) -> Iterator[Finding]:
    """``"position-reversed"``: a lift that is commanded, and so lowered, ends higher than it began."""
    for lift in commanded(recording.lift):
        values = motion.position(recording, lift)
        if values is None:
            continue
        known = values[np.isfinite(values)]
        k = min(motion.REST_SAMPLES, len(known))
        rise = float(np.median(known[-k:]) - np.median(known[:k]))
        if rise < motion.LEAST_TRAVEL_M or rise < 0.5 * motion.span(values):
            continue
        channel = f"position_{lift}_m"
        yield fault(
            recording,
            "position-reversed",
            f"{channel} rises by {amount(rise, 'm')}, where a valve of this function only lowers; give it "
            "scale -1 and its offset in [channels], or cut out the lifting",
            channel=channel,
            value=rise,
            upper=motion.LEAST_TRAVEL_M,
            unit="m",
        )


def stroke(recording: Recording, truck: Truck) -> Iterator[Finding]:
    """``"position-implausible"``: beyond the truck's stroke, or still beside an answering pressure."""
    for lift in LIFTS:
        values = motion.position(recording, lift)
        if values is None:
            continue
        ratio = 2.0 if lift == "free" else 1.0
        upper = ratio * float(truck.values[f"{lift}.cylinder.stroke_upper"])  # type: ignore[arg-type]
        highest = float(np.nanmax(values))
        moved = motion.span(values)
        channel = f"position_{lift}_m"
        if highest > 2.0 * upper:
            told = (
                f"{channel} reads up to {amount(highest, 'm')}, where the stroke ends at {amount(upper, 'm')}"
            )
            value = highest
        elif 0.0 < moved < 0.1 * motion.LEAST_TRAVEL_M and _answers(recording, truck, lift):
            told = f"{channel} moves by {moved:.2g} m in all, though the lift's pressure answers its valve"
            value = moved
        else:
            continue
        yield fault(
            recording,
            "position-implausible",
            f"{told}; correct its unit with scale in [channels]",
            channel=channel,
            value=value,
            upper=upper,
            unit="m",
        )


def _answers(recording: Recording, truck: Truck, lift: Lift) -> bool:
    if lift not in commanded(recording.lift) or not motion.is_open(recording, truck, lift).any():
        return False
    return motion.answer(motion.pressure(recording, lift)) > 3.0
