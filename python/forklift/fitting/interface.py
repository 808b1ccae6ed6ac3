"""What the engine needs of an estimation problem: the whole of what it may know of a machine.

`forklift.fitting.problem.LeastSquares` is such a problem, of any machine; the search, the judgement and
`forklift.diagnosis` see no more of it than this.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from forklift.base.arrays import Floats

if TYPE_CHECKING:
    from forklift.fitting.limits import Limits
    from forklift.fitting.linearised import Linearised, Products
    from forklift.fitting.observed import Observed
    from forklift.fitting.work import Work
    from forklift.plant.parameter import Unknown
    from forklift.plant.protocol import Addition, Machine, Responses, Run


class Recording(Protocol):
    """One recording, as far as the engine reads it."""

    @property
    def file(self) -> str:
        """Its name, unique among all."""

    @property
    def role(self) -> str:
        """``"estimate"`` or ``"validate"``."""

    @property
    def group(self) -> str:
        """What it belongs together with."""

    @property
    def blocks(self) -> int:
        """How many stretches of it err independently: credibility resamples these."""

    @property
    def time_s(self) -> Floats:
        """(samples,) [s]."""

    def __len__(self) -> int: ...


class Sample(Protocol):
    """One recording as a problem sees it: what it read, and what is its own."""

    @property
    def recording(self) -> Any:
        """A `Recording`."""

    @property
    def observed(self) -> tuple[Observed, ...]:
        """By channel, what was read."""

    @property
    def names(self) -> tuple[str, ...]:
        """(own,) what the recording has of its own."""

    @property
    def centre(self) -> Floats:
        """(own,) its most likely values."""

    @property
    def width(self) -> Floats:
        """(own,) prior standard deviations; 0: known."""

    @property
    def least(self) -> Floats:
        """(own,) lower bounds."""

    @property
    def most(self) -> Floats:
        """(own,) upper bounds."""

    @property
    def free(self) -> NDArray[np.intp]:
        """Which of its own are unknown."""


class Problem(Protocol):
    """Recordings, unknowns, and how what was read answers them.

    The unknown vector x is (θ, φ₁, …, φ_K): the shared unknowns and each recording's own, all in standard
    deviations of their priors.
    """

    @property
    def machine(self) -> Machine:
        """What is fitted."""

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """Shared by all recordings."""

    @property
    def samples(self) -> Sequence[Any]:
        """The recordings, each a `Sample`."""

    @property
    def sigma(self) -> Mapping[str, float]:
        """What each channel is weighted by, in its unit."""

    @property
    def substeps(self) -> int:
        """How finely it is simulated."""

    @property
    def lags(self) -> int:
        """Over how many samples residuals may be correlated."""

    @property
    def work(self) -> Work:
        """What this problem and those made of it have computed."""

    @property
    def starts(self) -> list[int]:
        """Where each φ begins in x; last, its length."""

    def weighted(self, sigma: Mapping[str, float], substeps: int | None = None) -> Self: ...

    def over(self, samples: Sequence[Any]) -> Self: ...

    def with_fixed(self, x: Floats, amplitudes: Collection[str], *, conditions: bool) -> tuple[Self, Floats]:
        """All held at x but these unknowns, and unless `conditions` what recordings have of their own; and
        the same place in that problem.
        """

    def bounds(self) -> tuple[Floats, Floats]: ...

    def limits(self) -> Limits: ...

    def at(self, theta: Floats) -> Floats:
        """The vector that begins like `theta`, every recording's own at its most likely."""

    def nuisance(self, x: Floats, k: int) -> Floats: ...

    def columns(self, k: int) -> NDArray[np.intp]: ...

    def linearise(self, x: Floats) -> list[Linearised]: ...

    def products(self, x: Floats) -> list[Products]: ...

    def residuals(self, x: Floats) -> list[Floats]: ...

    def said(self, x: Floats) -> list[dict[str, Floats]]: ...

    def run(self, x: Floats) -> list[Run]: ...

    def values(self, x: Floats) -> dict[str, float]: ...

    def conditions(self, x: Floats, k: int) -> Floats: ...

    def respond(
        self, x: Floats, k: int, ports: Sequence[str], centres: Floats, width_s: float
    ) -> Responses: ...

    def moments(self, x: Floats, part: str) -> list[dict[str, Floats]]: ...

    def with_addition(self, addition: Addition) -> Self: ...

    def prior(self, x: Floats) -> tuple[Floats, Floats]: ...

    def compressed(self, x: Floats) -> tuple[Floats, Floats]: ...
