"""How far a diagnosis is: what is being done, which trial of how many, and how long it may still take."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

FITTING, TRYING = "fitting the model", "trying the hypotheses"
"""Stages: what tells how long others take, and the one with the trials."""
OTHERS = 2.0
"""All other stages together take about this many times as long as the fit."""


@dataclass(frozen=True)
class Progress:
    """Where a diagnosis stands.

    Attributes
    ----------
    stage
        What is done for several seconds, e.g. ``"trying the hypotheses"``.
    what
        What is done just now, within the stage.
    trial, trials
        Which trial this is, and how many there may be as far as is known now; 0 before the first.
    left_s
        Seconds that are left, as an estimate from those of the trials so far; None before the first. Trials
        that turn out not to be needed make it shorter.
    """

    stage: str
    what: str
    trial: int = 0
    trials: int = 0
    left_s: float | None = None

    def __str__(self) -> str:
        what = self.what[:1].upper() + self.what[1:]
        count = f"trial {self.trial} of {self.trials}" if self.trial else ""
        told = ", ".join(one for one in (count, remaining(self.left_s)) if one)
        return f"{what} ({told})" if told else what


def remaining(seconds: float | None) -> str:
    """The time that is left, as coarsely as it is known; nothing if it is not."""
    if seconds is None:
        return ""
    if seconds < 10.0:
        return "some seconds left"
    if seconds < 100.0:
        return f"about {10 * round(seconds / 10):d} s left"
    return f"about {round(seconds / 60):d} min left"


@dataclass
class Clock:
    """Tells how far it is, and keeps how long each stage took."""

    tell: Callable[[Progress], None] | None = None
    seconds: dict[str, float] = field(default_factory=dict)
    spared: Callable[[], float] = float
    """Seconds that earlier work has spared so far."""
    stages: list[str] = field(default_factory=list)
    begun: int = 0
    """Trials that have begun."""
    planned: int = 0
    """Trials that may come in addition."""
    since: float = 0.0
    """When the first trial began."""

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """What is being done, for as long as the context lasts."""
        self.stages.append(name)
        self.say(name)
        began = self._now()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + self._now() - began

    def plan(self, trials: int) -> None:
        """So many trials may come from here on."""
        self.planned = trials

    def trial(self, what: str) -> None:
        """The next trial begins."""
        if not self.begun:
            self.since = self._now()
        self.begun += 1
        self.planned = max(self.planned - 1, 0)
        self.say(what)

    def say(self, what: str) -> None:
        """Something else is being done."""
        if not self.tell:
            return
        trial, trials = (self.begun, self.begun + self.planned) if self._trying else (0, 0)
        self.tell(Progress(self.stages[-1] if self.stages else what, what, trial, trials, self._left()))

    @property
    def _trying(self) -> bool:
        return bool(self.begun and TRYING not in self.seconds)

    def _left(self) -> float | None:
        if not self.begun:
            return None
        fitted = self.seconds.get(FITTING, 0.0)
        gone = sum(spent for name, spent in self.seconds.items() if name not in (FITTING, TRYING))
        others = max(OTHERS * fitted - gone, 0.0)
        if not self._trying:
            return others
        ended = self.begun - 1
        each = (self._now() - self.since) / ended if ended else 0.5 * fitted
        return (self.planned + 1) * each + others

    def _now(self) -> float:
        return time.monotonic() + self.spared()
