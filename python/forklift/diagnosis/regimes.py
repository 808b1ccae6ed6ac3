"""Whether two regimes agree on a parameter: what holds of a machine holds of it loaded, empty, cold and warm.

The recordings, or the samples of each, are split into two. The parameter becomes two, one for either part,
and everything else stays one: from the joint optimum, a few Gauss–Newton steps over all samples give both,
with the machine's other parameters and the recordings' own unknowns marginalised under the problem's own
priors:

    (p₁, p₂, θ, φ) → (p₁, p₂, θ, φ) − (JᵀJ)⁻¹ Jᵀr,    C = (JᵀJ)⁻¹,
    z = (p₁ − p₂)/√(C₁₁ + C₂₂ − 2 C₁₂)

with the noise widened by what the model leaves over and for residuals that are not white. A term that holds
in its own regime only is no physics (Chow 1960, for regressions).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError
from forklift.base.threads import one_thread
from forklift.diagnosis.refit import Refit
from forklift.fitting import likelihood
from forklift.fitting.interface import Problem
from forklift.fitting.intervals import TOLD, ends
from forklift.fitting.linearised import Linearised
from forklift.plant.parameter import DEGREES, Unknown
from forklift.plant.subject import Split

AGREE = 3.0
"""|z| up to which two regimes agree: chance exceeds it in 0.3 % of cases."""
STEPS = 3
FARTHEST = 2.0
"""No step moves an unknown further than this, in its prior's deviations."""
NEAR = 0.1
"""A step that moves none further than this is the last."""


@dataclass(frozen=True)
class Side:
    """The parameter as one regime has it."""

    regime: str
    value: float
    lower: float
    """95 % interval."""
    upper: float
    deviation: float
    """Posterior standard deviation, in units of the prior's."""


@dataclass(frozen=True)
class Regimes:
    """One parameter from two regimes."""

    parameter: str
    unit: str
    split: str
    first: Side
    second: Side
    z: float
    """Their difference over its standard deviation, on the scale on which the parameter is carried."""

    @property
    def agree(self) -> bool | None:
        """None if one of them does not tell the parameter."""
        if max(self.first.deviation, self.second.deviation) >= TOLD:
            return None
        return abs(self.z) <= AGREE

    @property
    def sentence(self) -> str:
        """What it means."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        told = [
            f"{side.value:.3g} ({side.lower:.3g} to {side.upper:.3g}){unit} from {side.regime}"
            for side in (self.first, self.second)
        ]
        if self.agree is None:
            least = max((self.first, self.second), key=lambda side: side.deviation)
            return f"{self.parameter}: {least.regime} do not tell it, so that the {self.split} tests nothing"
        verb = "agrees" if self.agree else "disagrees"
        return f"{self.parameter} {verb} across the {self.split}: {told[0]}, {told[1]} (z = {self.z:.1f})"

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "parameter": self.parameter,
            "unit": self.unit,
            "split": self.split,
            "sides": [
                {"regime": side.regime, "value": side.value, "lower": side.lower, "upper": side.upper}
                for side in (self.first, self.second)
            ],
            "z": self.z,
            "agree": self.agree,
        }


def regimes(refit: Refit, parameter: str, splits: Sequence[Split]) -> tuple[Regimes, ...]:
    """The parameter (a name among the refit's unknowns) from both sides of every split.

    A split that leaves one side empty is left out.

    Raises
    ------
    ValueError
        If the refit has no such unknown.
    """
    names = [unknown.name for unknown in refit.found.problem.unknowns]
    if parameter not in names:
        raise ValueError(f"the refit has no unknown {parameter}")
    place = names.index(parameter)
    wide = sqrt(max(1.0, refit.reduced_chi2))
    problem = refit.found.problem
    sigma = {
        name: noise * wide * refit.knowledge.widening.get(name, 1.0) for name, noise in problem.sigma.items()
    }
    problem = problem.weighted(sigma)
    with one_thread():
        here = problem.linearise(refit.found.x)
        return tuple(
            _split(problem, refit.found.x, here, place, split)
            for split in splits
            if any(rows.any() for rows in split.rows) and not all(rows.all() for rows in split.rows)
        )


def _split(problem: Problem, x: Floats, here: Sequence[Linearised], place: int, split: Split) -> Regimes:
    """From the optimum x, linearised `here`; the second side's parameter stands behind the unknown vector."""
    at = np.r_[x, x[place]]
    runs: tuple[_Runs, _Runs] = (dict(enumerate(here)), dict(enumerate(here)))
    for _ in range(STEPS):
        normal, gradient = _normal(problem, at, runs, place, split)
        step = -np.linalg.solve(normal, gradient)
        length = float(np.abs(step).max())
        moved = _bounded(problem, at + step * min(1.0, FARTHEST / max(length, FARTHEST)), place)
        try:
            if length > NEAR:
                runs = _runs(problem, moved, place, split, 0), _runs(problem, moved, place, split, 1)
        except ForkliftError:
            break  # there is no such machine: it stays where it was
        at = moved
        if length <= NEAR:
            break
    covariance = np.linalg.inv(normal)
    unknown = problem.unknowns[place]
    one, other = covariance[place, place], covariance[-1, -1]
    apart = sqrt(max(one + other - 2.0 * covariance[place, -1], 1e-300))
    return Regimes(
        unknown.name,
        unknown.unit,
        split.name,
        _side(unknown, split.first, float(at[place]), sqrt(one)),
        _side(unknown, split.second, float(at[-1]), sqrt(other)),
        float(at[place] - at[-1]) / apart,
    )


_Runs = dict[int, Linearised]
"""By recording."""


def _runs(problem: Problem, at: Floats, place: int, split: Split, side: int) -> _Runs:
    """The recordings that one side has samples of, linearised with its parameter."""
    x = at[:-1].copy()
    x[place] = at[-1] if side else at[place]
    seen = [k for k, rows in enumerate(split.rows) if (rows != bool(side)).any()]
    part = problem.over([problem.samples[k] for k in seen])
    own = np.concatenate([x[: len(problem.unknowns)], *(problem.nuisance(x, k) for k in seen)])
    return dict(zip(seen, part.linearise(own), strict=True))


def _normal(
    problem: Problem, at: Floats, runs: tuple[_Runs, _Runs], place: int, split: Split
) -> tuple[Floats, Floats]:
    """JᵀJ and Jᵀr over the unknown vector and the second side's parameter."""
    rho, slope = problem.prior(at[:-1])
    again, its_slope = likelihood.student(at[-1:], DEGREES)
    normal = np.diag(np.r_[slope**2, its_slope**2])
    gradient = np.r_[slope * rho, its_slope * again]
    for side, seen in enumerate(runs):
        column = np.arange(len(at) - 1)
        column[place] = len(at) - 1 if side else place
        for k, run in seen.items():
            here = column[problem.columns(k)]
            wanted = split.rows[k] != bool(side)
            for observed in problem.samples[k].observed:
                rows = wanted[observed.rows]
                jacobian = run.jacobian[observed.sensor.channel][rows]
                normal[np.ix_(here, here)] += jacobian.T @ jacobian
                gradient[here] += jacobian.T @ run.residual[observed.sensor.channel][rows]
    return normal, gradient


def _bounded(problem: Problem, at: Floats, place: int) -> Floats:
    lower, upper = problem.bounds()
    return np.clip(at, np.r_[lower, lower[place]], np.r_[upper, upper[place]])


def _side(unknown: Unknown, regime: str, theta: float, deviation: float) -> Side:
    return Side(regime, float(unknown.values(theta)[0]), *ends(unknown, theta, deviation), deviation)
