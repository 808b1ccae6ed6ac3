"""The derivative of a sampled signal, by a Savitzky–Golay filter (Savitzky & Golay 1964)."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from forklift.base.arrays import Floats

WINDOW = 11
"""Samples of the Savitzky–Golay filter."""


ORDER = 2
"""Its polynomial's order."""


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
