"""The descent along canyons: hard problems everyone knows, with its work counted."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

import analytic
from forklift import ForkliftError
from forklift.fitting.intervals import knowledge
from forklift.fitting.levenberg_marquardt import cost, descend
from forklift.fitting.likelihood import HUBER


def rosenbrock(p: np.ndarray) -> np.ndarray:
    return np.array([10.0 * (p[1] - p[0] ** 2), 1.0 - p[0]])


def rosenbrock_slopes(p: np.ndarray) -> np.ndarray:
    return np.array([[-20.0 * p[0], 10.0], [-1.0, 0.0]])


def helix(p: np.ndarray) -> np.ndarray:
    """Only the sum of squares and the differences of neighbours are told: a canyon along a sphere."""
    return np.array([30.0 * (p @ p - 3.0), p[0] - p[1], 0.3 * (p[1] - p[2])])


def helix_slopes(p: np.ndarray) -> np.ndarray:
    return np.array([60.0 * p, [1.0, -1.0, 0.0], [0.0, 0.3, -0.3]])


def exponentials(p: np.ndarray) -> np.ndarray:
    """Two decays that nearly make up for one another, rates on a log scale; the first is twice as high."""
    time = np.linspace(0.0, 4.0, 40)
    return 2.0 * np.exp(-np.exp(p[0]) * time) + np.exp(-np.exp(p[1]) * time)


def exponentials_slopes(p: np.ndarray) -> np.ndarray:
    time = np.linspace(0.0, 4.0, 40)
    return np.column_stack(
        [
            -size * time * np.exp(at) * np.exp(-np.exp(at) * time)
            for size, at in zip((2.0, 1.0), p, strict=True)
        ]
    )


CASES = {
    # formula, its slopes, what is measured, noise, start, most linearisations and simulations
    "Rosenbrock's canyon": (rosenbrock, rosenbrock_slopes, np.zeros(2), 0.02, [-1.2, 1.0], 15, 65),
    "a canyon along a sphere": (helix, helix_slopes, np.zeros(3), 0.1, [1.7, 0.0, 0.1], 13, 55),
    "two decays": (
        exponentials,
        exponentials_slopes,
        exponentials(np.array([0.7, -1.0])),
        1e-3,
        [1.5, -1.0],
        18,
        70,
    ),
}


def made(case: str) -> tuple[analytic.Analytic, np.ndarray]:
    formula, slopes, measured, sigma, start, _, _ = CASES[case]
    names = [f"p{k}" for k in range(len(start))]
    unknowns = [analytic.unknown(name, width=2.0) for name in names]
    return analytic.problem(measured, unknowns, formula, slopes, sigma), np.array(start) / 2.0


def scipys(problem: analytic.Analytic, x: np.ndarray) -> np.ndarray:
    """Where SciPy's search ends with the same residuals, bent by nothing and differentiated by quotients."""

    def residual(x: np.ndarray) -> np.ndarray:
        rho, _ = problem.prior(x)
        return np.concatenate([rho, *problem.residuals(x)])

    return least_squares(residual, x, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=10_000).x


@pytest.mark.parametrize("case", CASES)
def test_a_descent_ends_where_scipys_does_with_no_more_work_than_pinned(case):
    problem, start = made(case)
    end = descend(problem, start, 200, 1e-10, lambda *_: None)
    linearised, simulated = (
        sum(run > 0 for run in problem.machine.runs),
        sum(run == 0 for run in problem.machine.runs),
    )
    *_, most_linearised, most_simulated = CASES[case]
    assert linearised <= most_linearised
    assert simulated <= most_simulated
    assert end == pytest.approx(scipys(problem, start), abs=1e-4)


@pytest.mark.parametrize("case", CASES)
def test_the_cost_falls_with_every_step(case):
    problem, start = made(case)
    told = []
    end = descend(problem, start, 200, 1e-10, lambda cost, x: told.append((cost, x.copy())))
    costs = [cost for cost, _ in told]
    assert (np.diff(costs) < 0.0).all()
    assert told[-1][1] == pytest.approx(end, abs=0.0)
    assert costs == pytest.approx([cost(problem, x) for _, x in told], rel=1e-12)


def test_the_number_of_evaluations_is_kept():
    problem, start = made("Rosenbrock's canyon")
    told = []
    descend(problem, start, 5, 1e-10, lambda cost, x: told.append(cost))
    assert len(told) == 5


def test_a_descent_that_begins_at_the_end_stays_there():
    problem, start = made("two decays")
    end = descend(problem, start, 200, 1e-10, lambda *_: None)
    problem.machine.runs.clear()
    assert descend(problem, end, 200, 1e-6, lambda *_: None) is end
    assert not problem.machine.runs  # what is known there is not run again


def test_bounds_hold_a_descent():
    formula, slopes, measured, sigma, _, _, _ = CASES["Rosenbrock's canyon"]
    unknowns = [analytic.unknown("p0", bound=0.5), analytic.unknown("p1")]
    problem = analytic.problem(measured, unknowns, formula, slopes, sigma)
    seen = []
    end = descend(problem, np.array([-0.4, 0.2]), 200, 1e-10, lambda _, x: seen.append(x.copy()))
    assert end[0] == 0.5
    assert end[1] == pytest.approx(0.25, abs=1e-3)
    assert max(abs(x[0]) for x in seen) <= 0.5


def test_a_descent_does_not_end_before_there_is_nothing_to_gain():
    """Here more than a dozen steps in a row must be refused before one is short enough."""
    formula, slopes, *_ = CASES["two decays"]
    measured = exponentials(np.array([0.3, -0.4]))
    unknowns = [analytic.unknown(name, width=2.0) for name in ("p0", "p1")]
    problem = analytic.problem(measured, unknowns, formula, slopes, 1e-3)
    end = descend(problem, np.array([0.25, -0.75]), 200, 1e-8, lambda *_: None)
    residual, jacobian = problem.compressed(end)
    gradient = jacobian.T @ residual
    assert 0.5 * gradient @ np.linalg.solve(jacobian.T @ jacobian, gradient) < 1e-5


def test_where_the_model_fails_a_descent_steps_back():
    formula, slopes, measured, sigma, start, _, _ = CASES["two decays"]
    failed = []

    def fails_far_off(p: np.ndarray) -> np.ndarray:
        if p[0] < 0.69:
            failed.append(p)
            raise ForkliftError("not-finite", "the run left what the model can say")
        return formula(p)

    unknowns = [analytic.unknown(name, width=2.0) for name in ("p0", "p1")]
    problem = analytic.problem(measured, unknowns, fails_far_off, slopes, sigma)
    end = descend(problem, np.array(start) / 2.0, 200, 1e-10, lambda *_: None)
    assert failed
    assert 2.0 * end == pytest.approx([0.7, -1.0], abs=1e-2)


def test_an_interruption_is_no_failure_to_step_back_from():
    formula, slopes, measured, sigma, start, _, _ = CASES["two decays"]
    runs = iter(range(100))

    def interrupted(p: np.ndarray) -> np.ndarray:
        if next(runs) == 3:
            raise KeyboardInterrupt
        return formula(p)

    problem = analytic.problem(
        measured, [analytic.unknown("p0"), analytic.unknown("p1")], interrupted, slopes, sigma
    )
    with pytest.raises(KeyboardInterrupt):
        descend(problem, np.array(start), 200, 1e-10, lambda *_: None)


def test_an_outlier_moves_the_end_by_no_more_than_its_bounded_pull():
    random = np.random.default_rng(4)
    matrix = np.column_stack([np.ones(100), np.linspace(-1.0, 1.0, 100)])
    measured = matrix @ [0.3, -0.2] + 0.1 * random.standard_normal(100)
    spoilt = measured.copy()
    spoilt[7] += 1e6
    ends = [
        descend(analytic.linear(y, matrix, "ab", 0.1), np.zeros(2), 100, 1e-12, lambda *_: None)
        for y in (measured, spoilt)
    ]
    most = (HUBER + 5.0) * 0.1 * np.linalg.norm(np.linalg.solve(matrix.T @ matrix, matrix[7]))
    assert np.linalg.norm(ends[1] - ends[0]) < 1.2 * most


def exploding(p: np.ndarray) -> np.ndarray:
    """Lowest at 3, but from 1 on the model swings up by itself: its slopes say nothing any more."""
    return np.array([p[0] - 3.0, 0.1 * p[1]])


def exploding_slopes(p: np.ndarray) -> np.ndarray:
    return np.diag([1.0, 0.1]) if p[0] < 1.0 else 1e30 * np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]])


def test_a_descent_does_not_go_where_slopes_lose_the_prior_and_one_that_begins_there_stays():
    unknowns = [analytic.unknown(name, width=2.0) for name in ("p0", "p1")]
    problem = analytic.problem(np.zeros(2), unknowns, exploding, exploding_slopes, 0.01)
    end = descend(problem, np.array([-1.0, 0.5]), 200, 1e-8, lambda *_: None)
    assert 0.9 < 2.0 * end[0] < 1.0
    there = np.array([0.6, 0.5])
    assert descend(problem, there, 200, 1e-8, lambda *_: None) is there
    # What is judged there all the same knows nothing but the prior of what rounding has lost.
    known = knowledge(problem, there)
    assert np.isfinite(known.covariance).all()
    assert max(one.deviation for one in known.estimates) < 1.1
