"""Clocks that jump behind an even time: samples lost, and commands that the response does not follow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from forklift import _core
from forklift.base.numbers import amount
from forklift.plant.forklift.checks import motion
from forklift.plant.forklift.checks.finding import Finding, caution, fault, take_out
from forklift.recordings.channels import Lift, commanded

if TYPE_CHECKING:
    from forklift.base.arrays import Floats
    from forklift.plant.forklift.truck import Truck
    from forklift.recordings.recording import Recording

POSITIONS = ("position_free_m", "position_main_m", "fork_height_m")

ACCELERATION_M_S2 = 20.0
"""More than forks have: twice gravity."""
COUNTS = 4
"""Encoder counts by which a step may differ from its neighbours, on top."""
NEIGHBOURS = 3
"""Steps on either side that tell what a step should be."""
GLITCH = 5
"""Samples after which a glitch is over."""

WINDOW_S = 4.0
"""Over which a command and its response are compared: some ten changes of a PRMS."""
HOP_S = 0.5
"""From one such window to the next."""
FARTHEST_S = 3.0
"""Largest shift looked for."""
PROMPT_S = (-0.05, 0.8)
"""When a response comes: the low-pass, the valve and the mast's oscillation take some tenths of a second."""
ALIKE, BETTER = 0.6, 0.3
"""Correlation at another time that tells a shift, and by how much it must exceed that at the prompt ones;
of the sound recordings at hand it did by at most 0.15, but for forks that crept (`FEWEST_COUNTS`)."""
VARIES = 0.2
"""A window is judged if its command varies at least this share of what it does over the recording."""
CROSSINGS = 2
"""How often a window's command must cross its own middle: one edge is like any other edge, a pulse is not."""
FEWEST_COUNTS = 12
"""Encoder counts that a lift must pass while it answers: such a command has three stretches at least, and the
speed of one is known to a quarter from four counts. Of forks that creep, any likeness is chance."""
AGREE_S = 0.1
"""Within which neighbouring windows agree on a shift."""


def jumps(recording: Recording) -> Iterator[Finding]:
    """``"samples-lost"`` where what moves jumps at one instant, ``"channel-jump"`` where one channel does;
    of one that comes back within `GLITCH` samples, the caution ``"sample-glitch"``."""
    steps = {
        name: _jump(recording, name) for name in POSITIONS if motion.measured(recording, name) is not None
    }
    places = {name: np.flatnonzero(np.abs(off) > _most(recording)) for name, off in steps.items()}
    for name, found in places.items():
        for k in found[:1]:
            with_it = [other for other in places if np.any(np.abs(places[other] - k) <= 1)]
            if len(with_it) > 1 and not _comes_back(recording, name, int(k)):
                yield _lost(recording, int(k), float(steps[name][k]), with_it)
                return
    for name, found in places.items():
        if len(found):
            k = int(found[0])
            yield _jumped(recording, name, k, float(steps[name][k]), _comes_back(recording, name, k))


def _jump(recording: Recording, name: str) -> Floats:
    """By how much each step lies beyond all of its neighbours [m]; where a lift meets its stop, none does."""
    steps = np.diff(recording[name])
    padded = np.pad(steps, NEIGHBOURS, mode="edge")
    windows = sliding_window_view(padded, 2 * NEIGHBOURS + 1)
    beside = np.delete(windows, NEIGHBOURS, axis=1)
    beside = np.where(np.isfinite(beside), beside, steps[:, None])  # what is missing says nothing
    return np.nan_to_num(steps - np.clip(steps, beside.min(axis=1), beside.max(axis=1)))


def _most(recording: Recording) -> float:
    """By how much steps of what moves may differ [m]."""
    return ACCELERATION_M_S2 / recording.sample_rate_hz**2 + COUNTS * _core.ENCODER_COUNT_M


def _comes_back(recording: Recording, name: str, k: int) -> bool:
    """Whether the samples soon after the step k are again what they were before."""
    values = recording[name]
    after = values[k + 2 : k + 2 + GLITCH]
    return bool(np.any(np.abs(after - values[k]) < 0.5 * abs(values[k + 1] - values[k])))


def _lost(recording: Recording, k: int, size: float, names: Sequence[str]) -> Finding:
    at = float(recording.time_s[k + 1])
    return fault(
        recording,
        "samples-lost",
        f"{' and '.join(names)} jump together at {at:.2f} s, {names[0]} by {amount(abs(size), 'm')} where a "
        f"step differs by at most {amount(_most(recording), 'm')}: samples are missing there though time_s "
        "runs on; split the recording, or take it out",
        channel=names[0],
        channels=list(names),
        time_s=at,
        value=size,
        upper=_most(recording),
        unit="m",
    )


def _jumped(recording: Recording, name: str, k: int, size: float, back: bool) -> Finding:
    at = float(recording.time_s[k + 1])
    facts = {"channel": name, "time_s": at, "value": size, "upper": _most(recording), "unit": "m"}
    told = f"{name} jumps by {amount(abs(size), 'm')} at {at:.2f} s"
    if back:
        return caution(
            recording,
            "sample-glitch",
            f"{told} and comes back; the fit passes over it, or empty the cell",
            **facts,
        )
    return fault(
        recording,
        "channel-jump",
        f"{told} and stays there, where a step differs by at most {amount(_most(recording), 'm')}: samples "
        f"or counts were lost; split the recording there, or {take_out(name)}",
        **facts,
    )


@dataclass(frozen=True)
class _Late:
    """What the command of one window is answered by."""

    from_s: float
    to_s: float
    by_s: float
    """How much later, or earlier where negative, than at once the speed is most like the command."""
    prompt: float
    """Correlation at the times when a response comes."""
    best: float
    """Correlation at `by_s`."""

    @property
    def gap(self) -> float:
        return self.best - self.prompt


def shifted(recording: Recording, truck: Truck, stops: Mapping[Lift, float]) -> Iterator[Finding]:
    """``"command-shifted"``: in part of the recording the lifts answer at another time than they can.

    Told by two neighbouring windows that agree, and where both lifts are commanded, by both together: a lift
    that answers at once says that the clocks are one.

    Parameters
    ----------
    stops
        Up to where a lift may stand on its stop [m], see `motion.lowest`; what it does there tells nothing.
    """
    late = _windows(recording, truck, stops)
    pairs = [
        max(one, two, key=lambda found: found.gap)
        for one, two in pairwise(late)
        if one is not None and two is not None and abs(one.by_s - two.by_s) <= AGREE_S
    ]
    if not pairs:
        return
    worst = max(pairs, key=lambda found: found.gap)
    channels = [f"current_{lift}_a" for lift in commanded(recording.lift)]
    yield fault(
        recording,
        "command-shifted",
        f"from {worst.from_s:.2f} to {worst.to_s:.2f} s the speed follows {' and '.join(channels)} "
        f"{abs(worst.by_s):.2f} s too {'late' if worst.by_s > 0 else 'early'} (correlation {worst.best:.2f} "
        f"there, {worst.prompt:.2f} at once): the clocks of command and response differ; put them on one "
        "clock, or take the recording out",
        channel=channels[0],
        value=worst.by_s,
        lower=PROMPT_S[0],
        upper=PROMPT_S[1],
        unit="s",
        from_s=worst.from_s,
        to_s=worst.to_s,
    )


def _windows(recording: Recording, truck: Truck, stops: Mapping[Lift, float]) -> list[_Late | None]:
    """Of each window that can be judged, in order, whether its command is answered at another time."""
    lifts = commanded(recording.lift)
    commands = [_opening(recording, truck, lift) for lift in lifts]
    speeds = [motion.speed(recording, lift) for lift in lifts]
    rate, n = recording.sample_rate_hz, len(recording)
    width, far, after = (round(span_s * rate) for span_s in (WINDOW_S, FARTHEST_S, PROMPT_S[1]))
    stands = np.zeros(n, np.bool_)
    for lift in lifts:
        values = motion.position(recording, lift)
        stands |= False if values is None else values <= stops[lift]
    least = FEWEST_COUNTS * _core.ENCODER_COUNT_M * rate
    found: list[_Late | None] = []
    for first in range(0, n - width + 1, max(1, round(HOP_S * rate))):
        window = slice(first, first + width)
        begin = max(0, first - far)
        around = slice(begin, first + width + far)
        answer = slice(first, first + width + after)
        if stands[answer].any():
            continue
        moved = [
            (command[window], _correlations(command[window], speed[around]))
            for command, speed in zip(commands, speeds, strict=True)
            if speed is not None
            and np.isfinite(speed[around]).all()
            and command[window].std() > VARIES * command.std()
            and abs(speed[answer].sum()) >= least
        ]
        told = [answered for command, answered in moved if _crossings(command) >= CROSSINGS]
        if told:
            shifts = (np.arange(len(told[0])) + begin - first) / rate
            times = float(recording.time_s[first]), float(recording.time_s[first + width - 1])
            every = np.array([answered for _, answered in moved])
            found.append(_late(times, shifts, np.mean(told, axis=0), every))
    return found


def _crossings(command: Floats) -> int:
    """How often it crosses the middle between its least and its greatest value."""
    above = command > 0.5 * (command.min() + command.max())
    return int(np.count_nonzero(above[1:] != above[:-1]))


def _late(times: tuple[float, float], shifts: Floats, told: Floats, every: Floats) -> _Late | None:
    """The shift at which the correlation is best, if that is plainly another than a prompt one of any lift,
    `every` (lifts, shifts): two lifts have one clock, and one may slow the other down."""
    k = int(np.argmax(told))
    prompt = float(every[:, (shifts >= PROMPT_S[0]) & (shifts <= PROMPT_S[1])].max())
    late = _Late(*times, float(shifts[k]), prompt, float(told[k]))
    inside = 0 < k < len(told) - 1  # at an end it is a trend, not a peak
    return late if inside and late.best >= ALIKE and late.gap >= BETTER else None


def follows(recording: Recording, truck: Truck, moved: Lift, told: Lift) -> float:
    """Correlation of one lift's speed with a lift's command, at the best of the prompt shifts."""
    speed = motion.speed(recording, moved)
    command = _opening(recording, truck, told)
    if speed is None or not np.isfinite(speed).all():
        return 0.0
    k = round(PROMPT_S[1] * recording.sample_rate_hz)
    if len(recording) <= 2 * k:
        return 0.0
    return float(np.max(_correlations(command[: len(command) - k], speed)))


def _opening(recording: Recording, truck: Truck, lift: Lift) -> Floats:
    """The opening that the truck's area table gives for the command [m²]."""
    current, area = (np.asarray(truck.values[f"{lift}.valve.table_{of}"]) for of in ("current", "area"))
    return np.asarray(np.interp(recording[f"current_{lift}_a"], current, area))


def _correlations(window: Floats, signal: Floats) -> Floats:
    """Of the window with each piece of the signal of its length; 0 where either does not vary."""
    pieces = sliding_window_view(signal, len(window))
    centred = window - window.mean()
    scale = np.sqrt(centred @ centred) * pieces.std(axis=1) * np.sqrt(len(window))
    known = scale > 0.0
    found: Floats = np.where(known, pieces @ centred / np.where(known, scale, 1.0), 0.0)
    return found
