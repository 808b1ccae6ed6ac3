"""What could stand for an explanation that was accepted: hypotheses with the same effect on these recordings.

Of an accepted hypothesis the whole effect d on what the model says is taken, of every other the derivative c
where the accepted one is absent (where it acts, an input's gain scales it too, and looks like it).
With J how the model's other unknowns move it, all in units of the weights, a hypothesis stands for the
accepted one as far as it takes away what the unknowns alone leave of d:

    share = 1 − min |d − J a − c b|² / min |d − J a|²,    b within what is plausible of its amplitude

A free curve is asked likewise about the same curve at other places, with all its coefficients for c and none
of them bound. To first order, and whatever was measured: it is a property of the experiment, not of its
outcome.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.threads import one_thread
from forklift.diagnosis.criteria import STANDS
from forklift.diagnosis.hypothesis import carry, with_hypotheses
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.screening import groups
from forklift.fitting.interface import Problem
from forklift.plant.protocol import Hypothesis

ABSORBED = 1e-4
"""An effect of which the model's own unknowns leave less than this share is confounded with them alone."""
ROUNDED_SLOPES = 1e-6
"""Likewise of a curve, whose effect is linear: what is left of it may be small, but its slopes, in single
precision, are good to 3e-4 of their largest (`cargo test --test dual_trajectory`), of which this is ten times
the square."""


@dataclass(frozen=True, eq=False)
class Confounded:
    """A hypothesis that these recordings cannot part from an accepted one."""

    accepted: Hypothesis
    other: Hypothesis
    share: float
    """Of the accepted one's effect that it takes over."""


def confounded(
    refit: Refit, hypotheses: Sequence[Hypothesis], elsewhere: Sequence[Hypothesis], start: Problem
) -> tuple[Confounded, ...]:
    """For every hypothesis of the refit, those that could stand for it; for its free curve, of those
    `elsewhere`. `start` is the problem without any hypothesis."""
    found: list[Confounded] = []
    accepted = {hypothesis.label for hypothesis in refit.hypotheses}
    others = [
        hypothesis for hypothesis in hypotheses if hypothesis.label not in accepted and hypothesis.amplitude
    ]
    with one_thread():
        for hypothesis in refit.hypotheses:
            if hypothesis.amplitude is not None and hypothesis.kind != "unknown":
                found += _of(refit, hypothesis, others)
            elif hypothesis.over:
                alike = [other for other in elsewhere if other.over == hypothesis.over]
                found += _of_a_curve(refit, hypothesis, alike, start) if alike else []
    return tuple(found)


def _left(problem: Problem, x: Floats, hypothesis: Hypothesis, effect: Floats) -> tuple[Floats, Floats]:
    """What the model's other unknowns leave of an effect; and an orthonormal basis of how they move what it
    says."""
    brought = {one.name for one in hypothesis.addition.free}
    own = {k for k, unknown in enumerate(problem.unknowns) if unknown.name in brought}
    basis, _ = np.linalg.qr(_slopes(problem, x)[:, [k for k in range(len(x)) if k not in own]])
    return _beyond(basis, effect), basis


def _of_a_curve(
    refit: Refit, curve: Hypothesis, elsewhere: Sequence[Hypothesis], start: Problem
) -> list[Confounded]:
    """A part has one curve of a kind, so that the others act where this one was taken out; its own effect is
    to first order, too."""
    found = refit.found.problem
    rest = [one for one in refit.hypotheses if one is not curve]
    without = with_hypotheses(start, rest).weighted(found.sigma, found.substeps)
    x = carry(refit.found.x, found, without)
    own = _derived(without, x, [curve])
    if own is None:
        return []
    told = dict(zip((one.name for one in found.unknowns), refit.found.x.tolist(), strict=False))
    effect = np.column_stack(own) @ [told[name] for name in curve.amplitudes]
    left, basis = _left(without, x, curve, effect)
    square = float(left @ left)
    if square <= ROUNDED_SLOPES * float(effect @ effect):
        return []
    best: dict[str, Confounded] = {}
    for other in elsewhere:
        columns = _derived(without, x, [other])
        if columns is None:
            continue
        span, _ = np.linalg.qr(_beyond(basis, np.column_stack(columns)))
        share = float(np.sum((span.T @ left) ** 2)) / square
        if share >= STANDS and (other.equation not in best or share > best[other.equation].share):
            best[other.equation] = Confounded(curve, other, share)
    return sorted(best.values(), key=lambda confounded: -confounded.share)


def _beyond(basis: Floats, columns: Floats) -> Floats:
    """What a basis leaves of columns."""
    beyond: Floats = columns - basis @ (basis.T @ columns)
    return beyond


def _of(refit: Refit, hypothesis: Hypothesis, others: Sequence[Hypothesis]) -> list[Confounded]:
    problem, x = refit.found.problem, refit.found.x
    names = [unknown.name for unknown in problem.unknowns]
    place = names.index(str(hypothesis.amplitude))
    absent = x.copy()
    absent[place] = 0.0
    effect = _said(problem, x) - _said(problem, absent)
    rest, basis = _left(problem, x, hypothesis, effect)
    square = float(rest @ rest)
    if square <= ABSORBED * float(effect @ effect):
        return []
    best: dict[str, Confounded] = {}
    for other, column in _columns(problem, absent, others):
        left = _beyond(basis, column)
        size = float(left @ left)
        if size <= ABSORBED * float(column @ column):
            continue
        amount = float(np.clip(left @ rest / size, *_ends(problem, other)))
        gap = rest - amount * left
        share = 1.0 - float(gap @ gap) / square
        if share >= STANDS and (other.label not in best or share > best[other.label].share):
            best[other.label] = Confounded(hypothesis, other, share)
    return sorted(best.values(), key=lambda confounded: -confounded.share)


def _ends(problem: Problem, other: Hypothesis) -> tuple[float, float]:
    """How far the other's amplitude may plausibly go, in its prior's deviations."""
    return next(
        (unknown.lower, unknown.upper)
        for unknown in with_hypotheses(problem, [other]).unknowns
        if unknown.name == other.amplitude
    )


def _columns(
    problem: Problem, x: Floats, others: Sequence[Hypothesis]
) -> Iterator[tuple[Hypothesis, Floats]]:
    """Of every other hypothesis that moves anything, how what the model says answers it in the accepted one's
    place: exact derivatives, several in one run."""
    for group in groups(problem, others):
        found = _derived(problem, x, group)
        if found is None and len(group) > 1:  # one of them has no answer
            for other in group:
                yield from _columns(problem, x, [other])
        for other, column in zip(group, found or (), strict=False):
            if np.any(column):
                yield other, column


def _derived(problem: Problem, x: Floats, group: Sequence[Hypothesis]) -> list[Floats] | None:
    more = with_hypotheses(problem, group)
    names = [name for other in group for name in other.amplitudes]
    held, at = more.with_fixed(carry(x, problem, more), names, conditions=False)
    known = [unknown.name for unknown in held.unknowns]
    try:
        slopes = _slopes(held, at)[:, [known.index(name) for name in names]]
    except ForkliftError:
        return None
    return list(slopes.T) if np.isfinite(slopes).all() else None


def _said(problem: Problem, x: Floats) -> Floats:
    """What the model says, in units of the weights."""
    return np.concatenate(
        [said / problem.sigma[name] for run in problem.said(x) for name, said in run.items()]
    )


def _slopes(problem: Problem, x: Floats) -> Floats:
    """(samples, unknowns) of the same."""
    rows = []
    for k, run in enumerate(problem.linearise(x)):
        for name, slope in run.slope.items():
            wide = np.zeros((len(slope), len(x)))
            wide[:, problem.columns(k)] = slope / problem.sigma[name]
            rows.append(wide)
    return np.vstack(rows)
