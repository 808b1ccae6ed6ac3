"""Something that may be amiss: missing physics, a sensor that reads wrongly, a condition entered wrongly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from forklift.base.arrays import Floats
from forklift.fitting.interface import Problem

Kind = Literal["physics", "parameter", "sensor", "unknown"]


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation, ready to be tried.

    Attributes
    ----------
    id
        One word, the same wherever the explanation acts.
    name
        In words.
    where
        The part of the machine or the channel it acts on; empty if on all.
    equation
        The equation of the model that it changes.
    amplitude
        The unknown that is zero where the hypothesis is absent; None for conditions.
    add
        A problem of the same kind with the hypothesis's unknowns at their quiet values: it leaves the model
        as it is.
    """

    id: str
    kind: Kind
    name: str
    where: str
    equation: str
    amplitude: str | None
    add: Callable[[Any], Any]
    confused_with: tuple[str, ...] = ()
    needs_two_of: tuple[str, ...] = ()
    """Conditions of which there must be two values at least."""
    unlikely: bool = False
    """Whether it yields to what explains the same as well."""
    further: tuple[str, ...] = ()
    """More unknowns that are zero where it is absent, and act from there on like the amplitude: a curve's."""
    over: str = ""
    """Of a curve: its variable, in words."""

    @property
    def amplitudes(self) -> tuple[str, ...]:
        """All unknowns that are zero where it is absent."""
        return () if self.amplitude is None else (self.amplitude, *self.further)

    @property
    def label(self) -> str:
        """What tells it from all others."""
        return f"{self.where}.{self.id}" if self.where else self.id

    def __repr__(self) -> str:
        return f"Hypothesis({self.label!r})"


def carry(x: Floats, before: Problem, after: Problem) -> Floats:
    """The same place in another problem: what is new is quiet."""
    known = {unknown.name: float(at) for unknown, at in zip(before.unknowns, x, strict=False)}
    shared = [known.get(unknown.name, 0.0) for unknown in after.unknowns]
    own = []
    for k, (was, now) in enumerate(zip(before.samples, after.samples, strict=True)):
        offsets = np.zeros(len(was.width))
        offsets[was.free] = was.width[was.free] * before.nuisance(x, k)
        own.append(offsets[now.free] / now.width[now.free])
    return np.concatenate([shared, *own])
