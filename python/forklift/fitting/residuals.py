"""How well a truck explains recordings it was not fitted on, in units of the sensors' own noise.

What a recording cannot be blamed for is taken off first: for each recording the deviation of the truck's
parameters (with their uncertainty from the fit), of its oil temperature and of its start that explains it
best, all channels together. Of a complete model the mean square that is left is about 1, and what is left
is white.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import chdtrc

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.fitting.criteria import AT_NOISE as AT_NOISE
from forklift.fitting.criteria import BY_CHANCE, FAR, ROUNDING, STRAIN, WHITE
from forklift.fitting.levenberg_marquardt import LOST

if TYPE_CHECKING:
    from forklift.fitting.interface import Problem, Sample
    from forklift.fitting.linearised import Linearised
    from forklift.fitting.observed import Observed
    from forklift.recordings.noise import Sensor


LAGS = 25
"""Of the Ljung–Box test."""
MOST_MOVES = 4
HALVINGS = 5
SHARES = (1.0, 0.5, 0.25, 0.0)
"""Of a straight step, of which the one that leaves least over is taken."""

Seek = Callable[[Any, Floats], Floats]
"""Given a problem and a place: the same with each recording's own unknowns where they explain it best."""


@dataclass(frozen=True, eq=False)
class ChannelResidual:
    """One channel of one recording, judged."""

    file: str
    role: str
    group: str
    """What the recording belongs together with."""
    channel: str
    samples: int
    mean_square: float
    """Of what is left, in units of the sensor's noise (an encoder's: count/√12)."""
    whiteness: float | None
    """p-value of the Ljung–Box test over `LAGS` lags; None for an encoder, whose error is not white while
    the truck moves slowly, and for a channel with gaps."""
    rows: NDArray[np.intp]
    """(samples,) the recording's samples that were finite."""
    left: Floats
    """(samples,) residual in units of noise, measured less simulated."""

    independent: float = 1.0
    """Share of the samples whose noise is independent: an encoder at rest is rounded once."""
    unsure: float = 0.0
    """Of slow noise the standard deviation of its variance, as a share of it."""
    blocks: int = 1
    """How many stretches of the recording err independently."""
    instants: NDArray[np.intp] | None = None
    """Rows at which a channel on a clock of its own was sampled, missing samples among them; None: all."""

    def series(self, length: int) -> Floats:
        """The residual at every sample of the channel, 0 where one is missing; `length` rows in all."""
        if self.instants is None:
            values = np.zeros(length)
            values[self.rows] = self.left
        else:
            values = np.zeros(len(self.instants))
            values[np.searchsorted(self.instants, self.rows)] = self.left
        return values

    def at_samples(self, given: Floats) -> Floats:
        """What is given at all rows, at the channel's samples; 0 where one is missing."""
        seen = np.zeros_like(given)
        seen[self.rows] = given[self.rows]
        return seen if self.instants is None else seen[self.instants]

    strain: float = 0.0
    """What the recording's own unknowns cost by their prior beyond chance, in squares: in the channel they
    moved most. What a model lacks must not hide in an oil temperature that no sensor can be off by."""
    freedom: float = 0.0
    """ln det of how much the recording narrows its own unknowns' prior, likewise in one channel: twice what
    their freedom costs in ln of the marginal likelihood."""

    @property
    def bound(self) -> float:
        """Mean square up to which nothing is left over that the sensor's noise does not explain."""
        scatter = sqrt(2.0 / (self.samples * self.independent))
        white = AT_NOISE * (1.0 + scatter)
        return max(white, 1.0 + BY_CHANCE * hypot(scatter, self.unsure)) if self.unsure else white

    @property
    def explained(self) -> bool:
        """Whether nothing is left over that the sensor's noise does not explain, and nothing is strained.

        What would be lost among many samples (a load that is ten deviations off) must not count as noise.
        """
        return self.mean_square <= self.bound and self.strain <= STRAIN

    @property
    def excess(self) -> float:
        """What is left over the noise: n (mean square − 1), at least 0."""
        return self.samples * max(self.mean_square - 1.0, 0.0)

    @property
    def cost(self) -> float:
        """−2 ln of the recording's marginal likelihood, as far as this channel says, up to a constant."""
        return self.samples * self.mean_square + self.freedom

    @property
    def white(self) -> bool | None:
        return None if self.whiteness is None else self.whiteness >= WHITE


def judge(
    problem: Problem,
    theta: Floats,
    covariance: Floats,
    sensors: Mapping[str, Sensor],
    *,
    far: float = FAR,
    moves: int = MOST_MOVES,
    seek: Seek | None = None,
    at: Floats | None = None,
) -> list[ChannelResidual]:
    """Every channel of every recording of `problem`, at the shared unknowns θ known to `covariance`.

    The channels pull with the problem's weights, so that one the model cannot follow does not bend the
    others; what is left is then told in units of the sensors' noise. A recording's own unknowns that move by
    more than `far` are linearised anew, at most in `moves` places; `seek` is asked first where they may be,
    unless that is known: `at`.
    """
    x, runs, steps = _settled(problem, theta, covariance, far, moves, seek, at)
    judged = []
    for k, (sample, run, step) in enumerate(zip(problem.samples, runs, steps, strict=True)):
        step = _within(sample, run, step, problem.nuisance(x, k), sensors)
        own = problem.nuisance(x, k) + step[len(theta) :]
        judged += _paid(_judge(sample, run, step, sensors), run, own)
    return judged


def _paid(judged: list[ChannelResidual], at: Linearised, own: Floats) -> list[ChannelResidual]:
    """With what the recording's own unknowns cost, in the channel that pulls them most."""
    if not judged or not len(own):
        return judged
    pulls = [float(np.sum((at.jacobian[one.channel][:, -len(own) :] @ own) ** 2)) for one in judged]
    most = int(np.argmax(pulls))
    rows = np.vstack([at.jacobian[one.channel][:, -len(own) :] for one in judged])
    with np.errstate(over="ignore", invalid="ignore"):  # where a machine swings up by itself
        freedom = float(np.linalg.slogdet(np.eye(len(own)) + rows.T @ rows)[1])
    strain = max(float(own @ own) - STRAIN, 0.0)
    one = judged[most]
    square = one.mean_square + strain / one.samples
    judged[most] = replace(one, mean_square=square, strain=strain, freedom=freedom)
    return judged


def settled(problem: Problem, theta: Floats, *, far: float, moves: int) -> Floats:
    """The unknown vector at θ with each recording's own unknowns where they explain it best.

    What the recordings share is held, so that it is not differentiated along.
    """
    held, at = problem.with_fixed(problem.at(theta), (), conditions=True)
    n = len(held.unknowns)
    x, _, steps = _settled(held, at[:n], np.zeros((n, n)), far, moves)
    own = x[n:] + np.concatenate([np.zeros(0), *(step[n:] for step in steps)])
    return np.concatenate([theta[: len(problem.unknowns)], own])


def _settled(
    problem: Problem,
    theta: Floats,
    covariance: Floats,
    far_off: float,
    moves: int,
    seek: Seek | None = None,
    at: Floats | None = None,
) -> tuple[Floats, list[Linearised], list[Floats]]:
    """Where each recording was last linearised, how, and the step from there.

    Only recordings whose own unknowns move far are sought and linearised anew; the others stay as they are.
    """
    x = problem.at(theta) if at is None else at.copy()
    if seek is not None and at is None:
        far = _far(problem, _own_steps(problem, x), far_off)
        if far:
            part, here = _part(problem, x, far)
            _put(problem, x, far, part, seek(part, here))
    runs, steps = _stepped(problem, x, covariance)
    for _ in range(moves):
        far = _far(problem, steps, far_off)
        if not far:
            break
        part, here = _part(problem, x, far)
        own = np.concatenate([np.zeros(len(problem.unknowns)), *(_own(problem, steps[k]) for k in far)])
        before = _squares(part, here, [_stacked(runs[k]) for k in far])
        there = _towards(part, here, np.clip(here + own, *part.bounds()), before)
        _put(problem, x, far, part, there)
        for k, run, step in zip(far, *_stepped(part, there, covariance), strict=True):
            runs[k], steps[k] = run, step
    return x, runs, steps


def _part(problem: Problem, x: Floats, which: Sequence[int]) -> tuple[Problem, Floats]:
    """The problem over these recordings alone, and the same place in it."""
    own = [problem.nuisance(x, k) for k in which]
    part = problem.over([problem.samples[k] for k in which])
    return part, np.concatenate([x[: len(problem.unknowns)], *own])


def _put(problem: Problem, x: Floats, which: Sequence[int], part: Problem, at: Floats) -> None:
    """What these recordings have of their own, written back into x."""
    for j, k in enumerate(which):
        x[problem.starts[k] : problem.starts[k + 1]] = part.nuisance(at, j)


def _own_steps(problem: Problem, x: Floats) -> list[Floats]:
    """The steps at x if what recordings share is held, so that it is not differentiated along."""
    held, at = problem.with_fixed(x, (), conditions=True)
    n, shared = len(held.unknowns), np.zeros(len(problem.unknowns))
    _, steps = _stepped(held, at, np.zeros((n, n)))
    return [np.concatenate([shared, step[n:]]) for step in steps]


def _own(problem: Problem, step: Floats) -> Floats:
    """The share of a step that is the recording's own."""
    return step[len(problem.unknowns) :]


def _stepped(problem: Problem, x: Floats, covariance: Floats) -> tuple[list[Linearised], list[Floats]]:
    """Every recording linearised at x, and its step from there."""
    runs = problem.linearise(x)
    return runs, [
        _step(sample, at, covariance, problem.nuisance(x, k))
        for k, (sample, at) in enumerate(zip(problem.samples, runs, strict=True))
    ]


def _far(problem: Problem, steps: list[Floats], far: float) -> list[int]:
    """Of which recordings anything of their own moves far."""
    return [k for k, step in enumerate(steps) if np.any(np.abs(_own(problem, step)) > far)]


def _towards(problem: Problem, x: Floats, there: Floats, before: Floats) -> Floats:
    """There, each recording's own unknowns half as far as often as it is explained worse there than at x, or
    better half-way. `before` is what each leaves over at x.

    Far from a recording its robust residuals bend, and a straight step goes too far: where it ends as far off
    on the other side, steps would go to and fro. Where the machine swings up by itself its slopes lead to
    loads and temperatures that nothing can be simulated at: then it stays at x.
    """
    try:
        squares = _squares(problem, there, problem.residuals(there))
    except ForkliftError:  # no way there
        return x
    for _ in range(HALVINGS):
        half = 0.5 * (x + there)
        halved = _squares(problem, half, problem.residuals(half))
        nearer = (squares > before) | (halved < squares)
        if not nearer.any():
            break
        for k in np.flatnonzero(nearer):
            own = slice(problem.starts[k], problem.starts[k + 1])
            there[own] = half[own]
            squares[k] = halved[k]
    return there


def _stacked(at: Linearised) -> Floats:
    """The residuals of all channels; none where nothing was read."""
    return np.concatenate([np.zeros(0), *at.residual.values()])


def _squares(problem: Problem, x: Floats, residuals: Sequence[Floats]) -> Floats:
    """(recordings,) what each leaves over, with what its own unknowns cost."""
    return np.array(
        [float(rho @ rho) + float(np.sum(problem.nuisance(x, k) ** 2)) for k, rho in enumerate(residuals)]
    )


def _step(sample: Sample, at: Linearised, covariance: Floats, own: Floats) -> Floats:
    """From θ and the recording's own unknowns to where they explain it best; none where the slopes have grown
    beyond what a step can be worked out from."""
    prior = block_diag(covariance, np.eye(len(sample.free)))
    jacobian = np.vstack([at.jacobian[name] for name in at.residual])
    residual = np.concatenate([at.residual[name] for name in at.residual])
    here = np.concatenate([np.zeros(len(covariance)), own])
    # −(C⁻¹ + JᵀJ)⁻¹ (Jᵀr + C⁻¹x) without inverting C, which may be nearly singular
    with np.errstate(over="ignore", invalid="ignore"):
        normal = jacobian.T @ jacobian
    if not np.diag(normal).max(initial=0.0) < LOST:
        return np.zeros(len(prior))
    return -np.linalg.solve(np.eye(len(prior)) + prior @ normal, prior @ (jacobian.T @ residual) + here)


def _judge(
    sample: Sample, at: Linearised, step: Floats, sensors: Mapping[str, Sensor]
) -> list[ChannelResidual]:
    judged = []
    for seen in sample.observed:
        name, sensor = seen.sensor.channel, sensors[seen.sensor.channel]
        left = _left(seen, at, step, sensor)
        even = len(left) == (len(sample.recording) if seen.instants is None else len(seen.instants))
        whiteness = ljung_box(left, slow=sensor.correlation > 0.0) if even and not sensor.count else None
        judged.append(
            ChannelResidual(
                sample.recording.file,
                sample.recording.role,
                sample.recording.group,
                name,
                len(left),
                float(np.mean(left**2)),
                whiteness,
                seen.rows,
                left,
                still_stretches(seen.values) / len(left) if sensor.count else sensor.independent,
                sensor.unsure,
                sample.recording.blocks,
                seen.instants,
            )
        )
    return judged


def _left(seen: Observed, at: Linearised, step: Floats, sensor: Sensor) -> Floats:
    """What a channel leaves over after a step, in units of the sensor's noise; of an encoder but for what it
    is rounded by throughout."""
    name = seen.sensor.channel
    left: Floats = seen.left(at.model[name] + at.slope[name] @ step) / sensor.noise
    return left - np.clip(left.mean(), -ROUNDING, ROUNDING) if sensor.count else left


def _within(
    sample: Sample, at: Linearised, step: Floats, own: Floats, sensors: Mapping[str, Sensor]
) -> Floats:
    """The step, shortened where a shorter one leaves less over.

    Where an encoder stands still, only the few samples at a count's edge pull, and their straight line leads
    far beyond the next.
    """

    def square(share: float) -> float:
        moved = own + share * step[len(step) - len(own) :]
        left = [_left(seen, at, share * step, sensors[seen.sensor.channel]) for seen in sample.observed]
        return sum(float(one @ one) for one in left) + float(moved @ moved)

    return step * min(SHARES, key=square)


def still_stretches(values: Floats) -> float:
    """Of how many samples with independent rounding the mean is as good: n²/Σ l², l the lengths of the
    stretches in which the reading stands still."""
    ends = np.flatnonzero(np.diff(values) != 0.0)
    lengths = np.diff(np.r_[-1, ends, len(values) - 1])
    return float(len(values) ** 2 / np.sum(lengths**2.0))


def ljung_box(residual: Floats, lags: int = LAGS, *, slow: bool = False) -> float | None:
    """p-value of whiteness (Ljung & Box 1978): Q = n(n + 2) Σ r_k²/(n − k) is χ² with `lags` degrees.

    Of a `slow` sensor, whose noise goes on from sample to sample, an autoregression of order one is fitted
    before, and Q has a degree less. None if there are too few samples or the residual is constant.
    """
    centred = residual - residual.mean()
    if slow and len(centred) > 1 and np.any(centred[:-1]):
        centred = centred[1:] - (centred[1:] @ centred[:-1]) / (centred[:-1] @ centred[:-1]) * centred[:-1]
    n, energy = len(centred), float(centred @ centred)
    if n <= 2 * lags or energy == 0.0:
        return None
    correlation = np.array([centred[k:] @ centred[:-k] for k in range(1, lags + 1)]) / energy
    q = n * (n + 2.0) * np.sum(correlation**2 / (n - np.arange(1, lags + 1)))
    return float(chdtrc(lags - slow, q))
