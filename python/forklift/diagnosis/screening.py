"""Which hypotheses could explain what is left over: all of them at once, without a refit.

At an early optimum every hypothesis is differentiated once, at its quiet value, several in one run. How far
the cost would fall if the hypothesis's amplitude and all other unknowns took the best linear step together is
½ gᵀN⁻¹g: a score test (Rao 1948) with all parameters of the machine projected off. Any pair costs no more
than solving once again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.diagnosis.criteria import UNTOLD
from forklift.diagnosis.hypothesis import carry, with_hypotheses
from forklift.diagnosis.rounding import rounded
from forklift.diagnosis.whitening import whitened
from forklift.fitting.interface import Problem, Sample
from forklift.fitting.observed import Observed
from forklift.plant.protocol import Hypothesis

SOFT = 0.3
"""Softness of an encoder's edges, in counts."""
TOGETHER = 16
"""Amplitudes that share a run: as many as the core carries at once."""

Stack = Callable[[Sequence[Mapping[str, Floats]]], list[Floats]]
"""All channels of each recording in one column."""


@dataclass(frozen=True)
class Screened:
    """What one hypothesis, or several together, promise."""

    hypotheses: tuple[Hypothesis, ...]
    gain: float
    """How far −ln posterior would fall."""
    amplitudes: tuple[float, ...]
    """The best linear step of each amplitude, in its prior's deviations (a curve's first); not a number for
    conditions."""
    deviations: tuple[float, ...]
    """Standard deviation of each amplitude beside all other unknowns, in its prior's; likewise."""
    evidence: float = float("nan")
    """Gain less what the freedom of all its amplitudes costs: ln of the ratio of the marginal likelihoods
    with and without, both linear about the same place (Laplace's approximation)."""
    heard: float = float("nan")
    """Of a faint curve, the evidence that may raise an alarm: see `curves.FreeCurves.faint`."""

    @property
    def worth(self) -> float:
        """By which the most promising goes first: its gain, less what a freedom in every recording costs."""
        return self.evidence if self.hypotheses[0].amplitude is None else self.gain

    @property
    def testable(self) -> bool:
        """Whether these recordings tell the amplitude at all."""
        return not any(deviation >= UNTOLD for deviation in self.deviations)


@dataclass(frozen=True)
class Screening:
    """All hypotheses at one optimum."""

    cost: float
    """−ln posterior there."""
    singles: tuple[Screened, ...]
    """The most promising first."""
    pairs: tuple[Screened, ...]
    untestable: tuple[Hypothesis, ...]
    """Hypotheses whose first step moves nothing that is measured."""
    ranked: tuple[Screened, ...] = ()
    """Each alone, with all that share a label."""

    @property
    def unidentifiable(self) -> tuple[Hypothesis, ...]:
        """Hypotheses that may have any size, or none, as far as these recordings tell."""
        loose = [found.hypotheses[0] for found in self.singles if not found.testable]
        return (*self.untestable, *loose)

    def only(self, singles: Sequence[Screened]) -> Screening:
        """The same of some of its singles, and of the pairs of these."""
        names = {found.hypotheses[0] for found in singles}
        pairs = [pair for pair in self.pairs if names.issuperset(pair.hypotheses)]
        return replace(self, singles=tuple(singles), pairs=tuple(pairs))

    def variants(self, hypothesis: Hypothesis) -> tuple[Hypothesis, ...]:
        """All under the hypothesis's label, the most promising first."""
        return tuple(
            found.hypotheses[0] for found in self.ranked if found.hypotheses[0].label == hypothesis.label
        )


@dataclass
class _Column:
    """What one hypothesis adds to the linear problem."""

    hypothesis: Hypothesis
    blocks: list[Floats]
    """Per recording (samples, columns)."""
    own: bool
    """Each recording has columns of its own."""


def screen(
    problem: Problem,
    x: Floats,
    hypotheses: Sequence[Hypothesis],
    most: int = 8,
    *,
    slow: bool = False,
) -> Screening:
    """Every hypothesis at x, and the pairs of the `most` most promising.

    `slow`: with what slow noise has in common taken off, so that chance promises no more than among white
    noise: where next to nothing is left over.
    """
    (linear,) = _linear(problem, x, hypotheses, slow=slow)
    return _screening(*linear, hypotheses, most)


def screen_both(
    problem: Problem, x: Floats, hypotheses: Sequence[Hypothesis], *, slow: bool = False
) -> tuple[Screening, Screening]:
    """By all sensors and without the encoders, from the same runs; see `screen`."""
    by_all, without = _linear(problem, x, hypotheses, slow=slow, encoders=[True, False])
    return _screening(*by_all, hypotheses, 0), _screening(*without, hypotheses, 0)


def _screening(
    base: _Base, columns: Sequence[_Column], hypotheses: Sequence[Hypothesis], most: int
) -> Screening:
    known = base.project(columns) if columns else {}
    untestable = [hypothesis for hypothesis in hypotheses if hypothesis not in known]
    ranked = sorted((base.gain([one]) for one in known.values()), key=lambda found: -found.gain)
    first = {found.hypotheses[0].label: found for found in reversed(ranked)}  # the best under each label
    singles = sorted(first.values(), key=lambda found: -found.worth)
    best = {found.hypotheses[0] for found in singles[:most]}
    pairs = [
        base.gain(pair)
        for pair in combinations([one for hypothesis, one in known.items() if hypothesis in best], 2)
    ]
    pairs.sort(key=lambda found: -found.gain)
    told = {found.hypotheses[0].label for found in singles}
    without = {hypothesis.label: hypothesis for hypothesis in untestable if hypothesis.label not in told}
    return Screening(base.cost, tuple(singles), tuple(pairs), tuple(without.values()), tuple(ranked))


def loo_log_scores(problem: Problem, x: Floats, hypotheses: Sequence[Hypothesis]) -> Floats:
    """How much better all other recordings foretell each one with these hypotheses than without.

    Of each recording ln p(recording | the others, hypotheses) - ln p(recording | the others), the
    difference of two evidences of the problem linear about x (leave-one-out logarithmic score; Gneiting &
    Raftery 2007, section 7.1): every recording counts, and none speaks for itself. Without number, where a
    hypothesis moves nothing that is measured. Slow noise counts as often as it is independent.
    """
    ((base, columns),) = _linear(problem, x, hypotheses, slow=True)
    if len(columns) < len(hypotheses):
        return np.full(len(problem.samples), np.nan)
    return base.loo_log_scores(columns)


def _linear(
    problem: Problem,
    x: Floats,
    hypotheses: Sequence[Hypothesis],
    *,
    slow: bool = False,
    encoders: Sequence[bool] = (True,),
) -> list[tuple[_Base, list[_Column]]]:
    """The problem linear about x, and what those hypotheses add to it that move anything; `slow`: with what
    slow noise has in common taken off, so that the normal equations are those of its likelihood; for each of
    `encoders`: by what they read, too, or not."""
    problem = at_noise(problem)
    runs = problem.linearise(x)
    stacks: list[Stack] = [partial(_stacked, problem, slow=slow, encoders=one) for one in encoders]
    columns: list[dict[Hypothesis, _Column]] = [{} for _ in stacks]
    for several in _probed(problem, x, hypotheses, stacks):
        for known, some in zip(columns, several, strict=True):
            known.update({column.hypothesis: column for column in some})
    return [
        (
            _Base(problem, x, stack([run.residual for run in runs]), stack([run.jacobian for run in runs])),
            [known[hypothesis] for hypothesis in hypotheses if hypothesis in known],
        )
        for stack, known in zip(stacks, columns, strict=True)
    ]


def _stacked(
    problem: Problem, parts: Sequence[Mapping[str, Floats]], *, slow: bool, encoders: bool
) -> list[Floats]:
    """Rows of every recording, its channels one below the other, each as often as it is independent."""

    def independent(sample: Sample, seen: Observed, rows: Floats) -> Floats:
        if not encoders and seen.sensor.count:
            return np.zeros_like(rows)
        if slow and seen.sensor.correlation:
            return whitened(seen, sample.recording.time_s, rows)
        return rounded(seen.sensor, rows)

    return [
        np.concatenate([independent(sample, seen, part[seen.sensor.channel]) for seen in sample.observed])
        for sample, part in zip(problem.samples, parts, strict=True)
    ]


def at_noise(problem: Problem) -> Problem:
    """The problem with the sensors' own noise, and encoders with edges soft enough for a linear step."""
    sensors = [seen.sensor for sample in problem.samples for seen in sample.observed]
    return problem.weighted({one.channel: SOFT * one.count if one.count else one.noise for one in sensors})


def _probed(
    problem: Problem, x: Floats, hypotheses: Sequence[Hypothesis], stacks: Sequence[Stack]
) -> Iterator[list[list[_Column]]]:
    """How the residuals answer each hypothesis, at its quiet value, with all else held at x; of each stack
    only of those that move anything.

    What is quiet changes no bit of the model, nor of how it answers the others: several share a run.
    """
    for group in groups(problem, hypotheses):
        try:
            columns = _probe(problem, x, group, stacks)
        except ForkliftError as error:
            if error.code == "plant-invalid":  # a mistake in a user's effect, which else were never tried
                raise
            columns = None
        if columns is not None:
            yield columns
        elif len(group) > 1:
            for hypothesis in group:
                yield from _probed(problem, x, [hypothesis], stacks)


def groups(problem: Problem, hypotheses: Sequence[Hypothesis]) -> list[list[Hypothesis]]:
    """In each those that have no unknown in common, with `TOGETHER` amplitudes at most.

    Physics of the whole machine joins its parts, which without it run one by one, and stands apart.
    """
    before = {unknown.name for unknown in problem.unknowns}
    added = [
        {unknown.name for unknown in with_hypotheses(problem, [hypothesis]).unknowns} - before
        for hypothesis in hypotheses
    ]
    joins = [hypothesis.kind == "physics" and not hypothesis.where for hypothesis in hypotheses]
    groups: list[list[int]] = []

    def fits(k: int, group: list[int]) -> bool:
        amplitudes = sum(len(hypotheses[j].amplitudes) for j in (*group, k))
        alike = all(joins[j] == joins[k] for j in group)
        return alike and amplitudes <= TOGETHER and all(added[j].isdisjoint(added[k]) for j in group)

    for k in range(len(hypotheses)):
        group = next((group for group in groups if fits(k, group)), [])
        if not group:
            groups.append(group)
        group.append(k)
    return [[hypotheses[k] for k in group] for group in groups]


def _probe(
    problem: Problem, x: Floats, group: Sequence[Hypothesis], stacks: Sequence[Stack]
) -> list[list[_Column]] | None:
    """All hypotheses of a group from one run, for each stack; None if it has no answer."""
    refit: Problem = with_hypotheses(problem, group)
    amplitudes = [name for hypothesis in group for name in hypothesis.amplitudes]
    conditions = any(not hypothesis.amplitudes for hypothesis in group)
    held, at = refit.with_fixed(carry(x, problem, refit), amplitudes, conditions=conditions)
    runs = [run.jacobian for run in held.linearise(at)]
    several = [stack(runs) for stack in stacks]
    if not all(np.isfinite(jacobian).all() for jacobians in several for jacobian in jacobians):
        return None
    names = [unknown.name for unknown in held.unknowns]
    return [_columns(refit, group, names, jacobians) for jacobians in several]


def _columns(
    refit: Problem,
    group: Sequence[Hypothesis],
    names: Sequence[str],
    jacobians: Sequence[Floats],
) -> list[_Column]:
    """What each of a group adds, of the slopes along these names and what recordings have of their own."""
    columns = []
    for hypothesis in group:
        if hypothesis.amplitudes:
            places = [names.index(name) for name in hypothesis.amplitudes]
            blocks = [jacobian[:, places] for jacobian in jacobians]
        else:
            doubted = hypothesis.addition.widened[0][0]
            blocks = []
            for sample, jacobian in zip(refit.samples, jacobians, strict=True):
                place = sample.names.index(doubted)
                column = len(names) + int(np.flatnonzero(sample.free == place)[0])
                blocks.append(jacobian[:, column][:, None])
        if any(block.any() for block in blocks):
            columns.append(_Column(hypothesis, blocks, hypothesis.amplitude is None))
    return columns


@dataclass(frozen=True)
class _Projected:
    """What a hypothesis has in common with the unknowns of a linear problem, see `_Base`."""

    column: _Column
    cross: Floats
    """Jᵀc."""
    taken: Floats
    """N⁻¹Jᵀc."""
    pull: Floats
    """h."""


class _Base:
    """The normal equations without hypotheses, and what hypotheses add to them.

    With N the normal equations without and g their gradient, c the columns that hypotheses add, all other
    unknowns projected off these leave M = cᵀc + I − (cᵀJ) N⁻¹ (Jᵀc) and h = cᵀr − (cᵀJ) N⁻¹ g: a few
    numbers each. They give the gain ½ hᵀM⁻¹h, the step −M⁻¹h and the deviations.
    """

    def __init__(self, problem: Problem, x: Floats, residual: list[Floats], jacobian: list[Floats]) -> None:
        rho, slope = problem.prior(x)
        self.residual, self.jacobian = residual, jacobian
        self.places = [problem.columns(k) for k in range(len(residual))]
        self.normal, self.gradient = np.diag(slope**2), slope * rho
        square = float(rho @ rho)
        for place, own, rest in zip(self.places, jacobian, residual, strict=True):
            self.normal[np.ix_(place, place)] += own.T @ own
            self.gradient[place] += own.T @ rest
            square += float(rest @ rest)
        self.cost = 0.5 * square

    def project(self, columns: Sequence[_Column]) -> dict[Hypothesis, _Projected]:
        """What each hypothesis has in common with the unknowns, worked out for all of them at once."""
        widths = self._widths(columns)
        ends = np.cumsum([0, *widths])
        cross, pull = np.zeros((len(self.gradient), ends[-1])), np.zeros(ends[-1])
        for k, (place, own, rest) in enumerate(zip(self.places, self.jacobian, self.residual, strict=True)):
            at = self._taken(columns, ends, k)
            blocks = np.hstack([one.blocks[k] for one in columns])
            cross[np.ix_(place, at)] += own.T @ blocks
            pull[at] += blocks.T @ rest
        solved = np.linalg.solve(self.normal, np.column_stack([cross, self.gradient]))
        taken, alone = solved[:, :-1], solved[:, -1]
        return {
            one.hypothesis: _Projected(
                one, cross[:, part], taken[:, part], pull[part] - cross[:, part].T @ alone
            )
            for one, part in zip(columns, map(slice, ends, ends[1:]), strict=True)
        }

    def gain(self, several: Sequence[_Projected]) -> Screened:
        """What these hypotheses together take off the cost, beyond what a step without them would."""
        columns = [one.column for one in several]
        widths = self._widths(columns)
        ends = np.cumsum([0, *widths])
        matrix, pull = np.eye(ends[-1]), np.concatenate([one.pull for one in several])
        for k in range(len(self.residual)):
            at = self._taken(columns, ends, k)
            blocks = np.hstack([one.blocks[k] for one in columns])
            matrix[np.ix_(at, at)] += blocks.T @ blocks
        matrix -= np.hstack([one.cross for one in several]).T @ np.hstack([one.taken for one in several])
        step = -np.linalg.solve(matrix, pull)
        deviation = np.sqrt(np.diag(np.linalg.inv(matrix)))
        firsts = list(zip(columns, ends.tolist(), strict=False))
        gain = -0.5 * float(pull @ step)
        freedom = 0.5 * float(np.linalg.slogdet(matrix)[1])
        return Screened(
            tuple(column.hypothesis for column in columns),
            gain,
            tuple(float("nan") if column.own else float(step[first]) for column, first in firsts),
            tuple(float("nan") if column.own else float(deviation[first]) for column, first in firsts),
            gain - freedom,
        )

    @staticmethod
    def _taken(columns: Sequence[_Column], ends: NDArray[np.intp], k: int) -> NDArray[np.intp]:
        """Which of all columns recording k has."""
        each = [
            first + (np.array([k]) if one.own else np.arange(one.blocks[k].shape[1]))
            for first, one in zip(ends, columns, strict=False)
        ]
        return np.concatenate(each)

    def loo_log_scores(self, columns: Sequence[_Column]) -> Floats:
        """The logarithmic scores of the function of this name."""
        normal, gradient, blocks = self._beside(columns)
        plain, scores = slice(len(self.gradient)), []

        def evidence(normal: Floats, gradient: Floats) -> float:
            return self._drop(normal, gradient) - 0.5 * float(np.linalg.slogdet(normal)[1])

        def difference(normal: Floats, gradient: Floats) -> float:
            return evidence(normal, gradient) - evidence(normal[plain, plain], gradient[plain])

        everyone = difference(normal, gradient)
        for place, own, block, rest in zip(self.places, self.jacobian, blocks, self.residual, strict=True):
            part = np.zeros((len(rest), len(gradient)))
            part[:, place] = own
            part[:, plain.stop :] = block
            scores.append(everyone - difference(normal - part.T @ part, gradient - part.T @ rest))
        return np.array(scores)

    def _widths(self, columns: Sequence[_Column]) -> list[int]:
        return [len(self.residual) if column.own else column.blocks[0].shape[1] for column in columns]

    def _beside(self, columns: Sequence[_Column]) -> tuple[Floats, Floats, list[Floats]]:
        """Normal equations and gradient with these hypotheses, and of each recording their own columns."""
        width = self._widths(columns)
        total, size = len(self.gradient), sum(width)
        cross, corner, gradient = np.zeros((total, size)), np.eye(size), np.zeros(size)
        blocks = []
        for k, (place, own, rest) in enumerate(zip(self.places, self.jacobian, self.residual, strict=True)):
            block = np.zeros((len(rest), size))
            first = 0
            for column, wide in zip(columns, width, strict=True):
                at = [first + k] if column.own else range(first, first + wide)
                block[:, at] = column.blocks[k]
                first += wide
            cross[place] += own.T @ block
            corner += block.T @ block
            gradient += block.T @ rest
            blocks.append(block)
        normal = np.block([[self.normal, cross], [cross.T, corner]])
        return normal, np.concatenate([self.gradient, gradient]), blocks

    @staticmethod
    def _drop(normal: Floats, gradient: Floats) -> float:
        return 0.5 * float(gradient @ np.linalg.solve(normal, gradient))
