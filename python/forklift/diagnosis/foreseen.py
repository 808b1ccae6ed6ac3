"""What curves at a port promise, worked out from its answers to hats over time, without a simulation of them.

A curve that is zero where it begins acts to first order as the input w(t) = Σ c_k B_k(V(t)), with V(t) the
variable as the model without it has it. With hats at the times t_j, and R the model's exact answers to them,
its columns in the normal equations are R B, B = (B_k(V(t_j))): a few small products per curve, where
`forklift.diagnosis.screening.screen` simulates each of its coefficients. What is off is what an input does
between two hats. So this says which of many curves are worth that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from forklift.base.arrays import Floats
from forklift.base.threads import on_one_thread
from forklift.diagnosis.locate import hats
from forklift.diagnosis.rounding import rounded
from forklift.diagnosis.screening import at_noise
from forklift.fitting.interface import Problem, Sample
from forklift.fitting.linearised import Linearised

INTERVALS = 4
COEFFICIENTS = INTERVALS + 3
"""Of a curve: cubic B-splines."""


@on_one_thread
def foreseen(
    problem: Problem,
    x: Floats,
    asked: Mapping[str, Sequence[Mapping[str, Floats]]],
    sizes: Mapping[str, float],
    width_s: float,
) -> dict[tuple[str, str], float]:
    """By port and variable: ln of the evidence of a curve at that port over that variable, less that without.

    Parameters
    ----------
    asked
        By port, of every recording: the variables at its hats, each (hats,).
    sizes
        By port: one standard deviation of a coefficient, in the port's unit.
    width_s
        Distance of the hats [s].
    """
    problem = at_noise(problem)
    runs = problem.linearise(x)
    rho, slope = problem.prior(x)
    normal, gradient = np.diag(slope**2), slope * rho
    known = []
    for k, (sample, run) in enumerate(zip(problem.samples, runs, strict=True)):
        one = _Known.of(sample, run, problem.columns(k), problem.sigma)
        known.append(one)
        normal[np.ix_(one.place, one.place)] += one.jacobian.T @ one.jacobian
        gradient[one.place] += one.jacobian.T @ one.residual
    knots = {
        (port, variable): _knots([one[variable] for one in given])
        for port, given in asked.items()
        for variable in given[0]
        if all(variable in one for one in given)
    }
    bases = {
        (port, variable): _bases([one[variable] for one in asked[port]], at)
        for (port, variable), at in knots.items()
    }
    matrix = {key: np.eye(COEFFICIENTS) for key in knots}
    cross = {key: np.zeros((len(gradient), COEFFICIENTS)) for key in knots}
    pull = {key: np.zeros(COEFFICIENTS) for key in knots}
    for k, (sample, one) in enumerate(zip(problem.samples, known, strict=True)):
        answers = problem.respond(x, k, list(asked), hats(sample, width_s), width_s)
        for port in asked:
            rows = one.rows(sample, answers.at(port) * sizes[port])
            square, with_known, with_rest = rows.T @ rows, one.jacobian.T @ rows, rows.T @ one.residual
            for key, every in bases.items():
                if key[0] == port:
                    basis = every[k]
                    matrix[key] += basis.T @ square @ basis
                    cross[key][one.place] += with_known @ basis
                    pull[key] += basis.T @ with_rest
    if not knots:
        return {}
    factor = np.linalg.inv(normal)
    step = factor @ gradient
    found = {}
    for key in knots:
        left = matrix[key] - cross[key].T @ factor @ cross[key]
        pulled = pull[key] - cross[key].T @ step
        gain = 0.5 * float(pulled @ np.linalg.solve(left, pulled))
        found[key] = gain - 0.5 * float(np.linalg.slogdet(left)[1])
    return found


@dataclass(frozen=True)
class _Known:
    """One recording without a curve, its encoders' rounding averaged out."""

    place: NDArray[np.intp]
    residual: Floats
    jacobian: Floats
    weights: Mapping[str, Floats]
    """By channel: of every sample the derivative of its residual along what the model says."""

    @classmethod
    def of(
        cls, sample: Sample, run: Linearised, place: NDArray[np.intp], sigma: Mapping[str, float]
    ) -> _Known:
        names = [(seen, seen.sensor.channel) for seen in sample.observed]
        return cls(
            place,
            np.concatenate([rounded(seen.sensor, run.residual[name]) for seen, name in names]),
            np.concatenate([rounded(seen.sensor, run.jacobian[name]) for seen, name in names]),
            {name: seen.misfit(run.model[name], sigma[name])[1] for seen, name in names},
        )

    def rows(self, sample: Sample, answers: Floats) -> Floats:
        """(samples of all channels, hats) of the residuals, of the model's answers to hats."""
        return np.concatenate(
            [
                rounded(
                    seen.sensor,
                    seen.of(answers) * self.weights[seen.sensor.channel][:, None],
                )
                for seen in sample.observed
            ]
        )


def _knots(columns: Sequence[Floats]) -> Floats:
    """Of cubic B-splines on `INTERVALS` equal intervals from the least to the greatest value."""
    lowest, highest = min(float(one.min()) for one in columns), max(float(one.max()) for one in columns)
    width = (highest - lowest) / INTERVALS or 1.0
    return lowest + width * np.arange(-3.0, INTERVALS + 4.0)


def _bases(columns: Sequence[Floats], knots: Floats) -> list[Floats]:
    """Of each recording (values, splines)."""
    within = np.clip(np.concatenate(columns), knots[3], knots[-4])
    basis = np.asarray(BSpline.design_matrix(within, knots, 3).toarray())
    return np.split(basis, np.cumsum([len(one) for one in columns])[:-1])
