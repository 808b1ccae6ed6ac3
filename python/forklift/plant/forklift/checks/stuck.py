"""Channels that read the same to the last bit for longer than their noise or the motion allows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import ceil, log
from typing import TYPE_CHECKING

import numpy as np

from forklift.base.numbers import amount
from forklift.plant.forklift.checks import motion
from forklift.plant.forklift.checks.finding import Finding, fault, take_out
from forklift.plant.forklift.geometry import FORKS_PER_SENSOR
from forklift.recordings.channels import LIFTS, Lift, channels, commanded

if TYPE_CHECKING:
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

NOISY = ("pressure_free_pa", "pressure_main_pa", "fork_height_m")
"""Channels that have noise, and stand still only if they are stuck or coarse."""
SHORTEST = 25
"""Samples: no shorter run is called stuck."""
CHANCE = 1e-9
"""How unlikely a run of equal samples must be, from how often neighbours are equal elsewhere."""
NOISE_SHARE = 0.5
"""Share of equal neighbours at rest up to which a channel has noise of the size of its steps."""
LONGEST_S = 3.0
"""However coarse the sensor: none worth fitting reads the same for this long while its lift moves, and, of a
pressure, at different currents."""
DIFFERENT_A = 0.1
"""By how much currents differ that make a lift move differently."""
COMMANDED_S = 1.0
"""How long a lift stands, commanded to lower fast, before it counts as standing: a start takes 0.2 s."""

Run = tuple[int, int]


def stuck(recordings: Sequence[Recording]) -> Iterator[Finding]:
    """``"channel-stuck"``, or ``"recording-frozen"`` where everything with noise stands at once."""
    limits = {channel: _limits(recordings, channel) for channel in NOISY}
    for recording in recordings:
        found = {channel: run for channel in NOISY if (run := _run(recording, channel, *limits[channel]))}
        noisy = [channel for channel in NOISY if motion.measured(recording, channel) is not None]
        first = max((run[0] for run in found.values()), default=0)
        last = min((run[1] for run in found.values()), default=0)
        if len(found) >= 2 and len(found) == len(noisy) and first < last:
            yield _frozen(recording, (first, last), found)
        else:
            for channel, run in found.items():
                yield _stuck(recording, channel, run, "though its lift moves or its noise goes on elsewhere")


def encoders(recordings: Sequence[Recording], truck: Truck) -> Iterator[Finding]:
    """``"channel-stuck"`` for an encoder that stands while the height or the pressure says it should not;
    ``"command-unanswered"`` where the lift itself stands, though it moves in other recordings."""
    for lift in LIFTS:
        told = [found for found in recordings if lift in commanded(found.lift)]
        typical = motion.typical_current(told, truck, lift)
        stop = motion.lowest(told, truck, lift)
        ever = any((motion.travel(found, lift) or 0.0) >= motion.LEAST_TRAVEL_M for found in told)
        for recording in told:
            yield from _encoder(recording, lift, typical, stop, ever)


def _limits(recordings: Sequence[Recording], channel: str) -> tuple[float, float]:
    """Longest run of equal samples that chance explains, at rest and in motion."""
    at_rest: list[float] = []
    in_motion: list[float] = []
    for recording in recordings:
        values = motion.measured(recording, channel)
        if values is None:
            continue
        moving = _moving(recording, channel)[1:]
        same, known = values[1:] == values[:-1], np.isfinite(values[1:])
        for mask, shares in ((~moving & known, at_rest), (moving & known, in_motion)):
            if mask.sum() >= SHORTEST:
                shares.append(float(np.mean(same[mask])))
    if not at_rest or np.median(at_rest) > NOISE_SHARE:
        return float("inf"), float("inf")
    return _limit(at_rest), _limit(in_motion)


def _limit(shares: list[float]) -> float:
    share = float(np.median(shares)) if shares else 1.0
    if share >= 1.0:
        return float("inf")
    return max(SHORTEST, ceil(log(CHANCE) / log(share))) if share > 0.0 else SHORTEST


def _moving(recording: Recording, channel: str) -> motion.Mask:
    """Whether what the channel measures moves."""
    own = [lift for lift in LIFTS if channel == f"pressure_{lift}_pa"] or list(LIFTS)
    return np.asarray(np.any([motion.moving(recording, lift) for lift in own], axis=0))


def _run(recording: Recording, channel: str, at_rest: float, in_motion: float) -> Run | None:
    """The channel's longest run of equal samples, if chance does not explain it."""
    values = motion.measured(recording, channel)
    if values is None:
        return None
    moving = _moving(recording, channel)
    longest = max(SHORTEST, LONGEST_S * recording.sample_rate_hz)

    def beyond(run: Run) -> bool:
        moved = int(np.count_nonzero(moving[run[0] : run[1] + 1]))
        if run[1] - run[0] + 1 > at_rest or moved > in_motion:
            return True
        return moved > longest and _must_change(recording, channel, run)

    long = [run for run in motion.runs(values) if beyond(run)]
    return max(long, key=lambda run: run[1] - run[0], default=None)


def _must_change(recording: Recording, channel: str, run: Run) -> bool:
    """Whether a moving lift changes what even a coarse sensor reads: the height always, a pressure between
    currents."""
    currents = [recording[f"current_{lift}_a"] for lift in LIFTS if channel == f"pressure_{lift}_pa"]
    return all(np.ptp(current[run[0] : run[1] + 1]) > DIFFERENT_A for current in currents)


def _encoder(recording: Recording, lift: Lift, typical: float, stop: float, ever: bool) -> Iterator[Finding]:
    values = motion.position(recording, lift)
    for run in [] if values is None else motion.runs(values):
        assert values is not None
        if run[1] - run[0] < SHORTEST:
            continue
        forks = _fork_travel(recording, lift, run)
        if forks is not None and forks > FORKS_PER_SENSOR[lift] * motion.LEAST_TRAVEL_M:
            why = f"while the forks move by {amount(forks, 'm')}"
            yield _stuck(recording, f"position_{lift}_m", run, why)
            return
        if values[run[0]] > stop and _commanded_s(recording, lift, run, typical) >= COMMANDED_S:
            own = motion.pressure(recording, lift)
            if forks is None and motion.answer(own) > 3.0:
                why = "while its valve is open and its pressure answers"
                yield _stuck(recording, f"position_{lift}_m", run, why)
                return
            if ever:
                yield _unanswered(recording, lift, run)
                return


def _fork_travel(recording: Recording, lift: Lift, run: Run) -> float | None:
    """How far the lift moved the forks during the run, by the height [m]; None if that does not tell."""
    forks = motion.height(recording)
    if forks is None:
        return None
    within = slice(run[0], run[1] + 1)
    rest = motion.position(recording, motion.other(lift))
    if rest is not None:
        forks = forks - FORKS_PER_SENSOR[motion.other(lift)] * rest
    elif commanded(recording.lift) != (lift,):
        return None
    known = forks[within][np.isfinite(forks[within])]
    k = max(1, len(known) // 10)
    return abs(float(np.mean(known[-k:]) - np.mean(known[:k]))) if len(known) else None


def _commanded_s(recording: Recording, lift: Lift, run: Run, typical: float) -> float:
    """For how long of the run the valve is open as far as it typically is, or more [s]."""
    wide = recording[f"current_{lift}_a"][run[0] : run[1] + 1] >= typical
    return float(np.count_nonzero(wide)) / recording.sample_rate_hz


def _times(recording: Recording, run: Run) -> dict[str, float]:
    return {"from_s": float(recording.time_s[run[0]]), "to_s": float(recording.time_s[run[1]])}


def _stuck(recording: Recording, channel: str, run: Run, why: str) -> Finding:
    times, unit = _times(recording, run), channels()[channel]["unit"]
    value = float(recording[channel][run[0]])
    return fault(
        recording,
        "channel-stuck",
        f"{channel} stands at {amount(value, unit)} from {times['from_s']:.2f} to {times['to_s']:.2f} s, "
        f"{run[1] - run[0] + 1} samples without a change, {why}; {take_out(channel)}",
        channel=channel,
        value=value,
        unit=unit,
        samples=run[1] - run[0] + 1,
        **times,
    )


def _frozen(recording: Recording, run: Run, found: Mapping[str, Run]) -> Finding:
    times = _times(recording, run)
    return fault(
        recording,
        "recording-frozen",
        f"{', '.join(found)} all stand still from {times['from_s']:.2f} to {times['to_s']:.2f} s, as if the "
        "recorder had stopped and the last samples been repeated; split the recording there, or take it out",
        channel=next(iter(found)),
        channels=list(found),
        value=times["to_s"] - times["from_s"],
        unit="s",
        **times,
    )


def _unanswered(recording: Recording, lift: Lift, run: Run) -> Finding:
    times = _times(recording, run)
    current = float(np.max(recording[f"current_{lift}_a"][run[0] : run[1] + 1]))
    return fault(
        recording,
        "command-unanswered",
        f"current_{lift}_a commands up to {amount(current, 'A')} from {times['from_s']:.2f} to "
        f"{times['to_s']:.2f} s, but the {lift} lift stands still; give the command that the valve really "
        "had, or take the recording out",
        channel=f"current_{lift}_a",
        value=current,
        unit="A",
        **times,
    )
