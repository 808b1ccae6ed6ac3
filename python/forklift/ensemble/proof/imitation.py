"""Whether another truck imitates what is concealed, so that no recording shows it.

What is concealed is *hidden* if another truck, under the conditions as entered and read rightly, does the
same: of the change d in all channels, in units of the sensors' noise, no more than chi-square = 20 is left by
the best of all trucks, whose unknown parameters θ [standard deviations] pay for their prior:

    min over θ of |d − (f(θ) − f(0))|² + |θ|²

At 20 the mean logarithm of the likelihood ratio is 10. The rule is applied before any diagnosis, by this
plant alone, on the beginnings of a few of the campaign's recordings, that which changes most among them if it
does by more than the others together, and scaled to all by the square of the change.

The minimum is searched for by Levenberg–Marquardt (Marquardt 1963), as far as it takes to say on which side
of the bound it lies. One linear step is not enough: trucks as far apart as their priors answer with terms of
second order far beyond the noise's square, along what the recordings tell well. So the way to the minimum is
a bent valley, where every step that is long enough leaves more than the one before, and a search that goes
downhill alone crawls. Each damped step is therefore led back to the valley's floor with the derivatives that
it was made of (chord iterations; Kelley 1995, chapter 5): of a valve that cavitates, where ten steps downhill
left five times the bound, the first with all its chords leaves less than it (13 of seed 923001). Nor is one
start: where a law does as much as three standard deviations of one parameter, no step from the middle leads
far enough (57 of seed 906001). So further ones begin at the best trucks of those that differ by one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from forklift.base.arrays import Floats
from forklift.ensemble.proof.amplitude import beginning, probe_ticks, probes
from forklift.ensemble.proof.draw import Draw
from forklift.ensemble.proof.ends import end_m, lifts_of, recorded_ticks
from forklift.ensemble.proof.truth import run, sensors
from forklift.ensemble.proof.truth.model import Law
from forklift.ensemble.proof.truth.truck import ESTIMATED, LIFTS, Lift

Trucks = tuple[Lift, Lift]

HIDDEN = 20.0
PRIORS = {"estimated": 0.3, "area": 0.15, "current": 0.02, "load": 10.0, "temperature": 1.0}
"""Standard deviations: of logarithms, of openings' logarithms, of knots [A]; of each recording, of the load
[kg] and of the oil's temperature [K]."""
OF_CONDITIONS = ("load", "temperature")
TOLERANCE = 3e-6
"""Of the runs: two of them then differ by a fiftieth of the noise's square over all samples."""
STEP = 0.1
"""Of a standard deviation, for difference quotients: what rounding adds to a column then is about one."""
ALONE = 2.0
"""How far each of the trucks' parameters is tried alone, to either side [standard deviations]; where that
leaves less than no change does, also half as far and half as far again. Openings and knots are not tried: one
of them moves little."""
SEARCHES = 3
"""From how many of them. Chosen: dead volume and bulk modulus stand for each other, and the way from one to
the other is a bent valley that no search follows far."""
DAMPINGS = (0.0, 1.0, 10.0, 100.0, 1e3, 1e4)
"""What is added to the prior's weight in the steps that are tried together."""
CHORDS = 8
"""How many steps are led by the same derivatives; five have sufficed where they lead to the floor. Chosen."""
AWAY = 30.0
"""Standard deviations beyond which no truck is asked for: there a parameter is 8000 times as large."""
STALLED = 0.9
"""Chords that leave more than this share of what the last one left end. Chosen."""
MOST_DERIVATIVES = 4
"""How often they are asked for. Chosen; campaigns took one to three."""
BENDS = 2.0
"""How many times what a linear step with new derivatives promises has to reach the bound for the search to go
on, from the second derivatives on. Chosen."""
FAR = 10.0
"""How many times the bound may be left by what that step promises. Chosen."""
SHOWN = 0.25
"""Share of the change's square that the first linear step has to leave for the search to end there: it bends
by less than that. No search begins at a truck that leaves more. Chosen."""


def left(
    given: Draw,
    laws: Sequence[Law],
    place: int,
    trucks: Trucks,
    conditions: Sequence[run.Condition],
    tick_s: float,
) -> float:
    """Chi-square that the best imitating truck leaves of the law at `place`, scaled to all recordings; where
    it is far above the bound, by a linear step from the best that was found."""
    law = laws[place]
    key, full = next(iter(law.values.items()))
    absent = {f"{law.name}.{key}": np.multiply(full, 0.0)}
    without = [replace(one, values=absent) for one in conditions]
    return left_of_fault(given, laws, without, conditions, sensors.Sensors(), trucks, tick_s, law.name)


def left_of_fault(
    given: Draw,
    laws: Sequence[Law],
    entered: Sequence[run.Condition],
    true: Sequence[run.Condition],
    seen: sensors.Sensors,
    trucks: Trucks,
    tick_s: float,
    name: str = "",
) -> float:
    """The same of conditions that are not as they were entered, and of sensors that read wrongly: what
    another truck leaves, under the conditions as entered and read rightly. `name`: of the law, if it is of
    one."""
    ends = [probe_ticks(name, one) for one in true]
    believed, true = (list(map(beginning, each, ends)) for each in (entered, true))
    shown, whole = _shown(given, laws, believed, true, seen, trucks, tick_s)
    if whole == 0.0:
        return 0.0
    without, judged = ([beginning(each[n], ticks) for n, ticks in shown.items()] for each in (believed, true))
    moved = {lift for n in shown for lift in lifts_of(given.plans[n].lift)}
    others, count = Others(trucks, tuple(sorted(moved)), without), len(shown)

    def ran(asked: Sequence[run.Condition]) -> list[list[run.Trajectory]]:
        found = run.simulate(trucks, laws, asked, TOLERANCE, tick_s)
        return [found[n : n + count] for n in range(0, len(found), count)]

    def answers(thetas: Sequence[Floats]) -> list[Floats]:
        asked = [one for theta in thetas for one in others.at(theta)]
        return [_whitened(given, found, sensors.Sensors()) for found in ran(asked)]

    first, second = ran([*without, *judged])
    at_none = _whitened(given, first, sensors.Sensors())
    d = _whitened(given, second, seen) - at_none
    share = float(d @ d) / whole
    return least(d, answers, at_none, others.count, HIDDEN * share, others.alone()) / share


def _shown(
    given: Draw,
    laws: Sequence[Law],
    believed: Sequence[run.Condition],
    true: Sequence[run.Condition],
    seen: sensors.Sensors,
    trucks: Trucks,
    tick_s: float,
) -> tuple[dict[int, int], float]:
    """The recordings that are judged, and how many ticks of each are recorded: the probes, and the one that
    changes most, if it does by more than they together. With them the change's square in all recordings."""
    both = run.simulate(trucks, laws, [*believed, *true], TOLERANCE, tick_s)
    end = end_m(given)
    ticks = [
        recorded_ticks(one, plan.lift, end) for one, plan in zip(both[len(true) :], given.plans, strict=True)
    ]
    pairs = zip(both[: len(true)], both[len(true) :], ticks, strict=True)
    changes = [
        _whitened(given, [with_it.until(n)], seen) - _whitened(given, [without.until(n)], sensors.Sensors())
        for without, with_it, n in pairs
    ]
    squares = [float(one @ one) for one in changes]
    shown, most = probes(given), int(np.argmax(squares))
    if squares[most] > sum(squares[n] for n in shown):
        shown.append(most)
    return {n: ticks[n] for n in shown}, sum(squares)


@dataclass(frozen=True)
class Others:
    """Trucks that differ by what nobody knows of those lifts that moved, under conditions that differ by what
    nobody knows of each recording."""

    trucks: Trucks
    moved: tuple[str, ...]
    conditions: Sequence[run.Condition]

    @property
    def count(self) -> int:
        """Of their unknowns."""
        return sum(1 for _ in self._unknowns()) + len(OF_CONDITIONS) * len(self.conditions)

    def alone(self) -> list[Floats]:
        """The directions of the trucks' parameters, each one standard deviation."""
        names = [name for _, name, _ in self._unknowns()]
        return [np.eye(1, self.count, place)[0] for place, name in enumerate(names) if name in ESTIMATED]

    def at(self, theta: Floats) -> list[run.Condition]:
        """The conditions with the trucks, each unknown away by so many standard deviations."""
        made = [dict(one) for one in self.trucks]
        for lift in self.moved:  # what is moved in place is a copy
            own = made[LIFTS.index(lift)]
            own |= {"area": own["area"].copy(), "current": own["current"].copy()}
        for (place, name, knot), by in zip(self._unknowns(), theta, strict=False):
            own = made[place]
            if name == "area":
                own["area"][knot] *= np.exp(by * PRIORS["area"])
            elif name == "current":
                own["current"][knot] += by * PRIORS["current"]
            else:
                own[name] = own[name] * np.exp(by * PRIORS["estimated"])
        each = theta[self.count - len(OF_CONDITIONS) * len(self.conditions) :].reshape(-1, len(OF_CONDITIONS))
        return [
            replace(
                one,
                trucks=(made[0], made[1]),
                load_kg=one.load_kg + load * PRIORS["load"],
                temperature_degc=one.temperature_degc + temperature * PRIORS["temperature"],
            )
            for one, (load, temperature) in zip(self.conditions, each, strict=True)
        ]

    def _unknowns(self) -> Iterator[tuple[int, str, int]]:
        """Lift, name and knot of each of the trucks'."""
        for lift in self.moved:
            place = LIFTS.index(lift)
            yield from ((place, name, 0) for name in ESTIMATED)
            own = self.trucks[place]
            yield from ((place, "area", int(knot)) for knot in np.flatnonzero(own["area"] > 0.0))
            yield from ((place, "current", knot) for knot in range(1, len(own["current"]) - 1))


def least(
    d: Floats,
    answers: Callable[[Sequence[Floats]], list[Floats]],
    at_none: Floats,
    count: int,
    enough: float,
    alone: Sequence[Floats] = (),
) -> float:
    """The least |d − (f(θ) − f(0))|² + |θ|², as far as it takes to compare it with `enough`.

    Parameters
    ----------
    d
        (n,) what is to be imitated, in units of the noise.
    answers
        f: what trucks at some θ, each (count,) standard deviations, answer; each (n,).
    at_none
        (n,) f(0).
    enough
        The search ends below it, and where no step is likely to come as far.
    alone
        Each (count,): where the search from θ = 0 does not end below it, further ones begin at the best
        trucks in these directions.
    """
    square = float(d @ d)
    best = _searched(d, answers, at_none, _Point(np.zeros(count), at_none, square), enough, SHOWN * square)
    if best > enough:
        for start in _alone(d, answers, at_none, alone)[:SEARCHES]:
            if best > enough and start.left < SHOWN * square:
                best = min(best, _searched(d, answers, at_none, start, enough, FAR * enough))
    return best


def _alone(
    d: Floats, answers: Callable[[Sequence[Floats]], list[Floats]], at_none: Floats, ways: Sequence[Floats]
) -> list[_Point]:
    """Trucks that differ by one unknown alone and leave less than none does; the best first."""

    def reached(asked: Sequence[Floats]) -> list[_Point]:
        points = [
            _Point(own, said, _cost(d - (said - at_none), own)) for own, said in _answered(answers, asked)
        ]
        return [one for one in points if one.left < float(d @ d)]

    first = reached([sign * ALONE * way for way in ways for sign in (-1.0, 1.0)])
    beside = reached([one.theta * by for one in first for by in (0.5, 1.5)])
    return sorted((*first, *beside), key=_left)


@dataclass(frozen=True, eq=False)
class _Point:
    """A truck, what it answers, and what it leaves."""

    theta: Floats
    said: Floats
    left: float


def _left(point: _Point) -> float:
    return point.left


def _searched(
    d: Floats,
    answers: Callable[[Sequence[Floats]], list[Floats]],
    at_none: Floats,
    start: _Point,
    enough: float,
    far: float,
) -> float:
    """What the search from one start leaves, and no more than the first linear step does if that is `far`."""
    best = start
    for known in range(MOST_DERIVATIVES):
        if best.left <= enough:
            break
        columns = _derivatives(answers, best.theta, best.said)
        if columns is None:  # no step leads on from there
            break
        promised = imitated(d - (best.said - at_none) + columns @ best.theta, columns)
        if known == 0 and promised > far:
            return promised
        bends = best.left - BENDS * (best.left - promised) > enough
        if known > 0 and (bends or promised > FAR * enough):
            break
        before, best = best.left, _followed(d, answers, at_none, best, columns, enough)
        if best.left >= before:
            break
    return best.left


def _followed(
    d: Floats,
    answers: Callable[[Sequence[Floats]], list[Floats]],
    at_none: Floats,
    start: _Point,
    columns: Floats,
    enough: float,
) -> _Point:
    """The best of what chord iterations reach, one for each damping, all asked together.

    Each goes to its own minimum of |d − (f(θ) − f(0))|² + |θ|² + damping·|θ − θ₀|² with the derivatives of
    θ₀, and lives on as long as it leaves ever less. Its first step may leave more than θ₀ does.
    """
    own = np.eye(len(start.theta))
    gram = columns.T @ columns + own
    best, alive = start, [(more, start) for more in DAMPINGS]
    for chord in range(CHORDS):
        asked, before = [], {}
        for more, point in alive:
            pulled = columns.T @ (d - (point.said - at_none)) - point.theta
            step = np.linalg.solve(gram + more * own, pulled - more * (point.theta - start.theta))
            theta = point.theta + step
            if np.max(np.abs(theta), initial=0.0) <= AWAY:
                asked.append(theta)
                before[id(theta)] = more, point
        alive = []
        for theta, said in _answered(answers, asked):
            more, last = before[id(theta)]
            point = _Point(theta, said, _cost(d - (said - at_none), theta))
            best = min(best, point, key=_left)
            if chord == 0 or point.left < STALLED * last.left:
                alive.append((more, point))
        if best.left <= enough or not alive:
            break
    return best


def _derivatives(
    answers: Callable[[Sequence[Floats]], list[Floats]], theta: Floats, now: Floats
) -> Floats | None:
    """Each column the change by one standard deviation; none where a truck nearly chatters."""
    try:
        ways = answers([theta + STEP * along for along in np.eye(len(theta))])
    except FloatingPointError:
        return None
    return (np.array(ways) - now).T / STEP


def _answered(
    answers: Callable[[Sequence[Floats]], list[Floats]], asked: Sequence[Floats]
) -> Iterator[tuple[Floats, Floats]]:
    """Trucks with what they answer, but for those that chatter."""
    if not asked:
        return
    try:
        yield from zip(asked, answers(asked), strict=True)
    except FloatingPointError:
        half = len(asked) // 2
        for some in (asked[:half], asked[half:]) if half else ():
            yield from _answered(answers, some)


def imitated(d: Floats, columns: Floats) -> float:
    """The least |d - J theta|² + |theta|², where each column of J is the change by one standard deviation."""
    if columns.size == 0:
        return float(d @ d)
    gram = columns.T @ columns + np.eye(columns.shape[1])
    along = columns.T @ d
    return float(d @ d - along @ np.linalg.solve(gram, along))


def _cost(rest: Floats, theta: Floats) -> float:
    return float(rest @ rest + theta @ theta)


def _whitened(given: Draw, found: Sequence[run.Trajectory], seen: sensors.Sensors) -> Floats:
    """(n,) all channels of all probes as the sensors see them, in units of their noise; an encoder from where
    it starts, as nobody knows where on its wheel that is."""
    keep = np.exp(-run.TICK_S / given.nuisances.colour_s) if given.nuisances.colour_s > 0.0 else 0.0
    pressure = sensors.PRESSURE_NOISE_PA * given.nuisances.noise * np.sqrt((1 + keep) / (1 - keep))
    rows = []
    for one in found:
        read = sensors.read(one, seen)
        for lift in LIFTS:
            way = read[f"position_{lift}_m"]
            rows += [
                (way - way[0]) / (sensors.COUNT_M / np.sqrt(12.0)),
                read[f"pressure_{lift}_pa"] / pressure,
            ]
        if given.nuisances.height:
            rows.append(read["fork_height_m"] / (sensors.HEIGHT_NOISE_M * given.nuisances.noise))
    return np.concatenate(rows)
