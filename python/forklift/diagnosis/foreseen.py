"""What curves at a port promise, worked out from its answers to hats over time, without a simulation of them.

A curve that is zero where it begins acts to first order as the input w(t) = Σ c_k B_k(V(t)), with V(t) the
variable as the model without it has it. With hats at the times t_j, and R the model's exact answers to them,
its columns in the normal equations are R B, B = (B_k(V(t_j))): a few small products per curve, where
`forklift.diagnosis.screening.screen` simulates each of its coefficients. What is off is what an input does
between two hats. So this says which of many curves are worth that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.threads import one_thread
from forklift.diagnosis.dependence import KNOTS, tents
from forklift.diagnosis.locate import known_parts, noise_of, of_port
from forklift.fitting.interface import Problem


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
    with one_thread():
        return _foreseen(problem, x, asked, sizes, width_s)


def _foreseen(
    problem: Problem,
    x: Floats,
    asked: Mapping[str, Sequence[Mapping[str, Floats]]],
    sizes: Mapping[str, float],
    width_s: float,
) -> dict[tuple[str, str], float]:
    noise = {name: noise_of(problem, name) for name in problem.sigma}
    known = known_parts(problem, x, noise, width_s)
    length = problem.starts[-1]
    normal, gradient = np.eye(length), np.zeros(length)
    for one in known:
        normal[np.ix_(one.place, one.place)] += one.normal
        gradient[one.place] += one.gradient
    knots = {
        (port, variable): _knots([one[variable] for one in given])
        for port, given in asked.items()
        for variable in given[0]
        if all(variable in one for one in given)
    }
    matrix = {key: np.eye(KNOTS) for key in knots}
    cross = {key: np.zeros((length, KNOTS)) for key in knots}
    pull = {key: np.zeros(KNOTS) for key in knots}
    for k, (sample, one) in enumerate(zip(problem.samples, known, strict=True)):
        answers = problem.respond(x, k, list(asked), one.centres, width_s)
        for port in asked:
            rows = of_port(sample, answers.at(port), noise) * sizes[port]
            square, with_known, with_rest = rows.T @ rows, one.jacobian.T @ rows, rows.T @ one.residual
            for key, at in knots.items():
                if key[0] == port:
                    basis = tents(asked[port][k][key[1]], at)
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


def _knots(columns: Sequence[Floats]) -> Floats:
    lowest, highest = min(float(one.min()) for one in columns), max(float(one.max()) for one in columns)
    return np.linspace(lowest, highest + (highest <= lowest), KNOTS)
