"""How unlikely a sample is, given what the model says: as residuals whose square is −2 ln of it.

Each function gives, elementwise, a residual ρ and its derivative along the model's value, so that the sum of
ρ² is −2 ln L up to a constant and a least-squares search follows the likelihood itself. Those of samples are
computed in the core, which a search asks for all recordings at once (`forklift.fitting.problem`).
"""

from __future__ import annotations

import numpy as np

from forklift import _core
from forklift.base.arrays import Floats

HUBER = _core.HUBER
"""Residuals, in standard deviations, beyond which a sample counts by its distance and not by its square."""


def gaussian(measured: Floats, model: Floats, sigma: float) -> tuple[Floats, Floats]:
    """Noise of standard deviation `sigma` with the odd bad sample (Huber 1964).

    With r = (model − measured)/σ: ρ = r up to `HUBER`, beyond it ρ² = 2k|r| − k².
    """
    return _core.misfit(measured, model, sigma)


def interval(read: Floats, model: Floats, count: float, softness: float) -> tuple[Floats, Floats]:
    """An encoder that rounds down: the truth lies in [read, read + count), up to an error of `softness`.

    P = Φ((read + count − model)/s) − Φ((read − model)/s), and ρ² = −2 ln(P/P₀) with P₀ the largest P there
    is, in the middle: nothing is told inside the interval, and beyond it the distance counts as with
    Gaussian noise of s. For s ≫ count this is Gaussian noise of s around the middle.
    """
    return _core.misfit(read, model, softness, count=count)


def censored(end: float, model: Floats, sigma: float, sign: float) -> tuple[Floats, Floats]:
    """A sample at the end of what a sensor reads: the truth lies there or beyond (Tobin 1958).

    ρ² = −2 ln Φ(u), u = ±(model − end)/σ: `sign` 1 for a ceiling, −1 for a floor. Far short of the end this
    is the distance; like `gaussian`, it grows with the root of it beyond `HUBER`.
    """
    ends = (-np.inf, end) if sign > 0.0 else (end, np.inf)
    return _core.misfit(np.full_like(model, end), model, sigma, ends=ends)


def interval_cost(read: Floats, model: Floats, count: float, softness: float) -> float:
    """Sum of −2 ln P of `interval`, P₀ not taken off: what tells which softness the samples have."""
    return _core.interval_cost(read, model, count, softness)


def student(theta: Floats, degrees: float) -> tuple[Floats, Floats]:
    """Student's t of unit scale: ρ² = (ν + 1) ln(1 + θ²/ν)."""
    square = theta**2
    rho = np.sqrt((degrees + 1.0) * np.log1p(square / degrees))
    inner = np.abs(theta) < 1e-6
    slope = (degrees + 1.0) * theta / (degrees + square) / np.where(inner, 1.0, np.sign(theta) * rho)
    return np.sign(theta) * rho, np.where(inner, np.sqrt((degrees + 1.0) / degrees), slope)
