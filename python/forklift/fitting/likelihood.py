"""How unlikely a sample is, given what the model says: as residuals whose square is −2 ln of it.

Each function gives, elementwise, a residual ρ and its derivative along the model's value, so that the sum of
ρ² is −2 ln L up to a constant and a least-squares search follows the likelihood itself. Of a sample's kinds
those with names ending in `_residual` give ρ alone, to the bit the same: a search asks for it more often.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr

from forklift.base.arrays import Floats

HUBER = 4.0
"""Residuals, in standard deviations, beyond which a sample counts by its distance and not by its square."""


def gaussian(measured: Floats, model: Floats, sigma: float) -> tuple[Floats, Floats]:
    """Noise of standard deviation `sigma` with the odd bad sample (Huber 1964).

    With r = (model − measured)/σ: ρ = r up to `HUBER`, beyond it ρ² = 2k|r| − k².
    """
    rho = gaussian_residual(measured, model, sigma)
    size = np.abs(rho)
    return rho, np.where(size > HUBER, HUBER / np.maximum(size, HUBER), 1.0) / sigma


def gaussian_residual(measured: Floats, model: Floats, sigma: float) -> Floats:
    """ρ of `gaussian`."""
    r: Floats = (model - measured) / sigma
    size = np.abs(r)
    far = size > HUBER
    if far.any():
        r[far] = np.sign(r[far]) * np.sqrt(2.0 * HUBER * size[far] - HUBER**2)
    return r


def interval(read: Floats, model: Floats, count: float, softness: float) -> tuple[Floats, Floats]:
    """An encoder that rounds down: the truth lies in [read, read + count), up to an error of `softness`.

    P = Φ((read + count − model)/s) − Φ((read − model)/s), and ρ² = −2 ln(P/P₀) with P₀ the largest P there
    is, in the middle: nothing is told inside the interval, and beyond it the distance counts as with
    Gaussian noise of s. For s ≫ count this is Gaussian noise of s around the middle.
    """
    half = 0.5 * count / softness
    u, a, log_p, rho = _of_interval(read, model, half, softness)
    # d ln P/da = (φ(half + a) − φ(half − a)) / P, ratios in logarithms
    constant = -0.5 * np.log(2.0 * np.pi)
    slope = np.exp(constant - 0.5 * (half + a) ** 2 - log_p) - np.exp(
        constant - 0.5 * (half - a) ** 2 - log_p
    )
    curvature = _central_curvature(half)
    inner = rho < 1e-4
    derivative = np.where(inner, np.sqrt(curvature), -slope / np.where(inner, 1.0, rho))
    return np.sign(u) * rho, derivative / softness


def interval_residual(read: Floats, model: Floats, count: float, softness: float) -> Floats:
    """ρ of `interval`."""
    u, _, _, rho = _of_interval(read, model, 0.5 * count / softness, softness)
    return np.asarray(np.sign(u) * rho)


def _of_interval(
    read: Floats, model: Floats, half: float, softness: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Distance from the middle in s, its size, ln P, and the size of ρ."""
    u: Floats = (model - read) / softness - half
    a = np.abs(u)
    # Φ(half − a) − Φ(−half − a), without cancellation far out: by the larger of the two logarithms.
    near, far = log_ndtr(half - a), log_ndtr(-half - a)
    log_p = near + np.log(-np.expm1(far - near))
    return u, a, log_p, np.sqrt(np.maximum(-2.0 * (log_p - _log_central(half)), 0.0))


def censored(end: float, model: Floats, sigma: float, sign: float) -> tuple[Floats, Floats]:
    """A sample at the end of what a sensor reads: the truth lies there or beyond (Tobin 1958).

    ρ² = −2 ln Φ(u), u = ±(model − end)/σ: `sign` 1 for a ceiling, −1 for a floor. Far short of the end this
    is the distance; like `gaussian`, it grows with the root of it beyond `HUBER`.
    """
    u = sign * (model - end) / sigma
    log_p = log_ndtr(u)
    rho = np.sqrt(-2.0 * log_p)
    slope = -np.exp(-0.5 * u**2 - 0.5 * np.log(2.0 * np.pi) - log_p) / np.maximum(rho, 1e-150)
    slope = np.where(rho > 1e-150, slope, 0.0)
    far = rho > HUBER
    damped = np.sqrt(2.0 * HUBER * np.where(far, rho, HUBER) - HUBER**2)
    slope = np.where(far, slope * HUBER / damped, slope)
    return -sign * np.where(far, damped, rho), -slope / sigma


def interval_cost(read: Floats, model: Floats, count: float, softness: float) -> float:
    """Sum of −2 ln P of `interval`, P₀ not taken off: what tells which softness the samples have."""
    rho = interval_residual(read, model, count, softness)
    return float(np.sum(rho**2) - 2.0 * len(read) * _log_central(0.5 * count / softness))


def student(theta: Floats, degrees: float) -> tuple[Floats, Floats]:
    """Student's t of unit scale: ρ² = (ν + 1) ln(1 + θ²/ν)."""
    square = theta**2
    rho = np.sqrt((degrees + 1.0) * np.log1p(square / degrees))
    inner = np.abs(theta) < 1e-6
    slope = (degrees + 1.0) * theta / (degrees + square) / np.where(inner, 1.0, np.sign(theta) * rho)
    return np.sign(theta) * rho, np.where(inner, np.sqrt((degrees + 1.0) / degrees), slope)


def _log_central(half: float) -> float:
    """ln(Φ(h) − Φ(−h))."""
    upper, lower = float(log_ndtr(half)), float(log_ndtr(-half))
    return upper + float(np.log(-np.expm1(lower - upper)))


def _central_curvature(half: float) -> float:
    """−d² ln P/du² in the middle: 2h φ(h)/P₀."""
    return float(2.0 * half * np.exp(-0.5 * half**2 - 0.5 * np.log(2.0 * np.pi) - _log_central(half)))
