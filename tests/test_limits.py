"""A step within limits is the best one there is, and a search goes on where a limit is met."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

import analytic
from forklift import ForkliftError, Truck
from forklift.fitting import levenberg_marquardt as geodesic
from forklift.fitting.limits import CLOSE, Limits
from forklift.plant.forklift.unknowns import LEAST_GAP, rising, unknowns


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, Limits]:
    """A quadratic over four unknowns, a place inside the limits, bounds and an order."""
    random = np.random.default_rng(seed)
    root = random.standard_normal((6, 4))
    normal, gradient = root.T @ root + 0.1 * np.eye(4), 5.0 * random.standard_normal(4)
    x = random.uniform(-0.5, 0.5, 4)
    row = np.array([[-1.0, 1.0, 0.0, 0.0]])
    limits = Limits.of(np.full(4, -1.0), np.array([1.0, 1.0, np.inf, 1.0]), row, row @ x - 0.1)
    return normal, gradient, x, limits


@given(seed=st.integers(0, 10_000))
@settings(deadline=None)
def test_a_step_stays_within_its_limits_and_leads_down(seed: int) -> None:
    normal, gradient, x, limits = drawn(seed)
    step = limits.step(normal, gradient, x)
    assert (limits.rows @ (x + step) >= limits.least - 10 * CLOSE).all()
    assert gradient @ step + 0.5 * step @ normal @ step <= 0.0


def test_a_step_is_that_of_a_general_solver() -> None:
    for seed in range(60):
        normal, gradient, x, limits = drawn(seed)

        def value(step: np.ndarray, normal=normal, gradient=gradient) -> float:
            return float(gradient @ step + 0.5 * step @ normal @ step)

        best = minimize(
            value,
            np.zeros(4),
            jac=lambda step, normal=normal, gradient=gradient: gradient + normal @ step,
            method="SLSQP",
            constraints={
                "type": "ineq",
                "fun": lambda step, x=x, limits=limits: limits.rows @ (x + step) - limits.least,
                "jac": lambda _, limits=limits: limits.rows,
            },
            options={"ftol": 1e-12},
        )
        assert value(limits.step(normal, gradient, x)) == pytest.approx(best.fun, rel=1e-6)


def test_knots_that_would_cross_stay_in_order_and_groups_move_together() -> None:
    truck = Truck.read("thesis")
    free = unknowns(truck, ["free"], together=[[f"free.valve.table_area.{k}" for k in (4, 5)]])
    rows, least = rising(truck, free)
    assert (rows @ np.zeros(len(free)) > least).all()
    assert len(rows) == 5 + 7  # openings 1 to 7 without the gap that moves as a whole, currents 0 to 7
    names = [one.name for one in free]
    knots = np.array(truck.values["free.valve.table_area"])
    k = names.index("free.valve.table_area.6")
    at = np.zeros(len(free))
    at[k] = (knots[7] - knots[6]) * (1.0 - LEAST_GAP) / free[k].width  # as near to the next as may be
    assert (rows @ at - least).min() == pytest.approx(0.0, abs=1e-9)


class Ordered(analytic.Formula):
    """Its first value may not pass its second, and where it would, nothing can be simulated."""

    def ordered(self, values, unknowns):
        return np.array([[-1.0, 1.0, 0.0]]), np.array([0.0])

    def run(self, values, *given, **settings):
        if values["p1"] < values["p0"] - CLOSE:
            raise ForkliftError("table-order", "the knots cross; sort them")
        return super().run(values, *given, **settings)


def test_a_search_goes_on_where_two_knots_meet() -> None:
    """Drawn together, they stop at each other, and the third goes on to where it belongs."""
    wanted, names = np.array([0.32, 0.28, 0.9]), ["p0", "p1", "p2"]
    made = analytic.problem(
        wanted, [analytic.unknown(name) for name in names], lambda p: p, lambda _: np.eye(3), 0.02
    )
    problem = replace(made, machine=Ordered(names, lambda p: p, lambda _: np.eye(3)))
    end = geodesic.descend(problem, np.array([0.0, 0.02, 0.0]), 50, 1e-9, lambda *_: None)
    assert end == pytest.approx([0.3, 0.3, 0.9], abs=2e-3)
