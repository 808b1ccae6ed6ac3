"""A linearly implicit method that takes all recordings at once, each with its own steps.

Rodas3 (Sandu et al. 1997, Atmospheric Environment 31: Benchmarking stiff ODE solvers II): four stages, order
three, stiffly accurate and L-stable, with an embedded method of order two that tells the error of a step. The
Jacobian is one of difference quotients, all of them and all recordings in one call of the right-hand side.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[Any]

GAMMA = 0.5
DIFFERENCE = 1e-7
ORDER = 3
SHRINK, GROW, SAFETY = 0.2, 4.0, 0.85


def step(
    rates: Callable[[Floats], Floats], y: Floats, h: Floats, scale: Floats, lifts: int = 1
) -> tuple[Floats, Floats]:
    """`y`, (states, 1, recordings), after the steps `h` [s], (recordings,), of dy/dt = rates(y); its error.

    The error is the greatest of all states, in units of their typical sizes `scale`. Where `lifts` do not
    feel each other, their states taking turns in `y`, each has its own matrix.
    """
    count, _, recordings = y.shape
    own = count // lifts
    scale = scale[:, None, None]
    # Kinks of |v| and |di| lie at zero: differences are taken away from it.
    width = np.where(y < 0.0, -DIFFERENCE, DIFFERENCE)
    chosen = np.repeat(np.concatenate([np.zeros((own, 1)), np.eye(own)], axis=1), lifts, axis=0)
    slopes = rates(y + chosen[:, :, None] * (width * scale)) / scale
    f = slopes[:, :1]
    change = (slopes[:, 1:] - f).reshape(own, lifts, own, recordings).transpose(1, 3, 0, 2)
    jacobian = change / width.reshape(own, lifts, recordings).transpose(1, 2, 0)[:, :, None]
    inverse = np.linalg.inv(np.eye(own) / (h[:, None, None] * GAMMA) - jacobian)

    def solve(right: Floats) -> Any:
        columns = right.reshape(own, lifts, recordings).transpose(1, 2, 0)[..., None]
        return (inverse @ columns)[..., 0].transpose(2, 0, 1).reshape(right.shape)

    k1 = solve(f)
    k2 = solve(f + 4.0 / h * k1)
    f = rates(y + 2.0 * k1 * scale) / scale
    k3 = solve(f + (k1 - k2) / h)
    f = rates(y + (2.0 * k1 + k3) * scale) / scale
    k4 = solve(f + (k1 - k2 - 8.0 / 3.0 * k3) / h)
    return y + (2.0 * k1 + k3 + k4) * scale, np.abs(k4[:, 0]).max(axis=0)


def next_step(h: Floats, error: Floats, tolerance: float) -> Floats:
    """The step [s] after one of `h` with this error; an error that is no number counts as large."""
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = SAFETY * (tolerance / error) ** (1.0 / ORDER)
    return h * np.where(np.isfinite(error), np.clip(factor, SHRINK, GROW), SHRINK)
