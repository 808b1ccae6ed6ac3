"""A recording's residuals and their derivatives at one point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from forklift.base.arrays import Floats


@dataclass(frozen=True)
class Linearised:
    """A recording's residuals and their derivatives at one point, channel by channel."""

    residual: Mapping[str, Floats]
    jacobian: Mapping[str, Floats]
    """(samples, θ and φ of this recording)."""
    model: Mapping[str, Floats]
    """What the model says, in the channel's unit."""
    slope: Mapping[str, Floats]
    """Its derivatives along the same; none in what `products` gives."""


@dataclass(frozen=True)
class Products:
    """A recording linearised, all channels in one, and its share of the normal equations."""

    residual: Floats
    """(samples,)."""
    jacobian: Floats
    """(samples, θ and φ of this recording)."""
    normal: Floats
    """JᵀJ over θ and the recording's φ."""
    gradient: Floats
    """Jᵀr."""
    square: float
    """rᵀr."""
