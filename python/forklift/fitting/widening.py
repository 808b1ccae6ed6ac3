"""Intervals of a model that leaves something over: wider by what it leaves, and biased by what is missing.

An interval holds the truth if the model is right. Where it leaves a mean square of χ² times the noise's, the
posterior of its parameters is as if the noise were χ times as large; so each deviation is widened by

    √max(1, χ²),    χ² over the recordings held out of the part that the parameter belongs to

(the dispersion of McCullagh & Nelder 1989, section 4.5). No width makes up for a bias.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forklift.fitting.residuals import ChannelResidual

BIASED = "widened by what is left over, and biased by what is missing"
"""What to know of such an interval."""


def widening(judged: Sequence[ChannelResidual], parameter: str) -> float:
    """By which factor the intervals of a parameter are wider; 1 where its part is explained to the noise.

    Parameters
    ----------
    judged
        Every channel of every recording; those held out count, or all if none was.
    parameter
        Its name; before the first dot the part, where the recordings' groups are named after it.
    """
    held = [one for one in judged if one.role == "validate"] or list(judged)
    part = parameter.partition(".")[0]
    own = [one for one in held if one.group in (part, "both")] or held
    if all(one.explained for one in own):
        return 1.0
    samples = sum(one.samples for one in own)
    left = sum(one.samples * one.mean_square for one in own) / max(samples, 1)
    return float(np.sqrt(max(1.0, left)))
