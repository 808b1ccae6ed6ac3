"""How well a simulated signal fits a measured one: (3.39), (3.40), and the velocities they are taken over.

Source: Fri & Fahlén (2017), section 3.7.1. A fit of 100 % is perfect, one of 0 % no better than the
measured signal's mean; it may be negative.
"""

from __future__ import annotations

import numpy as np

from forklift.base.arrays import Floats
from forklift.base.errors import ForkliftError


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
