"""Which suspects, and how many: forward, looking ahead by pairs, with a race at each step and a check back.

A suspect is accepted by what recordings held out say, never by those it was fitted on; and it is called
complete only if nothing above the sensors' noise is left in any channel of any of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from forklift.diagnosis.screening import Screened, Screening, screen
from forklift.diagnosis.suspect import Suspect
from forklift.diagnosis.trial import Bench, Trial

MOST_IN_RACE = 4
WORTH = 0.1
"""A suspect enters the race if it promises this share of the best one's gain."""
BEHIND = 1.3
"""A suspect leaves the race if its misfit after the tempered stages is this many times the best one's."""
LEAST_GAIN = 0.1
"""Share of the misfit above the noise, on recordings held out, that an accepted suspect must remove."""
MOST_ACCEPTED = 3

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Step:
    """One round: what was screened, who was tried, who was accepted."""

    screening: Screening
    trials: tuple[Trial, ...]
    """The best on recordings held out first."""
    accepted: Trial | None


@dataclass(frozen=True, eq=False)
class Selection:
    """All rounds."""

    baseline: Trial
    steps: tuple[Step, ...]
    final: Trial
    """The last that was accepted, without suspects that it does not need."""


def select(bench: Bench, baseline: Trial, suspects: Sequence[Suspect], say: Say) -> Selection:
    """Rounds until nothing is left over, or no suspect removes enough of what is."""
    best, steps = baseline, []
    while not best.complete and len(best.suspects) < MOST_ACCEPTED:
        left = [suspect for suspect in suspects if suspect not in best.suspects]
        say("screening the suspects")
        screening = screen(best.found.problem, best.found.x, left)
        trials = _race(bench, best, screening, say)
        accepted = next((trial for trial in trials[:1] if _better(trial, best)), None)
        steps.append(Step(screening, tuple(trials), accepted))
        if accepted is None:
            break
        best = accepted
    return Selection(baseline, tuple(steps), _needed(bench, best, say))


def _needed(bench: Bench, best: Trial, say: Say) -> Trial:
    """Without the suspects that the others make superfluous, now that the search knows where to end.

    A search that went astray in an early round leaves something over, and invites a suspect that is none.
    """
    for suspect in best.suspects:
        if len(best.suspects) > 1:
            say(f"checking whether {suspect.label} is needed")
            trial = bench.without(suspect, best)
            if trial.complete or trial.left_over <= best.left_over:
                best = trial
    return best


def _better(trial: Trial, best: Trial) -> bool:
    above = best.left_over - min(1.0, best.left_over)
    return best.left_over - trial.left_over > LEAST_GAIN * above


def _race(bench: Bench, best: Trial, screening: Screening, say: Say) -> list[Trial]:
    """The most promising, alone and in the best pair, fitted cold; who falls behind is stopped."""
    entered = _entered(screening)
    rough = []
    for screened in entered:
        suspects = (*best.suspects, *screened.suspects)
        say(f"trying {' and '.join(suspect.label for suspect in screened.suspects)}")
        rough.append((suspects, *bench.rough(suspects)))
    if not rough:
        return []
    least = min(cost for _, _, cost in rough)
    trials = []
    for suspects, found, cost in rough:
        if cost <= BEHIND * least:
            say(f"fitting {' and '.join(suspect.label for suspect in suspects)}")
            trials.append(bench.finish(suspects, found, cost))
        else:
            trials.append(bench.stop(suspects, found, cost))
    return sorted(trials, key=lambda trial: trial.left_over)


def _entered(screening: Screening) -> list[Screened]:
    singles = screening.singles
    if not singles:
        return []
    entered = [found for found in singles[:MOST_IN_RACE] if found.gain >= WORTH * singles[0].gain]
    pair = screening.pairs[0] if screening.pairs else None
    if pair and pair.gain > 1.5 * singles[0].gain:
        entered.append(pair)
    return entered


def credibility(trials: Sequence[Trial], draws: int = 2000, seed: int = 1) -> dict[tuple[str, ...], float]:
    """In which share of resampled sets of held-out recordings each trial leaves the least over.

    Whole recordings are resampled: samples of one err together, so that their number proves nothing.
    """
    tables = [trial.by_recording() for trial in trials]
    files = sorted(tables[0])
    squares = np.array([[table[file] for file in files] for table in tables])
    random = np.random.default_rng(seed)
    drawn = random.integers(len(files), size=(draws, len(files)))
    winners = np.argmin(squares[:, drawn].sum(axis=2), axis=0)
    shares = np.bincount(winners, minlength=len(trials)) / draws
    return {
        tuple(suspect.label for suspect in trial.suspects): float(share)
        for trial, share in zip(trials, shares, strict=True)
    }
