"""What a recording's samples must be before anyone computes with them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.recordings.channels import (
    LIFTS,
    REQUIRED,
    TIME,
    Channel,
    Conversion,
    conversions,
    looks_like,
)
from forklift.recordings.formats.signals import Place

CLOCK_TOLERANCE = 0.01
"""By how much, relatively, a recording's clock may differ from the campaign's sample rate.

A hundred times the 100 ppm of a cheap quartz, and below any mistake in stating a rate.
"""
STEP_TOLERANCE = 0.5
"""By how much, in sample periods, one step of the clock may differ from a period: beyond half a period a
sample is nearer to its neighbour's instant than to its own."""
AT_REST_A = 0.2
"""Up to this current [A] a valve counts as not commanded: above the noise of a measured current, and well
below the 0.36 A at which the first of the thesis's valves begins to open."""
FEWEST_ROWS = 2
"""Of a recording and of a commanded current: one sample has no duration. Of a measurement on a clock of its
own one sample is enough: an oil temperature changes slowly."""
TURNED = Conversion("a signal of the other sign", -1.0)
"""An encoder that counts downward, say."""


def samples(place: Place, name: str, values: Floats) -> None:
    """No sample is infinite; of `forklift.recordings.channels.REQUIRED`, none is missing."""
    infinite = np.flatnonzero(np.isinf(values))
    if infinite.size:
        raise place.error(
            "value-infinite",
            f"{place.label(name)} is {values[infinite[0]]}; write a finite number, or leave the sample out "
            "if it is missing",
            row=int(infinite[0]),
            channel=name,
            value=float(values[infinite[0]]),
        )
    missing = np.flatnonzero(np.isnan(values))
    if missing.size and name in REQUIRED:
        raise place.error(
            "sample-missing",
            f"{place.label(name)} is missing or not a number, but must be known at every sample; fill it "
            "in, or cut the recording before it",
            row=int(missing[0]),
            channel=name,
            count=int(missing.size),
        )


def length(place: Place, count: int, channel: str = TIME) -> None:
    """There are at least `FEWEST_ROWS` samples; of a measurement, one."""
    fewest = FEWEST_ROWS if channel in REQUIRED else 1
    if count < fewest:
        what = "it" if channel == TIME else place.label(channel)
        raise place.error(
            "recording-empty" if count == 0 else "recording-too-short",
            f"{what} has {count or 'no'} sample{'s' * (count != 1)}, where at least {fewest} "
            f"{'is' if fewest == 1 else 'are'} needed; record it again, or take it out of campaign.toml",
            channel=None if channel == TIME else channel,
            value=count,
            lower=fewest,
        )


def lengths(place: Place, name: str, values: Floats, time: Floats) -> None:
    """Every sample has its time."""
    if values.shape != time.shape:
        raise place.error(
            "lengths-differ",
            f"{place.label(name)} has {len(values)} samples and its time has {len(time)}; map signals of "
            "one length",
            channel=name,
            value=len(values),
            expected=len(time),
        )


def increasing(place: Place, time: Floats, channel: str = TIME) -> None:
    """`time` increases strictly."""
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if back.size:
        row = int(back[0]) + 1
        what = place.label(TIME) if channel == TIME else f"the time of {place.label(channel)}"
        raise place.error(
            "time-not-increasing",
            f"{what} is {time[row]:.9g} s after {time[row - 1]:.9g} s; it must increase from sample to "
            "sample, so remove or reorder these samples",
            row=row,
            channel=channel,
            value=float(time[row]),
            lower=float(time[row - 1]),
            unit="s",
        )


def unit(place: Place, channel: Channel, values: Floats, what: str = "") -> None:
    """The samples keep to the channel's limits, and are not plainly in another unit.

    `what` they are, for errors; the channel unless told.
    """
    finite = values[np.isfinite(values)]
    if finite.size == 0 or channel.fits(finite):
        return
    inside = channel.inside(finite)
    outside = (finite < channel.lower) | (finite > channel.upper)
    few = not inside and 2 * outside.sum() < np.count_nonzero(finite)  # a glitch here and there
    likely = [] if few else [TURNED] if channel.fits(-finite) else looks_like(channel, finite)
    if inside and not likely:  # a sensor that reads nothing is not a wrong unit
        return
    if inside:
        row = int(np.nanargmax(np.abs(values)))
        extreme, lower, upper = float(values[row]), channel.typical_lower, channel.typical_upper
        says = "at its largest"
    else:
        row = int(np.flatnonzero((values < channel.lower) | (values > channel.upper))[0])
        extreme, lower, upper = float(values[row]), channel.lower, channel.upper
        says = "here"
    possible = _range(lower, upper, channel.unit)
    what = what or place.label(channel.name)
    told = f"{what} is {extreme:.6g} {channel.unit} {says}, where {possible} is possible"
    if likely:
        raise _wrong_unit(place, channel, told, likely, row=row, value=extreme, lower=lower, upper=upper)
    part = "the sample, or leave it out if it is missing" if few else "the channel's unit, scale or zero"
    raise place.error(
        "value-out-of-bounds",
        f"{told}; correct {part}",
        row=row,
        channel=channel.name,
        value=extreme,
        lower=lower,
        upper=upper,
        unit=channel.unit,
    )


def clock(place: Place, time_channel: Channel, time: Floats, rate_hz: float) -> None:
    """`time` goes with the campaign's sample rate, without a jump."""
    steps = np.diff(time)
    duration, periods = float(time[-1] - time[0]), len(steps)
    expected = periods / rate_hz
    if abs(duration - expected) > max(CLOCK_TOLERANCE * expected, STEP_TOLERANCE / rate_hz):
        typical = float(np.median(steps)) * rate_hz
        if abs(typical - 1.0) > CLOCK_TOLERANCE + STEP_TOLERANCE / periods:
            raise _wrong_rate(place, time_channel, typical, rate_hz)
    late = np.flatnonzero(np.abs(steps * rate_hz - 1.0) > STEP_TOLERANCE)
    if late.size:
        row = int(late[0]) + 1
        raise place.error(
            "clock-jump",
            f"{place.label(TIME)} goes from {time[row - 1]:.9g} to {time[row]:.9g} s, where one sample takes "
            f"{1 / rate_hz:.6g} s; give the samples between as rows of empty cells, split the recording, "
            "or convert it to an even clock",
            row=row,
            channel=TIME,
            value=float(steps[row - 1]),
            lower=(1.0 - STEP_TOLERANCE) / rate_hz,
            upper=(1.0 + STEP_TOLERANCE) / rate_hz,
            unit="s",
        )
    if abs(duration - expected) > max(CLOCK_TOLERANCE * expected, STEP_TOLERANCE / rate_hz):
        raise _wrong_rate(place, time_channel, duration / expected, rate_hz)


def divides(place: Place, time_channel: Channel, step_s: float, rate_hz: float) -> None:
    """The recording's rate, 1 / `step_s`, is a whole number of times `rate_hz`."""
    times = 1.0 / (step_s * rate_hz)
    every = max(1, round(times))
    if abs(times / every - 1.0) <= CLOCK_TOLERANCE:
        return
    near = [1.0 / (step_s * max(1, k)) for k in (math.floor(times), math.ceil(times))]
    raise _wrong_rate(
        place,
        time_channel,
        1.0 / times,
        rate_hz,
        f"of which {rate_hz:g} Hz is no whole part; convert it to "
        + " or ".join(dict.fromkeys(f"{one:.6g} Hz" for one in near)),
    )


def lift(place: Place, lift: str, channels: Mapping[str, Floats]) -> None:
    """A single lift's recording does not command the other lift."""
    moved = [
        name for name in LIFTS if np.any(channels[f"current_{name}_a"] != channels[f"current_{name}_a"][0])
    ]
    if lift in LIFTS and moved and lift not in moved:
        other = f"current_{moved[0]}_a"
        raise place.error(
            "lift-contradicts-current",
            f'the recording is entered as lift = "{lift}", but only {place.label(other)} changes; enter '
            f'lift = "{moved[0]}", or exchange the currents',
            channel=other,
            value=lift,
        )
    for name in LIFTS if lift in LIFTS else ():
        other = f"current_{name}_a"
        highest = float(np.abs(channels[other]).max())
        if name != lift and highest > AT_REST_A:
            raise place.error(
                "lift-contradicts-current",
                f'the recording is entered as lift = "{lift}", but {place.label(other)} is '
                f'commanded up to {highest:.3g} A; enter lift = "both", or exchange the currents',
                channel=other,
                value=lift,
            )


def _range(lower: float | None, upper: float | None, unit: str) -> str:
    if lower is None:
        return f"at most {upper:g} {unit}"
    if upper is None:
        return f"at least {lower:g} {unit}"
    return f"{lower:g} to {upper:g} {unit}"


def _wrong_unit(
    place: Place, channel: Channel, told: str, likely: list[Conversion], *, row: int, **facts: float | None
) -> ForkliftError:
    best = likely[0]
    names = " or ".join(found.name for found in likely)
    how = [f"add {one.offset:g} to it" if one.offset else f"multiply it by {one.scale:g}" for one in likely]
    if len(likely) == 1:
        do = how[0]
    else:
        do = ", ".join(f"{way} if it is {one.name}" for way, one in zip(how, likely, strict=True))
    return place.error(
        "unit-wrong",
        f"{told}: it looks like {names}; {do}; by hand, or with scale and offset in [channels]",
        row=row,
        channel=channel.name,
        unit=channel.unit,
        looks_like=[found.name for found in likely],
        scale=best.scale,
        offset=best.offset,
        **facts,
    )


def _wrong_rate(
    place: Place, time_channel: Channel, ratio: float, rate_hz: float, how: str = ""
) -> ForkliftError:
    """The clock's steps are `ratio` periods long; `how` that is wrong, unless the campaign's rate differs."""
    for other in conversions(time_channel.unit):
        if abs(ratio * other.scale - 1.0) <= CLOCK_TOLERANCE:
            steps = f"{ratio / rate_hz:.6g} s, where {1 / rate_hz:.6g} s are expected"
            told = f"{place.label(TIME)} has steps of {steps}"
            return _wrong_unit(place, time_channel, told, [other], row=1, value=ratio / rate_hz)
    return place.error(
        "sample-rate-mismatch",
        f"it is sampled at {rate_hz / ratio:.6g} Hz, "
        + (
            how
            or f"where the campaign has sample_rate_hz = {rate_hz:g}; correct that, or convert the recording "
            "to that rate"
        ),
        channel=TIME,
        value=rate_hz / ratio,
        lower=rate_hz * (1.0 - CLOCK_TOLERANCE),
        upper=rate_hz * (1.0 + CLOCK_TOLERANCE),
        unit="Hz",
    )
