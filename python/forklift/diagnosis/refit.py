"""A set of hypotheses tried: what became of the whole problem with them, judged on recordings held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from forklift.diagnosis.criteria import (
    BOUND,
    CLEAR,
    DOUBTFUL,
    LEAST_FAULT,
    SLIGHT,
    STRAIN,
)
from forklift.diagnosis.doubted import Known, what_is_known
from forklift.fitting.intervals import Knowledge
from forklift.fitting.residuals import ChannelResidual
from forklift.fitting.search import Found
from forklift.plant.parameter import Unknown
from forklift.plant.protocol import Hypothesis


@dataclass(frozen=True, eq=False)
class Refit:
    """One set of hypotheses, fitted with everything else and judged."""

    hypotheses: tuple[Hypothesis, ...]
    found: Found
    knowledge: Knowledge
    told: tuple[ChannelResidual, ...]
    """Judged on the recordings held out; where there are none, on all."""
    costs: tuple[float, float]
    """−ln posterior after each of the tempered stages, with their weights."""
    finished: bool
    """Whether the search went on to the sensors' own noise."""
    early: Found
    """Where the tempered stages ended: parameters have not yet gone to extremes to make up for what is
    missing, so that a linear step from there tells who could."""

    left_at_weights: float | None = None
    """Mean square left over in units of the weights that deviations were told with; None: of the noise."""
    foretold: Mapping[str, float] | None = None
    """By recording, how much better all others foretell it than without its hypotheses, in ln probability;
    asked where nothing shows without them."""
    cold: bool = False
    """Whether it was searched for from the start machine too."""
    pooled: bool = False
    """Whether all recordings led it, those held out too."""
    held: tuple[Unknown, ...] = ()
    """Parameters that no recording tells, so that it left them alone."""
    rest: Callable[[], tuple[ChannelResidual, ...]] = tuple
    """Judges it on the recordings that were fitted, which decide nothing."""

    @property
    def loo_log_score(self) -> float | None:
        """The sum of `foretold`."""
        return None if self.foretold is None else sum(self.foretold.values())

    @property
    def rough(self) -> float:
        """−ln posterior after the tempered stages: refits compare by it."""
        return self.costs[-1]

    @cached_property
    def held_out(self) -> tuple[ChannelResidual, ...]:
        held = tuple(found for found in self.told if found.role == "validate")
        return held or self.told

    @cached_property
    def judged(self) -> tuple[ChannelResidual, ...]:
        """On every recording: those held out, then those that were fitted."""
        return (*self.told, *self.rest())

    @cached_property
    def held_out_alone(self) -> bool:
        """Whether what is left over shows on recordings held out and on none that was fitted: those reach
        beyond what was fitted, as the only ones without a load, and a linear step from the fitted ones says
        little of it."""
        rest = self.rest() if self.finished and not self.complete else ()
        return bool(rest) and all(found.explained for found in rest)

    @cached_property
    def shown_in(self) -> tuple[str, ...]:
        """The recordings, or their stretches, in which something is left over clearly."""
        return tuple(dict.fromkeys(found.file for found in self.judged if found.mean_square > DOUBTFUL))

    @property
    def fitted_alone(self) -> bool:
        """Whether what is left over shows in recordings that were fitted, clearly, and in none held out: what
        happened in one of them, or physics that the others do not reach."""
        return self.complete and bool(self.shown_in)

    @property
    def told_from(self) -> Found:
        """From where more is screened: the end, where little or nothing is left over, else where the tempered
        stages ended."""
        return self.found if self.quiet else self.early

    @cached_property
    def reduced_chi2(self) -> float:
        """Mean square over all held-out samples, in units of the sensors' noise."""
        samples = sum(found.samples for found in self.held_out)
        return _told(sum(found.samples * found.mean_square for found in self.held_out)) / samples

    @cached_property
    def worst(self) -> ChannelResidual:
        return max(self.held_out, key=lambda found: _told(found.mean_square))

    @property
    def complete(self) -> bool:
        """Whether nothing is left over in any channel of any recording held out."""
        return all(found.explained for found in self.held_out)

    @property
    def strained(self) -> bool:
        """Whether a recording held out has conditions further from what was entered than chance has them."""
        return any(found.strain > STRAIN for found in self.held_out)

    @property
    def strains_alone(self) -> bool:
        """Whether conditions that far off are all that is left over."""
        return self.strained and self.worst.mean_square <= SLIGHT

    @property
    def slight(self) -> bool:
        """Whether what is left over is so little that no parameter needs to go far to make up for it."""
        return self.finished and self.worst.mean_square <= SLIGHT and not self.strained

    @property
    def quiet(self) -> bool:
        """Whether nothing is left over, or next to nothing: all recordings are asked for more."""
        return self.complete or self.slight

    @cached_property
    def squares(self) -> float:
        """Sum of squares on recordings held out, with what the freedom of their own unknowns costs."""
        return _told(sum(found.cost for found in self.held_out))

    @cached_property
    def excess(self) -> float:
        """Sum of squares left over the noise, channel by channel, on recordings held out."""
        return _told(sum(found.excess for found in self.held_out))

    @cached_property
    def missing(self) -> float:
        """The same of the channels that are not explained."""
        return sum(found.excess for found in self.held_out if not found.explained)

    @property
    def identifiable(self) -> bool:
        """Whether all its amplitudes are told from none."""
        return all(self.clear(hypothesis) for hypothesis in self.hypotheses)

    def clear(self, hypothesis: Hypothesis) -> bool:
        """Whether the hypothesis's amplitude is told from none, its deviation widened by what is left
        over; of a sensor, from what any sensor is off by."""
        if hypothesis.amplitude is None or hypothesis.kind == "unknown":
            return True
        if hypothesis.kind == "sensor" and self.size(hypothesis) < LEAST_FAULT:
            return False
        return self.deviations(hypothesis) >= CLEAR

    def size(self, hypothesis: Hypothesis) -> float:
        """How far its amplitude lies from its null value, in its prior's deviations; 0 without one."""
        return 0.0 if hypothesis.amplitude is None else abs(self._amplitude(hypothesis.amplitude)[0])

    def deviations(self, hypothesis: Hypothesis) -> float:
        """How many of its standard deviations the amplitude lies from its null value, each widened by what is
        left over; none, where there is no one amplitude."""
        if hypothesis.amplitude is None:
            return 0.0
        at, deviation = self._amplitude(hypothesis.amplitude)
        return abs(at) / max(deviation * self.widening, 1e-300)

    def _amplitude(self, name: str) -> tuple[float, float]:
        """Where it lies, and its deviation as the fit has it, both in its prior's."""
        place = [unknown.name for unknown in self.found.problem.unknowns].index(name)
        return float(self.found.x[place]), float(self.knowledge.estimates[place].deviation)

    @property
    def widening(self) -> float:
        """Of every deviation: the root of what is left over, in units of what deviations were told with."""
        left = self.reduced_chi2 if self.left_at_weights is None else self.left_at_weights
        return float(np.sqrt(max(1.0, left)))

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Which unknowns of its hypotheses ended at a bound: the recordings would have them go further."""
        own = {one.name for hypothesis in self.hypotheses for one in hypothesis.addition.free}
        unknowns = self.found.problem.unknowns
        return tuple(
            one.name
            for one, at in zip(unknowns, self.found.x.tolist(), strict=False)
            if one.name in own and min(at - one.lower, one.upper - at) <= BOUND
        )

    @property
    def doubted(self) -> tuple[str, ...]:
        """The conditions that its hypotheses doubt."""
        doubts = [one.addition.widened for one in self.hypotheses if one.amplitude is None]
        return tuple(dict.fromkeys(name for widened in doubts for name, _ in widened))

    @cached_property
    def known(self) -> Known:
        """How well its unknowns are known, the level of what it doubts by the recordings alone."""
        return what_is_known(self.found, self.doubted, self.held)

    @property
    def freedoms(self) -> int:
        """How many numbers its hypotheses bring, in all recordings that it was fitted to."""
        conditions = sum(len(one.addition.widened) for one in self.hypotheses if one.amplitude is None)
        numbers = sum(len(one.addition.free) for one in self.hypotheses)
        return numbers + conditions * len(self.found.problem.samples)

    def by_recording(self) -> dict[str, float]:
        """Sum of squares of each recording held out, or of each of its stretches that err independently, with
        what the freedom of its own unknowns costs, evenly among them: together they are `squares`."""
        sums: dict[str, float] = {}
        for found in self.held_out:
            if found.blocks == 1:
                sums[found.file] = sums.get(found.file, 0.0) + _told(found.cost)
                continue
            own = (found.cost - float(found.left @ found.left)) / found.blocks
            for k, part in enumerate(np.array_split(found.left, found.blocks)):
                name = f"{found.file}, stretch {k + 1}"
                sums[name] = sums.get(name, 0.0) + _told(float(part @ part) + own)
        return sums


def _told(square: float) -> float:
    """A square; without end where a run ended in no number, as of a machine that swings up by itself."""
    return square if np.isfinite(square) else float("inf")
