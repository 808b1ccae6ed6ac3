"""How much has been computed, in simulated recordings: the same on every machine and with any number of
threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

DIRECTION = 0.3
"""What a derivative along one direction counts, as a share of the run without: more than it takes on the
forklift, whose core carries many at once; a machine that is run anew for each direction takes a whole one."""
SUBSTEPS, SAMPLES = 4, 600
"""Substeps of a tick, and samples, with which a recording counts as one."""


@dataclass
class Work:
    """A count of recordings of `SAMPLES` samples, simulated once with `SUBSTEPS` substeps a tick, and what it
    may reach.

    A problem and all that are made of it share one. Whoever would begin something long asks first whether
    anything is left: a clock would let the answer depend on how busy the machine is.
    """

    done: float = 0.0
    limit: float = float("inf")

    def add(self, samples: int, directions: int, substeps: int) -> None:
        """So many samples were simulated, and differentiated along so many directions each."""
        self.done += samples / SAMPLES * (1.0 + DIRECTION * directions) * substeps / SUBSTEPS

    @property
    def spent(self) -> bool:
        """Whether nothing is left."""
        return self.done >= self.limit

    def grant(self, more: float) -> None:
        """From here on as much as `more` may be done."""
        self.limit = self.done + more

    @contextmanager
    def beside(self) -> Iterator[None]:
        """What is done within leaves as much for all else as there was."""
        done, limit = self.done, self.limit
        self.limit = float("inf")
        try:
            yield
        finally:
            self.limit = limit + self.done - done
