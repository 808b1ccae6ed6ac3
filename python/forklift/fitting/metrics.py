"""How well a simulated signal fits a measured one: (3.39), (3.40), and the velocities they are taken over.

Source: Fri & Fahlén (2017), section 3.7.1. A fit of 100 % is perfect, one of 0 % no better than the
measured signal's mean; it may be negative.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from forklift.base.errors import ForkliftError

Floats = NDArray[np.float64]

WINDOW = 11
"""Samples of the Savitzky–Golay filter."""
ORDER = 2
"""Its polynomial's order."""


def nmse(measured: Floats, simulated: Floats) -> float:
    """Fit by the normalised mean square error [%], (3.39): 100 (1 − ‖y − ŷ‖² / ‖y − ȳ‖²).

    Parameters
    ----------
    measured, simulated
        (n,) in the same unit. Samples where either is NaN are left out, and so from the mean ȳ too.

    Returns
    -------
    Percent; NaN if fewer than two samples remain or the measured signal is constant: then there is
    nothing to explain, and the fit is not defined.

    Raises
    ------
    ForkliftError
        ``"argument-shape"`` if the shapes differ.
    """
    return 100.0 * (1.0 - _ratio(measured, simulated))


def nrmse(measured: Floats, simulated: Floats) -> float:
    """Fit by the normalised root mean square error [%], (3.40): 100 (1 − ‖y − ŷ‖ / ‖y − ȳ‖).

    Arguments, gaps, constant signals and errors as in `nmse`.
    """
    return 100.0 * float(1.0 - np.sqrt(_ratio(measured, simulated)))


def rmse(measured: Floats, simulated: Floats) -> float:
    """Root mean square of the difference, in the signals' unit; NaN if no sample remains."""
    y, y_hat = _paired(measured, simulated)
    return float(np.sqrt(np.mean((y - y_hat) ** 2))) if len(y) else float("nan")


def derivative(time_s: Floats, signal: Floats) -> Floats:
    """The derivative by a Savitzky–Golay filter of 11 samples and second order.

    At each sample a parabola is fitted to the 11 samples around it (at either end: to the first or last
    11) at their own times, so that time need not be even; the slope there is the derivative.

    Parameters
    ----------
    time_s
        (n,) [s], strictly increasing.
    signal
        (n,). A missing sample (NaN) makes the up to 11 derivatives that need it missing: nothing is
        interpolated across a gap.

    Returns
    -------
    (n,) in the signal's unit per second; all NaN if there are fewer than 11 samples.
    """
    if len(time_s) < WINDOW:
        return np.full(len(time_s), np.nan)
    windows, weights = _derivative_weights(time_s)
    # From the sample served, so that a constant has a derivative of exactly zero: nothing is rounded.
    off = sliding_window_view(signal, WINDOW)[windows] - signal[:, None]
    slopes: Floats = np.einsum("ij,ij->i", weights, off)
    return slopes


def _derivative_weights(time_s: Floats) -> tuple[NDArray[np.intp], Floats]:
    """For each sample the window that serves it, and the (n, 11) weights of the slope there."""
    n = len(time_s)
    windows = np.clip(np.arange(n) - WINDOW // 2, 0, n - WINDOW)
    tau = sliding_window_view(time_s, WINDOW)[windows] - time_s[:, None]
    scale = tau[:, -1:] - tau[:, :1]
    powers = (tau / scale)[:, :, None] ** np.arange(ORDER + 1)
    normal = np.einsum("nij,nik->njk", powers, powers)
    slope = np.linalg.solve(normal, np.broadcast_to(np.eye(ORDER + 1)[:, 1:2], (n, ORDER + 1, 1)))
    return windows, np.einsum("nij,njk->ni", powers, slope) / scale


def _ratio(measured: Floats, simulated: Floats) -> float:
    y, y_hat = _paired(measured, simulated)
    if len(y) < 2 or np.ptp(y) == 0.0:
        return float("nan")
    return float(np.sum((y - y_hat) ** 2) / np.sum((y - y.mean()) ** 2))


def _paired(measured: Floats, simulated: Floats) -> tuple[Floats, Floats]:
    y, y_hat = np.asarray(measured, np.float64), np.asarray(simulated, np.float64)
    if y.shape != y_hat.shape:
        raise ForkliftError(
            "argument-shape",
            f"measured has shape {y.shape} but simulated {y_hat.shape}; give both at the same times",
            name="simulated",
            value=y_hat.shape,
            expected=y.shape,
        )
    both = np.isfinite(y) & np.isfinite(y_hat)
    return y[both], y_hat[both]
