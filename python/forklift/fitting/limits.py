"""What a search may not leave: bounds, and what must stay in order.

A step that is cut off at a bound is no step of least squares any more: what was to make up for the part that
is cut off goes on alone, and may lead uphill however short it is made. Where knots of a table meet, a step
that would let them cross cannot be simulated at all. So the step itself is the best within the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import nnls

from forklift.base.arrays import Floats

CLOSE = 1e-9
"""How far a limit may be overstepped by rounding, in prior deviations."""


@dataclass(frozen=True)
class Limits:
    """Linear inequalities: rows @ x ≥ least."""

    rows: Floats
    """(limits, unknowns), each of length 1."""
    least: Floats
    """(limits,)"""

    @classmethod
    def of(cls, lower: Floats, upper: Floats, rows: Floats, least: Floats) -> Limits:
        """Those of the bounds that are finite, and further rows."""
        every = np.eye(len(lower))
        low, high = np.isfinite(lower), np.isfinite(upper)
        further = np.linalg.norm(rows, axis=1)
        return cls(
            np.concatenate([every[low], -every[high], rows / further[:, None]]),
            np.concatenate([lower[low], -upper[high], least / further]),
        )

    def step(self, normal: Floats, gradient: Floats, x: Floats) -> Floats:
        """The step δ from x with the least ½ δᵀNδ + gᵀδ.

        As the least distance from the free step in the norm of N, whose dual is least squares with
        coefficients that are not negative (Lawson & Hanson, *Solving Least Squares Problems*, 1974,
        chapter 23): it says which limits hold the step, and these are then met exactly.
        """
        factor = cho_factor(normal, lower=True)
        free: Floats = -np.asarray(cho_solve(factor, gradient))
        short = self.least - self.rows @ (x + free)
        if not len(short) or short.max() <= CLOSE:
            return free
        rows = solve_triangular(factor[0], self.rows.T, lower=True).T
        unit = (short / np.linalg.norm(rows, axis=1)).max()  # as far at least as the step must be moved
        dual = np.vstack([rows.T, short / unit])
        pressed, _ = nnls(dual, np.eye(len(dual))[-1])
        held = self.rows[pressed > 0.0]
        back = cho_solve(factor, held.T)
        force, *_ = np.linalg.lstsq(held @ back, short[pressed > 0.0], rcond=None)
        step: Floats = free + back @ force
        return step
