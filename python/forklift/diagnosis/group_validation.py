"""Does what was found hold where it was not fitted? Each group of recordings left out in turn.

A pressure, a load or a level is left out whole: both models are fitted anew to all other recordings, from
where the selection left them, and judged on the group. A term that gains nothing there holds in its own
groups only, and is no physics.

A group is foretold only where the others tell the model's own parameters that it depends on. With C their
covariance from the others, and S what the group's N samples tell of them in units of the noise, with its
recordings' own unknowns marginalised, the others leave an error of the mean square tr(C S)/N in it untold, to
first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forklift.base.threads import on_one_thread, one_thread
from forklift.diagnosis.criteria import FORETOLD
from forklift.diagnosis.hypothesis import with_hypotheses
from forklift.diagnosis.refit import Refit
from forklift.diagnosis.refitter import FINE, SETTLING, Refitter
from forklift.fitting.interface import Problem
from forklift.fitting.intervals import covariance_at_noise
from forklift.fitting.search import Found, Stage

OWN_NOISE = FINE[:1]
"""From where the selection ended, with the stage that led there: what a model misses clearly, no further step
removes, and a stage without an end for that goes on through all its evaluations."""
WITHOUT = tuple(replace(stage, evaluations=SETTLING[0].evaluations) for stage in OWN_NOISE)
"""Of the machine without any hypothesis, whose misfit is only what the others are compared with."""
FEWEST = 2
"""Groups without which nothing can be left out."""
FAR = 4.0
"""How many times the usual a group leaves over that fits no law."""


@dataclass(frozen=True)
class GroupFold:
    """One group, predicted from the others."""

    group: str
    before: float
    """Mean square of what the model without any hypothesis leaves over of it, in units of the noise."""
    after: float
    """The same with what was found."""
    alone: float
    """The same with what was found fitted to the group itself: what no value of its parameters explains."""
    amplitudes: tuple[tuple[str, float], ...]
    """What was found, as the other groups have it."""
    untold: float = 0.0
    """Mean square that the others leave unknown in it, in units of the noise."""

    @property
    def asked(self) -> bool:
        """Whether the others tell what it depends on; else nothing is known but what it is fitted alone."""
        return self.untold < FORETOLD

    @property
    def holds(self) -> bool:
        """Whether it was asked, and what was found explains more of it than the model without that."""
        return self.asked and self.after < self.before

    @property
    def fails(self) -> bool:
        """Whether it was asked, and that explains nothing of it."""
        return self.asked and not self.holds

    @property
    def gain(self) -> float:
        """Share of what was left over that is gone."""
        return 1.0 - self.after / self.before

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "group": self.group,
            "mean_square_before": self.before,
            "mean_square_after": self.after,
            "gain": self.gain,
            "mean_square_alone": self.alone,
            "amplitudes": dict(self.amplitudes),
            "untold": self.untold,
            "holds": self.holds if self.asked else None,
        }


def group_folds(refitter: Refitter, baseline: Refit, final: Refit) -> tuple[GroupFold, ...]:
    """Every group of the recordings, if there are two at least."""
    groups = list(dict.fromkeys(sample.recording.group for sample in refitter.everyone.samples))
    # A condition that is off in each recording by itself says nothing of another group's.
    laws = [one for one in final.hypotheses if one.amplitude is not None or not one.addition.widened]
    if len(groups) < FEWEST or not laws:
        return ()
    # Of all others something must be left to fit to.
    whole = final.found.problem
    told = [group for group in groups if _over(whole, refitter, final, group, inside=False).samples]
    return tuple(_one(refitter, baseline, final, group) for group in told)


def _one(refitter: Refitter, baseline: Refit, final: Refit, group: str) -> GroupFold:
    untold = _untold(refitter, baseline, group)
    if untold >= FORETOLD:
        nothing = float("nan")
        return GroupFold(group, nothing, nothing, _alone(refitter, final, group), (), untold)
    before, _ = _without(refitter, baseline, group, WITHOUT)
    after, fitted = _without(refitter, final, group, OWN_NOISE)
    named = {hypothesis.amplitude for hypothesis in final.hypotheses}
    amplitudes = tuple(
        (unknown.name, float(unknown.values(float(at))[0]))
        for unknown, at in zip(fitted.problem.unknowns, fitted.x, strict=False)
        if unknown.name in named
    )
    return GroupFold(group, before, after, _alone(refitter, final, group), amplitudes, untold)


@on_one_thread
def _untold(refitter: Refitter, baseline: Refit, group: str) -> float:
    """What the others leave unknown of the group, of the model's own parameters: what was found is to show
    that the others tell it."""
    noise = {name: sensor.noise for name, sensor in refitter.sensors.items()}
    problem = baseline.found.problem
    rest, here = (
        _over(problem, refitter, baseline, group, inside=inside).weighted(noise) for inside in (False, True)
    )
    covariance = covariance_at_noise(rest, rest.at(baseline.found.x), refitter.sensors)
    at, shared = here.at(baseline.found.x), len(problem.unknowns)
    _, jacobian = here.compressed(at)
    told = jacobian[shared:].T @ jacobian[shared:]  # without what is known of the shared beforehand
    own = np.linalg.solve(told[shared:, shared:], told[shared:, :shared])
    left = told[:shared, :shared] - told[:shared, shared:] @ own
    samples = sum(len(seen.values) for sample in here.samples for seen in sample.observed)
    return float(np.sum(covariance * left)) / max(samples, 1)


def _without(refitter: Refitter, refit: Refit, group: str, stages: tuple[Stage, ...]) -> tuple[float, Found]:
    """What is left over of the group with all parameters fitted to the others, and that fit."""
    rest = _over(refit.found.problem, refitter, refit, group, inside=False)
    found = refitter.search(rest, rest.at(refit.found.x), stages)
    here = _over(found.problem, refitter, refit, group, inside=True)
    return _mean_square(here, here.at(found.x), refitter), found


def outlying_groups(groups: Sequence[GroupFold]) -> tuple[str, ...]:
    """Groups that fit no law that fits the others: even alone they leave `FAR` times as much over."""
    usual = float(np.median([one.alone for one in groups])) if groups else 0.0
    return tuple(one.group for one in groups if one.alone > FAR * max(usual, 1.0))


def _alone(refitter: Refitter, final: Refit, group: str) -> float:
    """What is left over of the group's held-out recordings with all parameters fitted to its others."""
    here = _over(final.found.problem, refitter, final, group, inside=True)
    fitted = [one for one in here.samples if one.recording.role == "estimate"] or list(here.samples)
    judged = [one for one in here.samples if one.recording.role == "validate"] or list(here.samples)
    own = here.over(fitted)
    found = refitter.search(own, own.at(final.found.x), OWN_NOISE)
    seen = found.problem.over(judged)
    return _mean_square(seen, seen.at(found.x), refitter)


def _over(problem: Problem, refitter: Refitter, refit: Refit, group: str, *, inside: bool) -> Problem:
    """The problem over the group, or over what may be fitted of all others; with what `refit` doubts of their
    conditions."""
    own = {sample.recording.file: sample for sample in problem.samples}
    samples = [
        own.get(sample.recording.file, sample)
        for sample in with_hypotheses(refitter.everyone, refit.hypotheses).samples
        if (sample.recording.group == group) == inside and (inside or sample.recording.role == "estimate")
    ]
    return problem.over(samples)


def _mean_square(problem: Problem, x: Any, refitter: Refitter) -> float:
    """Of what is left over in units of noise, with nothing of the group adjusted."""
    total, count = 0.0, 0
    with one_thread():
        said = problem.said(x)
    for sample, model in zip(problem.samples, said, strict=True):
        for seen in sample.observed:
            left = seen.left(model[seen.sensor.channel]) / refitter.sensors[seen.sensor.channel].noise
            total += float(left @ left)
            count += len(left)
    return total / max(count, 1)
